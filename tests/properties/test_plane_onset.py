"""What must hold for the onset of any plane: symmetries, monotonicity, concavity, certificates."""

from __future__ import annotations

import numpy as np
import pytest
from planes import WAVENUMBERS, plane_sample
from setups import LENGTH, RATE, smooth_noise

import stiction as st
from stiction.criterion.average import least_average
from stiction.criterion.windows import ellipse_window
from stiction.elasticity.operator import make_operator
from stiction.equilibrium.relaxation import BALANCED, SLIDING, least_equilibrium
from stiction.equilibrium.transforms import plane_onset

SHAPE = (40, 32)
ONE = np.ones(SHAPE)
PLANES = {
    name: plane((5.0 * LENGTH, 4.0 * LENGTH), 1e9, 0.33) for name, plane in WAVENUMBERS.items()
}


def strength_of(seed):
    return 0.66e6 + 1e6 * smooth_noise(5.0, np.random.default_rng(seed), SHAPE)


def onset_of(strength, wavenumbers="lattice", gap=1e-9):
    found = plane_onset(PLANES[wavenumbers], strength, ONE, RATE * ONE, gap)
    assert found.closed
    return found


@pytest.mark.parametrize("wavenumbers", ["spectral", "lattice"])
@pytest.mark.parametrize(
    "change",
    [
        lambda s: np.roll(s, (7, -3), (0, 1)),
        lambda s: np.ascontiguousarray(s[::-1]),
        lambda s: np.ascontiguousarray(s[:, ::-1]),
    ],
)
def test_translations_and_reflections_change_nothing(change, wavenumbers):
    strength = strength_of(0)
    first, second = onset_of(strength, wavenumbers), onset_of(change(strength), wavenumbers)
    assert second.upper == pytest.approx(first.upper, rel=1e-9)  # the gap asked for
    assert np.abs(change(first.slip) - second.slip).max() < 1e-3 * first.slip.max()


def test_bounds_hold_for_the_certificates_returned():
    strength = strength_of(1)
    for name, plane in PLANES.items():
        found = onset_of(strength, name)
        symbol = plane.symbol(SHAPE)

        def product(field, symbol=symbol):
            return np.fft.irfft2(symbol * np.fft.rfft2(field), SHAPE) - RATE * field

        assert (found.slip >= 0.0).all()
        assert (found.multiplier >= 0.0).all()
        round_off = 1e-12 * strength.max()
        assert (product(found.slip) + strength - found.lower).min() > -round_off
        assert product(found.multiplier).max() < 1e-12 * RATE * found.multiplier.max()
        assert found.multiplier.sum() == pytest.approx(1.0, abs=1e-12)
        assert (found.multiplier * strength).sum() == pytest.approx(found.upper, rel=1e-12)


def test_monotone_and_concave_in_the_strength():
    first, second = strength_of(2), strength_of(3)
    one, other = onset_of(first).upper, onset_of(second).upper
    middle = onset_of(0.5 * (first + second)).lower
    assert middle >= 0.5 * (one + other) * (1.0 - 1e-9)
    stronger = first.copy()
    stronger[10:20, 5:15] *= 1.05
    assert onset_of(stronger).upper >= one * (1.0 - 1e-9)
    shifted = onset_of(first + 1e5)
    assert shifted.upper == pytest.approx(one + 1e5, rel=2e-9)


def test_multiplier_is_the_derivative_by_the_strength():
    strength = strength_of(4)
    found = onset_of(strength, gap=1e-10)
    direction = np.random.default_rng(0).standard_normal(SHAPE)
    direction *= 1e-4 * strength.mean() / np.abs(direction).max()
    up, down = (onset_of(strength + d, gap=1e-10) for d in (direction, -direction))
    slope = (found.multiplier * direction).sum()
    # second order: the step changes the slope itself
    assert 0.5 * (up.upper - down.upper) == pytest.approx(slope, rel=0.02)


def test_local_criterion_is_an_upper_bound_for_every_aspect():
    plane = PLANES["lattice"]
    symbol = plane.symbol(SHAPE)
    aspects = (1.0, 1.25, 1.5)
    windows = [ellipse_window(symbol, SHAPE, plane.lengths, RATE, a) for a in aspects]
    interface = st.Interface(plane.lengths, SHAPE)
    for seed in range(4):
        strength = strength_of(seed)
        local = least_average(interface, windows, strength[None], ONE).load[0]
        exact = onset_of(strength, gap=1e-6)
        assert local >= exact.lower
        assert local < 1.2 * exact.upper
        uneven = 1.0 + 0.2 * strength_of(seed + 10) / 1e6
        load = least_average(interface, windows, strength[None], uneven).load[0]
        found = plane_onset(plane, strength, uneven, RATE * ONE, 1e-6)
        assert load >= found.lower


def test_path_is_the_slip_at_onset_just_below_it():
    strength = strength_of(5)
    sample = plane_sample(strength, 0.0, RATE)
    operator = make_operator(PLANES["lattice"].symbol(SHAPE), RATE, SHAPE)
    found = onset_of(strength)
    slips, status = [np.zeros(strength.size)], []
    for load in found.lower * np.array([0.9, 0.95, 1.0 - 1e-6, 1.01]):
        there = least_equilibrium(operator, sample, load, slips[-1])
        slips.append(there.slip)
        status.append(there.status)
    assert status == [BALANCED, BALANCED, BALANCED, SLIDING]
    assert (np.diff(slips[:4], axis=0) >= -1e-12 * slips[3].max()).all()
    # slip comes up to that at onset with the square root of the load, 1e-3 of it
    assert np.abs(slips[3].reshape(SHAPE) - found.slip).max() < 0.01 * found.slip.max()


def test_tiny_and_negative_loads_close_as_well():
    strength = strength_of(6)
    exact = onset_of(strength).upper
    for shift in (exact, 1.2 * exact):
        found = onset_of(strength - shift, gap=1e-7)
        assert found.upper == pytest.approx(exact - shift, abs=1e-6 * exact)
