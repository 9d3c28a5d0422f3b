"""Random fields on planes against sums of their modes, closed forms and the line."""

import dataclasses

import numpy as np
import pytest
from checks import assert_mean
from scipy.integrate import quad
from setups import beta_strength

import stiction as st

LINE = st.Interface(length=4.0, nodes=128)
PLANE = st.Interface(length=(4.0, 4.0), nodes=(128, 128))
SPECTRA = [
    st.PowerLawSpectrum(correlation_length=0.3, power_kept=0.9999),
    st.PowerLawSpectrum(correlation_length=0.3, exponent=1.2, power_kept=0.9),
    st.SquaredExponentialSpectrum(correlation_length=0.3),
    st.ExponentialSpectrum(correlation_length=0.3, power_kept=0.95),
]
EACH = pytest.mark.parametrize(
    "spectrum", SPECTRA, ids=lambda s: f"{s.type} {getattr(s, 'exponent', '')}"
)


def field_of(spectrum, **options):
    return dataclasses.replace(beta_strength(1.0), spectrum=spectrum, **options)


@pytest.mark.parametrize("shape", [(16, 10), (32, 32), (8, 48)])
@pytest.mark.parametrize("mean_mode", [False, True])
def test_field_is_the_sum_of_all_modes_in_the_ellipse_on_any_grid(shape, mean_mode):
    """Waves that a grid does not resolve, and those of Nyquist, included."""
    field = beta_strength(0.05, mean_mode=mean_mode, anisotropy=1.7)
    plane = st.Interface(length=(0.4, 0.3), nodes=shape)
    modes = field.modes(plane)
    draws = st.RandomInterface(strength=field).draws(plane, 2, seed=3)
    numbers = [tuple(pair) for pair in modes.numbers[:, 1:].T.tolist()]
    cutoff = 2.5 * 2.0 * np.pi / 0.05 * (1.0 + 1e-12)  # (20, 0) lies on it
    wanted = {
        (i, j)
        for i in range(-40, 41)
        for j in range(41)
        if (j > 0 or i > 0) and 2.0 * np.pi * np.hypot(i / 0.4, 1.7 * j / 0.3) <= cutoff
    }
    assert len(set(numbers)) == modes.ranks.size
    assert set(numbers) == wanted
    assert np.abs(numbers).max(axis=0).tolist() == [20, 8]
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    z = draws[:, :, None, None]
    direct = np.zeros((2, *shape)) + modes.sigma[0] * z[:, 0] * mean_mode
    for j, (m, n) in enumerate(numbers):
        phase = 2.0 * np.pi * (m * x / 0.4 + n * y / 0.3)
        a, b = z[:, mean_mode + 2 * j], z[:, mean_mode + 2 * j + 1]
        direct += modes.sigma[j + 1] * (a * np.cos(phase) + b * np.sin(phase))
    # Round-off of a sum of 548 terms.
    np.testing.assert_allclose(modes.gaussian(draws), direct, atol=1e-12)
    assert np.sum(modes.sigma**2) == pytest.approx(1.0, rel=1e-13)


@EACH
def test_a_cut_has_the_correlation_of_the_line(spectrum):
    """Of z and of the strength, on the periodic grid, but for what truncation leaves out."""
    field = field_of(spectrum, mean_mode=True)
    left_out = 1.0 - spectrum.power_within(spectrum.cutoff(2), 2)
    for of in ("z", "strength"):
        plane, line = field.correlation(PLANE, of=of), field.correlation(LINE, of=of)
        assert plane[0, 0] == pytest.approx(1.0, rel=1e-12)
        # Each is a mean of cosines with its share missing, and 1 at zero lag.
        assert np.abs(plane[:, 0] - line).max() <= 2.0 * left_out + 1e-6
        np.testing.assert_allclose(plane, plane.T, atol=1e-12)


