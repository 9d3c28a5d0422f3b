"""What must hold for equilibrium on any plane: symmetries, gradients, bounds, certificates."""

import numpy as np
import pytest
from oracles import by_relaxation
from planes import WAVENUMBERS, moduli, plane_sample
from setups import LENGTH, RATE, exact_onset, make_problem, smooth_noise

import stiction as st
from stiction.elasticity.operator import make_operator
from stiction.methods.criterion.average import _between_nodes
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.plane import plane_onset
from stiction.methods.equilibrium.transforms.relaxation import least_equilibrium

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


LAWS = {
    "straight": {},
    "residual": {"residual_strength": 6.2e5},
    "corner": {"slip": [0.25, 1.0], "strength": [0.6, 0.0]},
    "both": {"slip": [0.25, 1.0], "strength": [0.6, 0.0], "residual_strength": 4.5e5},
}


def crooked(name):
    load = st.Load(profile=1.0 + 0.3 * smooth(6), initial_stress=1e5 * smooth(7))
    options = {"weakening_rate": RATE * (0.9 + 0.1 * smooth(5)), **LAWS[name]}
    law = st.PiecewiseWeakening if "slip" in options else st.LinearWeakening
    return make_problem(NODES, LENGTHS, load=load, friction=law(**options))


def test_a_coarse_grid_only_says_where_the_path_is_begun(monkeypatch):
    problem, strength = crooked("residual"), strength_of(3)
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


def walled(seed, shape=SHAPE):
    """A weak patch behind a barrier around it, with other weak patches beyond."""
    rng = np.random.default_rng(seed)
    strength = 0.5e6 + 2.5e6 * smooth(rng, 3.0, shape)
    x, y = np.ogrid[: shape[0], : shape[1]]
    far = np.hypot(x - rng.uniform(12, 28), y - rng.uniform(10, 20))
    wall, thick = rng.uniform(6, 9), rng.uniform(1.5, 4.0)
    strength[far < wall] *= 0.6
    strength[(far >= wall) & (far < wall + thick)] *= rng.uniform(1.0, 2.0)
    return plane_sample(strength, 3e5 * rng.uniform(0.5, 1.0), RATE)


def test_a_patch_that_jumps_stops_at_a_barrier_and_meets_others():
    """As by relaxation node by node, at rising loads until all of it slides."""
    sample, lattice = walled(13), PLANES["lattice"]
    symbol = lattice.symbol(SHAPE)
    operator = make_operator(symbol, RATE, SHAPE)
    fields = (sample.excess, sample.residual, sample.critical)
    strength, residual, critical = (field.reshape(SHAPE) for field in fields)

    def present(slip):
        return np.maximum(strength - RATE * slip, residual)

    slip, jumps = np.zeros(sample.excess.size), 0
    for load in sample.excess.min() * np.linspace(1.1, 3.0, 12):
        found = least_equilibrium(operator, sample, load, slip)
        exact = by_relaxation(symbol, load * ONE, present, critical)
        assert (found.status == Outcome.ARRESTED) == (exact is not None)
        if exact is None:
            break
        jumps += np.sum((slip == 0.0) & (found.slip >= sample.critical)) > 20
        slip = found.slip
        # Residuals of 1e-7 of the strength, over the lowest eigenvalue.
        assert np.abs(slip - exact.ravel()).max() < 1e-5 * critical.max()
    assert exact is None
    assert jumps > 0


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
