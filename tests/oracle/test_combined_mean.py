"""Means of few ruptures with the help of many equilibria: honest errors, and worth it on planes."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import stiction as st

EXAMPLE = Path(__file__).parents[2] / "examples" / "rupture_ensemble_on_a_plane.py"


def test_errors_are_honest_and_means_unbiased():
    """Many times over with a known mean: 8 dear results, 60 and 500 cheaper ones."""
    rng = np.random.default_rng(1)
    scores = []
    for _ in range(2000):
        local = rng.normal(0.0, 1.0, 500)
        exact = 0.9 * local + 0.1 * rng.normal(0.0, 1.0, 500)
        dear = 2.0 + exact + 0.02 * rng.normal(0.0, 1.0, 500)
        found = st.statistics.combined_mean(dear[:8], exact[:60], local)
        scores.append((found.estimate.value - 2.0) / found.estimate.error)
        assert found.saving > 1.0
    # Student's t of few results is wider than a normal distribution; 2000 of them give 0.02.
    assert abs(np.mean(scores)) < 0.08
    assert 0.9 < np.std(scores) < 1.4


@pytest.mark.parametrize("expensive", [4, 6])
def test_intervals_of_few_results_cover(expensive):
    """Twice the error held in 77 % of campaigns of four results only."""
    rng = np.random.default_rng(2)
    inside = 0
    for _ in range(1500):
        others = rng.normal(0.0, 1.0, 400)
        results = 1.0 + others[:expensive] + 0.3 * rng.normal(0.0, 1.0, expensive)
        low, high = st.statistics.combined_mean(results, others).interval()
        inside += low < 1.0 < high
    assert 0.935 < inside / 1500 < 0.98  # a standard error of 0.6 %


def test_fewer_inexpensive_results_than_expensive_ones_are_refused():
    with pytest.raises(st.InputError, match=r"inexpensive: each .* \[4, 3\]"):
        st.statistics.combined_mean([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0])
    with pytest.raises(st.InputError, match="at least 3 are needed, got 2"):
        st.statistics.combined_mean([1.0, 2.0])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_eight_ruptures_on_a_plane_are_worth_a_hundred(capsys):
    found = runpy.run_path(str(EXAMPLE))
    mean, ruptures, onsets = (found[name] for name in ("mean", "ruptures", "onsets"))
    assert mean.saving > 10.0
    # The same samples: what inertia adds at this rate is small and positive.
    added = ruptures.first_instability.values / onsets.first_instability.values[:8] - 1.0
    assert np.all((added > -1e-5) & (added < 5e-3))
    assert abs(mean.estimate.value / float(onsets.first_instability.mean()) - 1.0) < 0.02
    assert "MPa" in capsys.readouterr().out