@EACH
def test_density_on_the_plane_integrates_to_the_line_across(spectrum):
    """g(kx) of the line is the integral over ky of the plane's: inverse Abel transform, checked."""
    wave = 2.0 * np.pi / 0.3
    k = np.array([0.0, 0.3, 1.0, 2.0]) * wave

    def density(q, a=0.0):
        return spectrum.density(np.hypot(a, q), 2)

    across = np.array([quad(lambda q, a=a: density(q * wave, a), 0.0, np.inf)[0] for a in k])
    along = spectrum.density(k)
    # 1e-7 of the quadrature, or of the integral at k = 0.
    np.testing.assert_allclose(across / across[0], along / along[0], rtol=1e-7, atol=1e-9)
    cutoff = spectrum.cutoff(2)
    inside, outside = (
        quad(lambda q: q * density(q), *ends, limit=200)[0]
        for ends in ((0.0, cutoff), (cutoff, np.inf))
    )
    share = inside / (inside + outside)
    assert share == pytest.approx(spectrum.power_within(cutoff, 2), rel=1e-6)
    assert share == pytest.approx(spectrum.power_kept or spectrum.default_power, rel=1e-6)


def test_own_spectrum_is_the_density_on_the_plane():
    named = st.SquaredExponentialSpectrum(correlation_length=0.3, power_kept=0.99)
    own = st.CustomSpectrum(
        function=lambda k: named.density(k, 2), max_wavenumber=named.cutoff(2)
    )
    one, other = (field_of(s, mean_mode=True).modes(PLANE).sigma for s in (named, own))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_sampled_correlation_is_the_exact_one():
    """Mean, variance and correlation of the strength, anisotropy included, without a mean mode."""
    plane = st.Interface(length=(1.0, 1.5), nodes=(32, 24))
    field = beta_strength(0.25, anisotropy=2.0)
    strength = field.sample(plane, samples=1500, seed=1)
    scaled = (strength - field.mean) / field.standard_deviation
    power = np.abs(np.fft.fft2(scaled)) ** 2
    each = np.fft.ifft2(power).real / plane.size  # correlation of each sample, over all places
    error = each.std(axis=0) / np.sqrt(1500)
    correlation = field.correlation(plane)
    # Of 768 lags, largely dependent, none is likely to be 4.5 standard errors off.
    assert (np.abs(each.mean(axis=0) - correlation) < 4.5 * error).all()
    assert_mean(scaled.mean(axis=(1, 2)), 0.0, errors=4.5)
    # Twice as far along y; the modes of a small plane are few.
    assert correlation[0, 4] == pytest.approx(correlation[4, 0], abs=0.01)


def test_a_mode_keeps_its_draws_whatever_the_spectrum():
    """More modes, or an ellipse of others, extend the same field."""
    plane = st.Interface(length=(1.0, 2.2), nodes=(32, 32))
    fields = [
        beta_strength(0.25),
        beta_strength(0.25, truncation=1.5),
        beta_strength(0.25, anisotropy=2.5),
        field_of(st.ExponentialSpectrum(0.3, power_kept=0.8), mean_mode=True),
    ]
    known = {}
    for field in fields:
        modes = field.modes(plane)
        draws = st.RandomInterface(strength=field).draws(plane, 1, seed=2)[0]
        pairs = draws[int(field.mean_mode) :].reshape(-1, 2)
        for number, pair in zip(modes.numbers[:, 1:].T.tolist(), pairs, strict=True):
            assert known.setdefault(tuple(number), tuple(pair)) == tuple(pair)
    shared = fields[2].modes(plane).ranks.size
    assert len(known) > shared


@pytest.mark.parametrize("shape", [(8, 48), (48, 8)])
def test_waves_that_one_direction_does_not_resolve_are_warned_of(shape):
    """The variance beyond half the nodes along x or y, from the density at all waves."""
    plane = st.Interface(length=(1.0, 1.3), nodes=shape)
    field = beta_strength(0.2, anisotropy=0.8, mean_mode=True)
    i, j = np.meshgrid(np.arange(-40, 41), np.arange(-40, 41), indexing="ij")
    k = 2.0 * np.pi * np.hypot(i, 0.8 * j / 1.3)
    power = field.spectrum.density(k, 2) * (k <= field.spectrum.cutoff(2))
    beyond = (np.abs(i) > shape[0] // 2) | (np.abs(j) > shape[1] // 2)
    share = power[beyond].sum() / power.sum()
    assert field.modes(plane).unresolved == pytest.approx(share, rel=1e-9)
    with pytest.warns(st.AccuracyWarning, match=rf"but {100.0 * share:.2g} % of the variance"):
        field.sample(plane)
