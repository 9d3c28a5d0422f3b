"""Marginals in engineers' parameters: mean and coefficient of variation are those of the field."""

import dataclasses

import numpy as np
import pytest
import scipy.stats

import stiction as st
from stiction.random.marginals import affine_parameters

SPECTRUM = st.PowerLawSpectrum(correlation_length=2e-3)
EACH = [
    st.Lognormal(mean=1e6, cv=0.2, low=0.3e6),
    st.Weibull(mean=1e6, cv=0.2, low=0.3e6),
    st.Gamma(mean=1e6, cv=0.2, low=0.3e6),
    st.TruncatedNormal(mean=1e6, cv=0.2, low=0.6e6),
    st.TruncatedNormal(mean=1e6, cv=0.2, low=0.6e6, high=1.5e6),
]


@pytest.mark.parametrize("marginal", EACH, ids=lambda one: one.type)
def test_fields_have_the_moments_and_bounds_that_were_given_and_files_hold_them(marginal):
    frozen = marginal.distribution
    # To what the equations for scipy's parameters are solved to.
    assert frozen.mean() == pytest.approx(marginal.mean, rel=1e-9)
    assert frozen.std() == pytest.approx(marginal.cv * marginal.mean, rel=1e-7)
    assert frozen.support()[0] == marginal.low
    field = st.RandomField(marginal, SPECTRUM)
    interface = st.Interface(length=0.2, nodes=512)
    values = field.sample(interface, samples=2000, seed=3)[:, 0]
    # 0.043 is exceeded once in a thousand times by 2,000 independent values.
    assert scipy.stats.kstest(values, frozen.cdf).statistic < 0.043
    table = {"type": marginal.type, "mean": 1e6, "cv": 0.2, "low": marginal.low}
    high = getattr(marginal, "high", None)
    table |= {"high": high} if high else {}
    assert st.RandomField(table, SPECTRUM) == field


def test_against_the_textbook():
    """Lognormal: sigma^2 = ln(1 + cv^2); Weibull of shape 2: cv = sqrt(4/pi - 1)."""
    lognormal = st.Lognormal(mean=2.0, cv=0.3).distribution
    sigma = np.sqrt(np.log(1.09))
    assert lognormal.ppf(0.5) == pytest.approx(2.0 * np.exp(-0.5 * sigma**2), rel=1e-12)
    rayleigh = st.Weibull(mean=1.0, cv=np.sqrt(4.0 / np.pi - 1.0)).distribution
    assert rayleigh.args[0] == pytest.approx(2.0, rel=1e-9)
    assert st.Gamma(mean=3.0, cv=1.0).distribution.sf(3.0) == pytest.approx(np.exp(-1.0))
    symmetric = st.TruncatedNormal(mean=1.0, cv=0.2, low=0.5, high=1.5).distribution
    assert symmetric.ppf(0.5) == pytest.approx(1.0, rel=1e-9)


def test_names_of_scipy_still_mean_scipy():
    scipys = st.RandomField({"type": "gamma", "a": 2.0, "scale": 1e6}, SPECTRUM)
    assert scipys.mean == pytest.approx(2e6)
    ours = st.RandomField({"type": "gamma", "mean": 2e6, "cv": 0.5}, SPECTRUM)
    assert ours.standard_deviation == pytest.approx(1e6)


@pytest.mark.parametrize(
    "marginal",
    [*EACH, st.Lognormal(mean=1e6, cv=0.2), st.Beta(alpha=2.0, beta=3.0, low=1.0, high=4.0)],
)
def test_parameters_that_shift_or_scale_are_declared(marginal):
    names, a, b = affine_parameters(marginal)
    shape = (marginal.distribution.ppf([0.2, 0.9]) - a) / b
    for name in names:
        moved = dataclasses.replace(marginal, **{name: 1.1 * getattr(marginal, name)})
        _, c, d = affine_parameters(moved)
        np.testing.assert_allclose(
            (moved.distribution.ppf([0.2, 0.9]) - c) / d, shape, rtol=1e-9
        )
    bounded = isinstance(marginal, st.Beta)
    assert bool(names) == (bounded or marginal.low == 0.0)
