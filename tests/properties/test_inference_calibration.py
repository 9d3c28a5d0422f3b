"""Posteriors are calibrated, and close in on the truth as tests grow."""

import runpy
from pathlib import Path

import numpy as np
import pytest

VALIDATION = runpy.run_path(str(Path(__file__).parents[2] / "validation" / "inference.py"))

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")]


def test_ranks_of_the_truth_are_uniform():
    campaigns = 120
    names, ranks, *_ = VALIDATION["ranks"](campaigns, points=20_000, samples=2000)
    for name, own in zip(names, ranks.T, strict=True):
        # Three parameters: a right posterior fails this once in three hundred seeds.
        assert VALIDATION["p_value"](own) > 1e-3, name
        # 90 % of 120 campaigns, three standard deviations of the binomial.
        share = VALIDATION["coverage"](own)
        assert abs(share - 0.9) < 3.0 * np.sqrt(0.9 * 0.1 / campaigns), name


def test_more_tests_find_the_truth():
    """The lower bound, which the peaks see; 16 times the tests, a good half of the error."""
    errors = []
    for tests in (10, 160):
        names, _, truth, means = VALIDATION["ranks"](
            25, tests, seed=3, points=20_000, samples=2000
        )
        i = names.index("marginal.low")
        errors.append(np.sqrt(np.mean((means[:, i] - truth[:, i]) ** 2)))
    # The bound hides behind the correlation length, so that it is not a quarter.
    assert errors[1] < 0.7 * errors[0]
