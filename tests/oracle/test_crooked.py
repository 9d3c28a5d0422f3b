"""Onsets where nothing is symmetric, against a linear programme and a sum over the patch."""

import numpy as np
import pytest
from crooked import LINE, LINE_STRENGTH, PLANE, PLANE_STRENGTH, across_the_seam, uneven
from oracles import angle_rule, dense, largest_load, symbol_of
from setups import exact_onset, local_onset

from stiction.methods.criterion.griffith import release_rates
from stiction.methods.criterion.windows import STRETCHES, weight
from stiction.theory import griffith_length

BOTH = pytest.mark.parametrize(
    ("problem", "strength"),
    [(LINE, LINE_STRENGTH), (PLANE, PLANE_STRENGTH)],
    ids=["line", "plane"],
)


def apart(one, other, length):
    """Distance round the period."""
    return abs((one - other + 0.5 * length) % length - 0.5 * length)


def interpolated(field, shares):
    """A periodic field on a line at shares of a spacing, by its trigonometric interpolant."""
    waves = np.fft.rfft(field) / field.size
    waves[1:-1] *= 2.0
    turns = 2.0 * np.pi * np.arange(waves.size)[:, None] * np.ravel(shares) / field.size
    return (waves[:, None] * np.exp(1j * turns)).real.sum(axis=0).reshape(np.shape(shares))


@BOTH
def test_first_instability_of_the_linear_programme(problem, strength):
    """Load, mean stress, coefficient, and a critical patch across the seam."""
    load, slip, _ = largest_load(problem, strength)  # good to 4e-7
    found = exact_onset(problem, strength)
    assert found.critical_load.item() == pytest.approx(load, rel=1e-6)
    given = problem.load
    stress = np.mean(given.initial_stress) + load * np.mean(given.profile)
    assert found.critical_stress.item() == pytest.approx(stress, rel=1e-6)
    coefficient = stress / np.mean(given.normal_pressure)
    assert found.friction_coefficient.item() == pytest.approx(coefficient, rel=1e-6)
    slips = np.reshape(slip > 1e-3 * slip.max(), strength.shape)
    for axis in range(slips.ndim):
        along = slips.any(axis=tuple({*range(slips.ndim)} - {axis}))
        assert along[0]
        assert along[-1]
        assert not along.all()


def test_nucleation_stress_is_the_least_weighted_mean_over_a_patch():
    """Brute force: patches at all nodes, then at hundredths of a node about the least."""
    s, measure = angle_rule(60)
    half = 0.5 * LINE.nucleation_length / LINE.interface.spacing
    weights = weight(s) * measure

    def stress(centre):
        points = centre[:, None] + half * s
        excess = interpolated(LINE_STRENGTH - LINE.load.initial_stress, points) @ weights
        return excess / (interpolated(LINE.load.profile, points) @ weights)

    centre = stress(np.arange(96.0)).argmin() + np.linspace(-1.0, 1.0, 201)
    ratio = stress(centre)
    found = local_onset(LINE, LINE_STRENGTH)
    # The error of the weights on 16 nodes is below 1e-5 of smooth fields (tests/exact).
    assert found.critical_load.item() == pytest.approx(ratio.min(), rel=1e-5)
    place = centre[ratio.argmin()] * LINE.interface.spacing
    assert apart(found.critical_position.item(), place, 0.037) < 0.05 * LINE.interface.spacing


