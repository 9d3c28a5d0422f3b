"""The expected periodogram of a window against sums over all pairs of points."""

import numpy as np
import pytest
from setups import beta_strength

import stiction as st
from stiction.inference.whittle import SpectrumFamily
from stiction.inference.window import RecordWindow

SPACING = 1e-4
SPECTRUM = st.PowerLawSpectrum(1.5e-3, exponent=1.5, power_kept=0.999)


def window_of(points, *options, spacing=SPACING):
    return RecordWindow((spacing,), np.ones(points, dtype=bool), *options)


def model_of(name, parameters, **given):
    """A family's spectrum at some values of its parameters, the first of which is the scale."""
    family = SpectrumFamily(name, given, 1.0, 0.0, (1e-4, 1.0))
    return family.model(np.log(parameters[: len(family.free)]), np.array([0.0, 1.0]))


def by_brute_force(window, covariance):
    """E |u_k y|^2 with u = P (h exp(-ikx)), from the whole covariance matrix."""
    known = window.measured
    projection = np.eye(known.sum()) - window.basis @ window.basis.T
    places = np.arange(known.size) * SPACING
    waves = np.exp(-1j * np.outer(window.wave_vectors[0], places)) * window.taper
    rows = waves[:, known] @ projection
    return np.einsum("ki,ij,kj->k", rows, covariance[np.ix_(known, known)], rows.conj()).real


@pytest.mark.parametrize("degree", [0, 1, 3])
@pytest.mark.parametrize("gap", [slice(0, 0), slice(30, 40)])
def test_expectation_of_a_line(degree, gap):
    at, measured = np.arange(96), np.ones(96, dtype=bool)
    measured[gap] = False
    window = RecordWindow((SPACING,), measured, degree)
    rho = window.correlation(window.power(SPECTRUM))
    expected = by_brute_force(window, rho[np.abs(np.subtract.outer(at, at))])
    found = window.expectation(rho)
    # Up to wave number 16 the trend is in it exactly; above, the taper hides it to a per cent.
    np.testing.assert_allclose(found[1:17], expected[1:17], rtol=1e-9)
    np.testing.assert_allclose(found[17:], expected[17:], rtol=0.02)
    # And the correlation is that of the spectrum on an infinite line; it fades where it is cut.
    np.testing.assert_allclose(rho[:96], SPECTRUM.correlation(at * SPACING), atol=1e-3)


def test_the_end_of_a_spectrum_is_seen_only_if_it_is_given():
    """A long correlation whose usual truncation lies among the wavenumbers of the record.

    A rough spectrum falls as (k xi_0)^-2 there: twice the correlation length is a constant factor
    and nothing else, unless it moves the truncation, which then tells the correlation length.
    """
    whole, cut = (
        np.divide(*(
            model_of("exponential", [1.0, length], **given).signal(window_of(128))[20:-1]
            for length in (6.4e-3, 3.2e-3)
        ))
        for given in ({}, {"truncation": 10.0})
    )  # fmt: skip
    # k xi_0 is 31 at the lowest of these wavenumbers; to that come leaks of the taper.
    np.testing.assert_allclose(whole / whole.mean(), 1.0, atol=0.01)
    assert cut.min() < 0.1 * cut.max()


@pytest.mark.parametrize("name", ["exponential", "power_law"])
def test_a_spectrum_whose_end_is_not_given_is_whole(name):
    """What its usual truncation leaves out, 1 % of a rough one, would be taken for noise."""
    model, window = model_of(name, [1.0, 1e-3, 0.5]), window_of(512)
    rho = window.correlation(model.power(window))[1:64]
    exact = model.spectrum.untruncated_correlation(SPACING * np.arange(1, 64))
    np.testing.assert_allclose(rho, exact, atol=5e-4)


def test_power_above_the_sampling_wavenumber_is_folded_back():
    """A third of this spectrum's power lies above what its points resolve."""
    rough = st.ExponentialSpectrum(5e-4, power_kept=0.99)
    assert 1.0 - rough.power_within(np.pi / 1e-3) > 0.3
    window = window_of(64, spacing=1e-3)
    rho = window.correlation(window.power(rough))
    assert rho[0] == pytest.approx(1.0)
    # What is folded more than six times is taken for white, and a sharp cut leaves ripples.
    np.testing.assert_allclose(rho[1:32], rough.correlation(1e-3 * np.arange(1, 32)), atol=2e-3)


def test_a_map_has_the_correlation_of_the_plane():
    spectrum = st.PowerLawSpectrum(1e-3, exponent=2.0, power_kept=0.99)
    window = RecordWindow((1e-4, 1.2e-4), np.ones((48, 40), dtype=bool))
    rho = window.correlation(window.power(spectrum, 1.5))
    plane = st.Interface(length=(192 * 1e-4, 160 * 1.2e-4), nodes=(192, 160))
    marginal = beta_strength(1.0).marginal
    field = st.RandomField(marginal, spectrum, mean_mode=True, anisotropy=1.5)
    expected = field.correlation(plane, of="z")
    # The truncation fades here and is sharp there: a per cent of the power lies beside it.
    np.testing.assert_allclose(rho[:20, :20], expected[:20, :20], atol=3e-3)


def test_simulated_records_have_the_expectation():
    window, rng = window_of(128, 1), np.random.default_rng(0)
    power = window.power(SPECTRUM)
    records = [window.periodogram(window.sample(power, rng)) for _ in range(4000)]
    ratio = np.mean(records, axis=0)[1:] / window.expectation(window.correlation(power))[1:]
    # Each is a mean of 4,000 exponential numbers: 1.6 %; the largest of 64 reaches 3.5 times that.
    assert np.abs(ratio - 1.0).max() < 0.06
