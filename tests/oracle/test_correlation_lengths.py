"""What docs/correlation-lengths.md says of other libraries holds."""

import numpy as np
import pytest

import stiction as st

gstools = pytest.importorskip("gstools")
openturns = pytest.importorskip("openturns")

XI = 2e-3
LAMBDA = 2.0 * np.pi / XI
R = np.linspace(0.05e-3, 3e-3, 12)
CASES = {
    f"power law {p}": (
        st.PowerLawSpectrum(correlation_length=XI, exponent=p),
        gstools.Matern(dim=1, nu=p - 0.5, len_scale=np.sqrt(p - 0.5) / LAMBDA),
        openturns.MaternModel([np.sqrt(2.0 * (p - 0.5)) / LAMBDA], [1.0], p - 0.5),
    )
    for p in (1.0, 1.5, 4.0)
} | {
    "exponential": (
        st.ExponentialSpectrum(correlation_length=XI),
        gstools.Exponential(dim=1, len_scale=XI),
        openturns.AbsoluteExponential([XI]),
    ),
    "squared exponential": (
        st.SquaredExponentialSpectrum(correlation_length=XI),
        gstools.Gaussian(dim=1, len_scale=XI * np.sqrt(np.pi) / 2.0),
        openturns.SquaredExponential([XI / np.sqrt(2.0)], [1.0]),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_same_field_elsewhere(name):
    """To the last digits: all are closed forms."""
    here, other, third = CASES[name]
    expected = here.untruncated_correlation(R)
    np.testing.assert_allclose(other.correlation(R), expected, atol=1e-12)
    np.testing.assert_allclose([third([r])[0, 0] for r in R], expected, atol=1e-12)
