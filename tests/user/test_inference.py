"""Inference beside other computations: all permutations by hand, and libraries of others."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.stats import permutation_test

import stiction as st


def test_p_values_of_agreement_are_those_of_all_permutations():
    """Of three peaks and six predicted ones, by hand: Cramer-von Mises over all 84 choices."""
    own, others = np.array([3.0, 8.0, 9.0]), np.array([1.0, 2.0, 4.0, 5.0, 8.0, 7.0])
    every = np.concatenate([own, others])

    def away(*samples):
        below = [np.mean(some[:, None] <= every, axis=0) for some in samples]
        return below[0] - below[1]

    tests = [
        permutation_test((own, others), distance, n_resamples=np.inf, alternative="greater")
        for distance in (
            lambda *samples: np.mean(away(*samples) ** 2) * 3,
            lambda *samples: np.abs(away(*samples)).max() * np.sqrt(3),
        )
    ]
    exact = np.array([test.pvalue for test in tests])
    predicted = xr.Dataset({"critical_stress": ("sample", others)})
    found = st.statistics.agreement(predicted, own, unit="Pa", replicates=8000)
    ((at, share),) = found.predicted
    assert share[[0, 3, -1]] == pytest.approx([1 / 6, 3 / 6, 1.0])  # up to 1, 4 and 9
    assert np.interp(6.0, at, share) == pytest.approx(4.5 / 6)  # 4 of 6 up to 5, and 5 up to 7
    assert (found.cramer_von_mises, found.largest_deviation) == pytest.approx(
        tuple(test.statistic for test in tests)
    )
    error = np.sqrt(exact * (1.0 - exact) / 8000)
    assert np.all(np.abs(np.array(list(found.p_values.values())) - exact) < 4.0 * error + 2e-4)


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def example(monkeypatch, tmp_path):
    """Run an example in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda name: runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_openturns_works_on_the_limit_state(example, capsys):
    pytest.importorskip("openturns")
    found = example("outside_openturns")
    theirs, own = found["found"], found["own"]
    error = np.hypot(theirs.getCoefficientOfVariation(), own.cv)
    ratio = theirs.getProbabilityEstimate() / own.probability
    assert abs(np.log(ratio)) < 4.0 * error  # joint standard errors
    assert "OpenTURNS" in capsys.readouterr().out


@pytest.mark.slow
def test_dynesty_finds_the_same_posterior(example):
    """Another sampler, likelihood and no scaling: 60 live points, two minutes."""
    pytest.importorskip("dynesty")
    found = example("outside_dynesty")
    for i, name in enumerate(found["names"]):
        own = found["posterior"].draws[name].ravel()
        # Sixty live points leave a tenth of the width; two seeds gave 0.04 to 0.11.
        assert abs(found["draws"][:, i].mean() - own.mean()) < 0.3 * own.std(), name
    # Silverman's kernel widens the variance of 1000 peaks by 750^-0.4, which each of the 25 pays.
    # Nested sampling adds sqrt(information / live points), 0.22 here: three of them.
    smoothing = 0.5 * 25 * np.log1p(750.0**-0.4)
    expected = found["posterior"].log_evidence - smoothing
    assert found["evidence"] == pytest.approx(expected, abs=0.66)
