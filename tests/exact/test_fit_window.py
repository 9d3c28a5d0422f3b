"""The expected periodogram of a window against sums over all pairs of points."""

import numpy as np
import pytest
from setups import beta_strength

import stiction as st
from stiction.inference.estimate import bands
from stiction.inference.whittle import Observed, SpectrumFamily, Whittle, periodograms_of
from stiction.inference.window import RecordWindow

SPACING = 1e-4
SPECTRUM = st.PowerLawSpectrum(1.5e-3, exponent=1.5)


def window_of(points, *options, spacing=SPACING):
    return RecordWindow((spacing,), np.ones(points, dtype=bool), *options)


def by_brute_force(window, covariance):
    """E |u_k y|^2 with u = P (h exp(-ikx)), from the whole covariance matrix, (*half)."""
    known = window.measured.ravel()
    projection = np.eye(known.sum()) - window.basis @ window.basis.T
    nodes = np.indices(window.shape).reshape(len(window.shape), -1)
    axes = zip(np.broadcast_arrays(*window.wave_vectors), nodes, window.spacings, strict=True)
    phase = sum(np.outer(k, at * spacing) for k, at, spacing in axes)
    rows = (np.exp(-1j * phase) * window.taper.ravel())[:, known] @ projection
    found = np.einsum("ki,ij,kj->k", rows, covariance[np.ix_(known, known)], rows.conj()).real
    return found.reshape(window.white.shape)


@pytest.mark.parametrize(("degree", "gap"), [(0, slice(0, 0)), (3, slice(30, 40))])
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
    # And the correlation is that of the whole spectrum on an infinite line.
    np.testing.assert_allclose(
        rho[:96], SPECTRUM.untruncated_correlation(at * SPACING), atol=1e-3
    )


def test_expectation_and_trend_of_a_map():
    """With a gap, without a trend of the second degree, which nothing is left of."""
    measured = np.ones((14, 11), dtype=bool)
    measured[3:6, 7:10] = False
    window = RecordWindow((1e-4, 1.3e-4), measured, 2)
    rho = window.correlation(window.power(SPECTRUM, 1.4))
    nodes = np.indices(measured.shape).reshape(2, -1)
    covariance = rho[tuple(nodes[:, :, None] - nodes[:, None, :])]
    found, expected = window.expectation(rho), by_brute_force(window, covariance)
    low = np.ix_([0, 1, 2, -2, -1], [0, 1, 2])
    np.testing.assert_allclose(found[low].ravel()[1:], expected[low].ravel()[1:], rtol=1e-9)
    x, y = (place[measured] for place in np.indices(measured.shape))
    values = np.random.default_rng(2).uniform(1.0, 2.0, x.size)
    trend = 3.0 + 0.4 * x - 0.1 * y**2 + 0.2 * x * y
    rest, same = (window.without_trend(each) for each in (values, values + trend))
    np.testing.assert_allclose(same - rest, trend.mean(), rtol=1e-10)
    assert rest.mean() == pytest.approx(values.mean(), rel=1e-12)
    powers = [window.periodogram(each) for each in (values, rest, same)]
    np.testing.assert_allclose(powers[1:], [powers[0]] * 2, rtol=1e-8, atol=1e-12)


def test_power_above_the_sampling_wavenumber_is_folded_back():
    """A third of this spectrum's power lies above what its points resolve."""
    rough = st.ExponentialSpectrum(5e-4)
    assert 1.0 - rough.power_within(np.pi / 1e-3) > 0.3
    window = window_of(64, spacing=1e-3)
    rho = window.correlation(window.power(rough))
    assert rho[0] == pytest.approx(1.0)
    # What is folded more than six times is taken for white.
    expected = rough.untruncated_correlation(1e-3 * np.arange(1, 32))
    np.testing.assert_allclose(rho[1:32], expected, atol=2e-3)


def test_a_map_has_the_correlation_of_the_plane():
    spectrum = st.PowerLawSpectrum(1e-3, exponent=2.0, power_kept=0.9999)
    window = RecordWindow((1e-4, 1.2e-4), np.ones((48, 40), dtype=bool))
    rho = window.correlation(window.power(spectrum, 1.5))
    plane = st.Interface(length=(192 * 1e-4, 160 * 1.2e-4), nodes=(192, 160))
    marginal = beta_strength(1.0).marginal
    field = st.RandomField(marginal, spectrum, mean_mode=True, anisotropy=1.5)
    expected = field.correlation(plane, of="z")
    np.testing.assert_allclose(rho[:20, :20], expected[:20, :20], atol=1e-3)


def test_simulated_records_have_the_expectation():
    window, rng = window_of(128, 1), np.random.default_rng(0)
    power = window.power(SPECTRUM)
    records = [window.periodogram(window.sample(power, rng)) for _ in range(2000)]
    ratio = np.mean(records, axis=0)[1:] / window.expectation(window.correlation(power))[1:]
    # Each is a mean of 2,000 exponential numbers: 2.2 %; the largest of 64 reaches 3.5 times that.
    assert np.abs(ratio - 1.0).max() < 0.08