def test_critical_ellipses_of_a_plane_by_dense_eigenvectors():
    """The smallest of each shape on whose nodes K has an eigenvalue up to W, by whole matrices."""
    shape, spacings = PLANE.interface.shape, PLANE.interface.spacings
    W = PLANE.friction.uniform_weakening_rate
    matrix = dense(symbol_of(PLANE), shape)
    x, y = (np.fft.fftfreq(n, 1.0 / (n * h)) for n, h in zip(shape, spacings, strict=True))
    least = np.inf
    for stretch in STRETCHES:
        aspect = stretch / np.sqrt(1.0 - PLANE.solid.poisson_ratio)
        square = (x[:, None] ** 2 + (aspect * y) ** 2).ravel()
        for bound in 1.000001 * np.sort(square):
            inside = square <= bound
            values, vectors = np.linalg.eigh(matrix[np.ix_(inside, inside)])
            if values[0] <= W:
                break
        weight = np.zeros(square.size)
        weight[inside] = np.abs(vectors[:, 0]) / np.abs(vectors[:, 0]).sum()
        spectrum = np.conj(np.fft.rfft2(weight.reshape(shape)))
        excess, load = (
            np.fft.irfft2(spectrum * np.fft.rfft2(field), shape)
            for field in (PLANE_STRENGTH - PLANE.load.initial_stress, PLANE.load.profile)
        )
        if (excess / load).min() < least:
            least = (excess / load).min()
            node = np.unravel_index((excess / load).argmin(), shape)
            patch = aspect, 2.0 * np.sqrt(bound), inside.sum() * np.prod(spacings)
    found = local_onset(PLANE, PLANE_STRENGTH)
    # Eigenvectors are known to 1e-9 of W.
    assert found.critical_load.item() == pytest.approx(least, rel=1e-7)
    assert found.critical_aspect.item() == pytest.approx(patch[0], rel=1e-12)
    extents = patch[1], patch[1] / patch[0]
    assert found.critical_patch_extent.values[0] == pytest.approx(extents, rel=1e-5)
    assert found.critical_patch_area.item() == pytest.approx(patch[2], rel=1e-12)
    for place, at, h, length in zip(
        found.critical_position.values[0], node, spacings, PLANE.interface.lengths, strict=True
    ):
        assert apart(place, at * h, length) <= 0.5 * h


@pytest.mark.parametrize(("problem", "radius"), [(LINE, 3.2e-3), (PLANE, 4.6e-3)])
def test_what_slides_is_not_what_was_arrested(problem, radius):
    """A weak place across the seam within a barrier: then the onset is that without it."""
    interface = problem.interface
    seam, wall = (
        across_the_seam(interface, r) > np.exp(-1.0) for r in (radius, radius + 1.6e-3)
    )
    other = tuple(int(0.45 * n) for n in interface.shape)
    dip = np.roll(across_the_seam(interface, 5e-3), other, range(len(other)))
    strength = 1.3e6 + 1e5 * uneven(interface, seed=5) - 4.5e5 * dip
    barred = np.where(wall, 3.5e6, strength)
    within = np.where(seam, 5e5 + 1e5 * uneven(interface, seed=6), barred)
    plain, found = (exact_onset(problem, each, events=2) for each in (barred, within))
    assert found.arrested_events.item() == 1
    assert found.critical_stress.item() > 1.2 * found.first_instability.item()
    ends = found.event_position.values[0].T[..., 0], found.critical_position.values[0]
    for place, goal in (
        (found.sliding_position.values[0], plain.critical_position.values[0]),
        *((end, 0.0) for end in ends),
    ):
        off = apart(place, goal, np.array(interface.lengths)) / interface.spacings
        assert np.all(off < (0.6 if np.any(goal) else 3.0))


def tips(load, whole, centre):
    """G of a row of cracks at both tips by the textbook's weights (Tada, Paris and Irwin)."""
    s, measure = angle_rule(4000)
    half, line = 0.5 * whole, LINE.interface
    drop = LINE.load.initial_stress + load * LINE.load.profile - LINE.friction.residual_strength
    drop = np.interp(centre + half * s, line.x, drop, period=line.length)

    def sine(x):
        return np.sin(np.pi * x / line.length)

    scale, x = (
        np.sqrt(2.0 / (line.length * sine(whole))) * half,
        np.array([-half * s, half * s]),
    )
    k = scale * np.sqrt(sine(half + x) / sine(half - x)) @ (drop * measure)
    return k * abs(k) / (2.0 * LINE.effective_modulus)


def test_cracks_across_the_seam_under_an_uneven_load():
    for whole in (0.001, 0.006, 0.02, 0.034):
        found = release_rates(LINE, 4e5, np.array([whole]), 0.0362)[0]
        # The corners of the drop at nodes: quadrature with 512 points is good to 1e-4.
        np.testing.assert_allclose(found, tips(4e5, whole, 0.0362), rtol=1e-4)
    # The weaker tip decides: about 33 mm it starts, and is stopped across the seam.
    lengths = np.linspace(1e-4, 0.0369, 800)
    above = np.array([tips(1.5e5, one, 0.033).min() > 8e-3 for one in lengths])
    first = int(above.argmax())
    last = first + int(above[first:].argmin())
    for arrest, end in ((False, first), (True, last)):
        found = griffith_length(LINE, 1.5e5, 8e-3, centre=0.033, arrest=arrest)
        assert found == pytest.approx(lengths[end] - 23e-6, abs=26e-6)
        assert griffith_length(LINE, 1e3, 8e-3, arrest=arrest) == np.inf
