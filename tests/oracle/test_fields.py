"""Random fields against theory by sampling, and correlations against two other libraries."""

import gstools
import numpy as np
import openturns
import pytest
import scipy.stats

import stiction as st

XI = 2e-3
LAMBDA = 2.0 * np.pi / XI
R = np.linspace(0.0, 2.0 * XI, 41)
CASES = {
    f"power law {p}": (
        st.PowerLawSpectrum(correlation_length=XI, exponent=p),
        gstools.Matern(dim=1, nu=p - 0.5, len_scale=np.sqrt(p - 0.5) / LAMBDA),
        openturns.MaternModel([np.sqrt(2.0 * (p - 0.5)) / LAMBDA], [1.0], p - 0.5),
    )
    for p in (1.0, 1.5, 2.0, 4.0)
}
CASES["exponential"] = (
    st.ExponentialSpectrum(XI), gstools.Exponential(dim=1, len_scale=XI),
    openturns.AbsoluteExponential([XI]),
)  # fmt: skip
CASES["squared exponential"] = (
    st.SquaredExponentialSpectrum(XI), gstools.Gaussian(dim=1, len_scale=XI * np.sqrt(np.pi) / 2),
    openturns.SquaredExponential([XI / np.sqrt(2.0)], [1.0]),
)  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_same_field_elsewhere(name):
    """What docs/guide/random-strength.md says of other libraries, to the last digits."""
    here, other, third = CASES[name]
    expected = here.untruncated_correlation(R)
    np.testing.assert_allclose(other.correlation(R), expected, atol=1e-12)
    np.testing.assert_allclose([third([r])[0, 0] for r in R], expected, atol=1e-12)


def test_correlation_of_a_long_interface_with_its_mean_mode_is_that_of_gstools():
    interface = st.Interface(length=20.0 * XI, nodes=1024)
    spectrum = st.PowerLawSpectrum(correlation_length=XI, power_kept=1.0 - 2.8e-8)
    field = st.RandomField(scipy.stats.norm(5.0, 1.0), spectrum, mean_mode=True)
    expected = CASES["power law 4.0"][1].correlation(interface.x[:100])
    # Truncation at 10 lambda leaves out 4e-8 of the power.
    found = field.correlation(interface, of="z")[:100]
    np.testing.assert_allclose(found, expected, atol=1e-7)