GAP = np.ones(512, dtype=bool)
GAP[40:49] = False
CROOKED = RecordWindow((SPACING,), GAP, 2), window_of(48, 1, spacing=1.7e-4)
"""Records of two geometries, with trends."""
MAP = RecordWindow((1e-4, 1.2e-4), np.ones((14, 11), dtype=bool), 1)
SHARES = np.array([0.0, 0.9, 0.08, 0.02])


@pytest.mark.parametrize(
    ("windows", "noise", "longest"),
    [(CROOKED, None, 1.0), (CROOKED, 0.5, 1.0), ((MAP,), None, 1.0), (CROOKED, None, 1.1e-3)],
    ids=["lines", "of a known noise", "map", "at an end of a range"],
)
def test_score_and_information_are_derivatives_of_the_likelihood(windows, noise, longest):
    """By differences: of any record, and where each is as expected, the information."""
    ratio = None if windows[0].measured.ndim == 2 else 1.0
    family = SpectrumFamily("power_law", {}, ratio, noise, (1e-4, longest))
    values = {"variance": 2.3, "correlation_length": 1.1e-3, "exponent": 1.7, "anisotropy": 1.4}
    at = family.vector([(values | {"noise_share": 0.13})[name] for name in family.free])
    rng, step = np.random.default_rng(7), 1e-3
    model = family.model(at, SHARES)
    expected = [model.expectation(window) for window in windows]
    for as_expected in (False, True):
        observed = []
        for window, e, count, floor in zip(
            windows, expected, (2, 5), (0.02, 0.05), strict=False
        ):
            powers = e if as_expected else e * rng.exponential(size=e.shape)
            observed.append(Observed(window, count, powers, floor))
        whole = Whittle(family, SHARES, observed)
        score, information = whole.score(at, whole.value(at)[1])
        moved = at + step * np.stack([np.eye(at.size), -np.eye(at.size)])
        slopes = np.array(
            [[whole.score(p, whole.value(p)[1])[0] for p in side] for side in moved]
        )
        likely = np.array([[whole.value(p)[0] for p in side] for side in moved])
        by_differences = (likely[0] - likely[1]) / (2.0 * step)
        size = np.sqrt(np.diag(information))
        # In standard errors; the code's own differences are one-sided, over 1e-4.
        np.testing.assert_allclose(score / size, by_differences / size, atol=5e-3)
        if as_expected:
            curvature = (slopes[1] - slopes[0]) / (2.0 * step)
            both = np.outer(size, size)
            np.testing.assert_allclose(information / both, curvature / both, atol=1e-3)


def test_the_likelihood_of_many_records_is_the_sum_of_theirs():
    """Of three of one geometry and two of another, over all wavenumbers of a whole transform."""
    family = SpectrumFamily("power_law", {}, 1.0, None, (1e-4, 1.0))
    at, rng = family.vector([2.3, 1.1e-3, 1.7, 0.13]), np.random.default_rng(8)
    model, total = family.model(at, SHARES), 0.0
    windows = [CROOKED[number] for number in (0, 1, 0, 1, 0)]
    rows = [rng.standard_normal(int(window.measured.sum())) for window in windows]
    observed = periodograms_of(rows, windows)
    for window, floor in zip(CROOKED, (group.floor for group in observed), strict=True):
        e, own = (
            model.expectation(window),
            [row for row, w in zip(rows, windows, strict=True) if w is window],
        )
        powers = np.array([window.periodogram(row) for row in own])
        assert 3e-4 * powers.mean() < floor < 3e-3 * powers.mean()
        terms = np.log(e + floor) + (powers + floor) / (e + floor)
        n = window.shape[0]
        every = terms[:, np.minimum(np.arange(1, n), n - np.arange(1, n))]
        total -= 0.5 * every.sum()  # k and -k are one
    assert Whittle(family, SHARES, observed).value(at)[0] == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("window", [CROOKED[0], MAP], ids=["gap", "map"])
def test_bands_are_means_over_thirds_of_an_octave(window):
    """Of wavenumber, periodogram and expectation, one band after the other; not of the mean."""
    rng, shape = np.random.default_rng(4), window.white.shape
    average, expected = rng.uniform(size=(2, *shape))
    k = np.zeros(shape)
    for axis in window.wave_vectors:
        k = np.hypot(k, axis)
    lowest = np.min(k[k > 0.0])
    rows = []
    for number in range(30):
        inside = (k > 0.0) & (np.round(3.0 * np.log2(np.maximum(k, lowest) / lowest)) == number)
        if inside.any():
            rows.append([field[inside].mean() for field in (k, average, expected)])
    found = bands(Observed(window, 2, average, 0.0), expected)
    np.testing.assert_allclose(found, rows, rtol=1e-12)
