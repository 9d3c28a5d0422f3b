"""What `st.fit_field` finds comes nearer to the truth as data grow, and its intervals hold it."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import stiction as st

SCRIPT = Path(__file__).parents[2] / "validation" / "fit_coverage.py"
COVERAGE = runpy.run_path(str(SCRIPT))
CASES = COVERAGE["CASES"]

pytestmark = pytest.mark.slow


def errors(lengths, seeds):
    """Relative errors of correlation length and standard deviation over some records."""
    case = CASES["squared exponential, Weibull"]
    interface = st.Interface(lengths * COVERAGE["LENGTH"], lengths * COVERAGE["POINTS"])
    options = {"marginal": case.marginal, "spectrum": case.spectrum, "bootstrap": 20}
    found = []
    for seed in seeds:
        record = COVERAGE["record"](case, lengths, 0.2, seed)
        fit = st.fit_field(record, interface, progress=False, **options)
        truth = COVERAGE["truth_of"](case, 0.2)
        found.append([fit.parameters[name] / value - 1.0 for name, value in truth.items()
                      if name in fit.parameters])  # fmt: skip
    return np.sqrt(np.mean(np.square(found), axis=0))


def test_recovery_as_data_grow():
    """Sixteen times the record: a quarter of the error, to the scatter of 12 records each."""
    short, long = errors(20, range(12)), errors(320, range(12))
    assert np.all(long < 0.6 * short)
    assert np.median(long / short) < 0.4


@pytest.mark.parametrize("name", ["squared exponential, Weibull", "exponential, lognormal"])
def test_intervals_hold_the_truth(name):
    """A smaller form of validation/fit_coverage.py: 40 records, all parameters together.

    Intervals of 90 % held 36 of 40; of so few, with parameters that depend on each other, less than
    30 (75 %) would happen once in a thousand times.
    """
    case = CASES[name]
    found = COVERAGE["coverage"](case, 20, 0.2, records=40, bootstrap=60)
    assert np.mean([share for share, _ in found.values()]) > 0.8
    assert min(share for share, _ in found.values()) > 0.7
