"""Second branches of inference: a guide of no use, threads in an estimate, peaks with a unit."""

from types import SimpleNamespace

import numpy as np
import pytest
from setups import LOCAL, make_problem
from stand_ins import StandIn

import stiction as st
from stiction.base.progress import duration
from stiction.inference import likelihood as likelihoods

PROBLEM = make_problem(64, 0.05, width=0.013, weakening_rate=0.25e12)
FIELD = st.RandomField(st.Gamma(mean=1e6, cv=0.2), st.PowerLawSpectrum(4e-3), mean_mode=True)
PEAKS = np.array([0.78e6, 0.83e6, 0.8e6, 0.86e6])


@pytest.mark.parametrize("share", [0.2, 0.45])
def test_a_guide_that_hardly_correlates_is_not_used(share, monkeypatch):
    """Correlations of 0.1 to 0.8: the onsets are those of a simulation at every node."""

    def mixed(rows, stress):
        """A share of the local onset, and the strength at one node for the rest."""
        return share * stress + (1.0 - share) * 0.8 * rows.strength[:, 5]

    given = {
        "prior": {"correlation_length": (2e-3, 6e-3)}, "method": StandIn(mixed), "samples": 100,
        "progress": False,
    }  # fmt: skip
    guided = st.infer(PROBLEM, FIELD, PEAKS, **given)
    options = {"samples": 300, "progress": False, "pilot": False}
    onsets = [
        st.monte_carlo(PROBLEM, FIELD, method=method, **options).critical_stress.values
        for method in (StandIn(mixed), LOCAL)
    ]
    alike = np.corrcoef(*onsets)[0, 1]
    assert 0.1 < alike < 0.8
    monkeypatch.setattr(st.LocalCriterion, "unfit_as_guide", lambda *_: "no guide")
    alone = st.infer(PROBLEM, FIELD, PEAKS, **given)
    for one, other in zip(guided.likelihood.densities, alone.likelihood.densities, strict=True):
        assert one.onsets.shape == other.onsets.shape
    assert guided.mean["correlation_length"] == pytest.approx(
        alone.mean["correlation_length"], rel=1e-6
    )


@pytest.mark.parametrize("workers", [1, 4])
def test_an_estimate_of_the_time_counts_the_threads(workers):
    slow = SimpleNamespace(seconds=9.0, method=SimpleNamespace(label="stand-in"))
    with pytest.warns(UserWarning, match=f"about {duration(9000.0 / workers)}:") as caught:
        likelihoods.warn_if_long(slow, 1000, workers)
    assert len(caught) == 1


@pytest.mark.parametrize("workers", [1, 3])
@pytest.mark.parametrize(
    "prior", [None, {"marginal.mean": (0.8e6, 1.2e6), "marginal.cv": (0.1, 0.3)}]
)
def test_the_estimate_is_told_the_threads_of_the_call(workers, prior, monkeypatch):
    seen = []

    def stop(experiment, samples, threads):
        seen.append(threads)
        raise RuntimeError

    monkeypatch.setattr(likelihoods, "warn_if_long", stop)
    monkeypatch.setattr("stiction.inference.specimens.warn_if_long", stop)
    options = {"prior": prior, "method": st.Equilibrium(), "workers": workers}
    with pytest.raises(RuntimeError):
        st.infer(PROBLEM, FIELD, PEAKS, progress=False, **options)
    assert seen == [workers]
