"""Conditioned fields against GSTools' kriging, and tails against counting."""

import gstools
import numpy as np
import pytest
import scipy.stats
import xarray as xr

import stiction as st

NOISE = 20e3


def test_mean_and_deviation_are_those_of_gstools_kriging():
    """A line of 60 correlation lengths, so that GSTools, which knows no period, has the same."""
    line = st.Interface(length=0.06, nodes=512)
    spectrum = st.SquaredExponentialSpectrum(1e-3, power_kept=1.0 - 1e-9)
    field = st.RandomField(scipy.stats.norm(1e6, 0.2e6), spectrum, mean_mode=True)
    x = np.linspace(0.02, 0.03, 37)
    values = np.interp(x, line.x, field.sample(line, seed=3)[0])
    given = field.given(xr.DataArray(values, {"x": x}, "x"), noise=NOISE)
    # exp(-(pi/4) (x/len_scale)^2) there is exp(-(x/xi_0)^2) here.
    model = gstools.Gaussian(dim=1, var=0.04e12, len_scale=0.5 * np.pi**0.5 * 1e-3)
    kriging = gstools.krige.Simple(model, [x], values, mean=1e6, cond_err=NOISE**2, exact=False)
    mean, variance = kriging([line.x])
    # The two variograms differ by the mean mode and the period: 1e-4 of the deviation.
    np.testing.assert_allclose(given.quantile(line, 0.5), mean, atol=2e-3 * 0.2e6)
    ends = [given.quantile(line, float(scipy.stats.norm.cdf(z))) for z in (-1.0, 1.0)]
    np.testing.assert_allclose(0.5 * (ends[1] - ends[0]), variance**0.5, atol=2e-3 * 0.2e6)


@pytest.mark.slow
@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_failure_probability_of_a_scanned_specimen_is_that_of_counting(probability):
    problem = st.paper.problem(nodes=256)
    field = st.paper.strength(problem, correlation_ratio=1.0)
    x = problem.interface.x[:85]
    scan = xr.DataArray(field.sample(problem.interface, seed=4)[0, :85], {"x": x}, "x")
    given = field.given(scan, noise=NOISE)
    method, count = st.LocalCriterion(), 200_000
    counted = st.monte_carlo(
        problem, given, method=method, samples=count, seed=8, pilot=False, progress=False
    ).critical_stress
    stress = float(counted.quantile(probability))
    found = st.failure_probability(
        problem, given, stress, method=method, algorithm="subset", target_cv=0.1, progress=False
    )
    error = np.hypot((probability * count) ** -0.5, found.cv)
    assert abs(np.log(found.probability / probability)) < 3.5 * error
