"""Second branches of inference: a guide of no use, threads in an estimate, peaks with a unit."""

import numpy as np
import pytest
from setups import LOCAL, make_problem
from stand_ins import StandIn

import stiction as st

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
