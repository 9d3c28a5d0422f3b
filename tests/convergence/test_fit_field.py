"""What `st.fit_field` finds comes nearer to the truth as data grow, and its intervals hold it."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import stiction as st

SCRIPT = Path(__file__).parents[2] / "validation" / "fit_coverage.py"
specification = importlib.util.spec_from_file_location("fit_coverage", SCRIPT)
assert specification is not None
assert specification.loader is not None
fit_coverage = importlib.util.module_from_spec(specification)
specification.loader.exec_module(fit_coverage)


def errors(lengths, seeds):
    """Relative errors of correlation length and standard deviation over some records."""
    case = fit_coverage.CASES["squared exponential, Weibull"]
    interface = st.Interface(
        length=lengths * fit_coverage.LENGTH, nodes=lengths * fit_coverage.POINTS
    )
    found = []
    for seed in seeds:
        fit = st.fit_field(
            fit_coverage.record(case, lengths, 0.2, seed), interface, marginal=case.marginal,
            spectrum=case.spectrum, bootstrap=20, progress=False,
        )  # fmt: skip
        truth = fit_coverage.truth_of(case, 0.2)
        found.append([fit.parameters[name] / value - 1.0 for name, value in truth.items()
                      if name in fit.parameters])  # fmt: skip
    return np.sqrt(np.mean(np.square(found), axis=0))


@pytest.mark.slow
def test_recovery_as_data_grow():
    """Sixteen times the record: a quarter of the error, to the scatter of 12 records each."""
    short, long = errors(20, range(12)), errors(320, range(12))
    assert np.all(long < 0.6 * short)
    assert np.median(long / short) < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["squared exponential, Weibull", "exponential, lognormal"])
def test_intervals_hold_the_truth(name):
    """A smaller form of validation/fit_coverage.py: 40 records, all parameters together.

    Intervals of 90 % held 36 of 40; of so few, with parameters that depend on each other, less than
    30 (75 %) would happen once in a thousand times.
    """
    case = fit_coverage.CASES[name]
    found = fit_coverage.coverage(case, 20, 0.2, records=40, bootstrap=60)
    assert np.mean([share for share, _ in found.values()]) > 0.8
    assert min(share for share, _ in found.values()) > 0.7
