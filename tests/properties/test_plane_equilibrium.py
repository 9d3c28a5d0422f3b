"""What must hold for equilibrium on any plane: symmetries, gradients, bounds, certificates."""

import numpy as np
import pytest
from planes import WAVENUMBERS, moduli
from setups import LENGTH, RATE, exact_onset, make_problem, smooth_noise

import stiction as st
from stiction.methods.criterion.average import _between_nodes
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.plane import plane_onset

NODES, SHAPE = (48, 40), (40, 32)
LENGTHS = (6.0 * LENGTH, 4.0 * LENGTH)
PLANE = make_problem(NODES, LENGTHS)
ONE = np.ones(SHAPE)
PLANES = {
    name: plane((5.0 * LENGTH, 4.0 * LENGTH), moduli(1e9, 0.33))
    for name, plane in WAVENUMBERS.items()
}


def smooth(seed, correlation=4.0, shape=NODES):
    return smooth_noise(correlation, np.random.default_rng(seed), shape)


def strength_of(seed, correlation=4.0, shape=NODES):
    return 0.66e6 + 1e6 * smooth(seed, correlation, shape)


def rough_strength(seed):
    return strength_of(seed, 5.0, SHAPE)


def solve(strength, problem=PLANE, gap=1e-9):
    return exact_onset(problem, strength, tolerance=gap, slip=True)


def first_of(strength, **options):
    return solve(strength, **options)["first_instability"].values


def bounds_of(strength, wavenumbers="lattice", gap=1e-9):
    found = plane_onset(PLANES[wavenumbers], strength, ONE, RATE * ONE, gap)
    assert found.closed
    return found


def test_a_coarse_grid_only_says_where_the_path_is_begun(monkeypatch):
    load = st.Load(profile=1.0 + 0.3 * smooth(6), initial_stress=1e5 * smooth(7))
    law = {"weakening_rate": RATE * (0.9 + 0.1 * smooth(5)), "residual_strength": 6.2e5}
    problem, strength = make_problem(NODES, LENGTHS, load=load, **law), strength_of(3)
    quick = exact_onset(problem, strength)
    monkeypatch.setattr(program, "MIN_COARSE_NODES", 100)
    slow = exact_onset(problem, strength)
    assert quick["arrested_events"].item() == slow["arrested_events"].item()
    for name in ("first_instability", "critical_load"):
        # Both within the gap of 1e-6.
        assert quick[name].item() == pytest.approx(slow[name].item(), rel=2e-6)


def test_the_place_of_the_least_average_lies_between_nodes():
    """Of a paraboloid it is that of the vertex, also across the borders."""
    for x, y in ((11.7, 0.4), (0.2, 8.6), (3.4, 5.0)):
        along, across = (
            (np.arange(n) - at + 0.5 * n) % n - 0.5 * n for n, at in ((12, x), (9, y))
        )
        average = 2.0 + 0.3 * along[:, None] ** 2 + 0.7 * across**2
        np.testing.assert_allclose(_between_nodes(average), (x, y), rtol=1e-12)


def test_tiny_and_negative_loads_close_as_well():
    strength = rough_strength(6)
    exact = bounds_of(strength).upper
    for shift in (exact, 1.2 * exact):
        found = bounds_of(strength - shift, gap=1e-7)
        assert found.upper == pytest.approx(exact - shift, abs=1e-6 * exact)


def test_barriers_that_never_slip_do_not_count():
    """However strong they are: the accuracy is a share of the load, not of their strength."""
    law = st.LinearWeakening(weakening_rate=RATE, residual_ratio=0.5)
    problem = make_problem(SHAPE, (5.0 * LENGTH, 4.0 * LENGTH), friction=law)
    strength, first = rough_strength(6), []
    for barrier in (1e8, 1e13):
        strength[:, 20:] = barrier
        first.append(exact_onset(problem, strength, events=2)["first_instability"].item())
    assert first[1] == pytest.approx(first[0], rel=2e-6)
