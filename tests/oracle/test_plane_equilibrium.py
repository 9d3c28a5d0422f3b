"""Equilibrium of planes against HiGHS on dense programmes and dumb relaxation, and its bounds."""

import numpy as np
import pytest
from crooked import crooked
from oracles import by_linear_programme, dense, relaxed, symbol_of
from planes import WAVENUMBERS, Lattice, moduli
from scipy.linalg import eigh
from setups import (
    LENGTH,
    RATE,
    ROUND_OFF,
    beta_strength,
    exact_onset,
    examples,
    make_problem,
    repeated,
    smooth_noise,
    turns,
)

import stiction as st
from stiction.elasticity.operator import lowest_eigenvector, make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.criterion.average import _between_nodes
from stiction.methods.equilibrium.solver import sample_of
from stiction.methods.equilibrium.strength import present_pieces
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.bracket import Bracket, bisect
from stiction.methods.equilibrium.transforms.plane import PlaneSearch, plane_onset
from stiction.methods.equilibrium.transforms.relaxation import stable_equilibrium
from stiction.methods.equilibrium.transforms.turning_point import close_by_newton

NODES = (24, 24)


def noise(correlation, seed, shape=NODES):
    return smooth_noise(correlation, np.random.default_rng(seed), shape)


@pytest.mark.parametrize(
    ("seed", "wavenumbers"), [(0, "spectral"), (0, "lattice"), (1, "lattice")]
)
def test_bounds_and_multiplier_equal_the_linear_programme(seed, wavenumbers):
    rng, shape = np.random.default_rng(seed), (26, 24)
    plane = WAVENUMBERS[wavenumbers]((3.0 * LENGTH, 3.0 * LENGTH), moduli(1e9, 0.33))
    strength = 0.66e6 + 1e6 * smooth_noise(rng.choice([2.0, 4.0, 8.0]), rng, shape)
    if seed == 0:  # rough
        strength *= rng.uniform(0.9, 1.1, shape)
    profile = 1.0 + 0.4 * smooth_noise(6.0, rng, shape)
    weakening_rate = RATE * (0.8 + 0.4 * smooth_noise(6.0, rng, shape))
    given = (field.ravel() for field in (weakening_rate, strength, profile))
    exact, _, multiplier = by_linear_programme(dense(plane.symbol(shape), shape), *given)
    found = plane_onset(plane, strength, profile, weakening_rate, gap=1e-9)
    assert found.closed(1e-9)
    assert found.lower <= exact * (1.0 + 1e-12)  # round-off of either programme
    assert found.upper >= exact * (1.0 - 1e-12)
    assert found.lower == pytest.approx(exact, rel=1e-9)
    error = np.abs(found.multiplier - multiplier).max()
    assert error < 1e-6 * multiplier.max()
    # On one grid, bisection and Newton's method get there by themselves.
    bracket = Bracket(plane.symbol(shape), weakening_rate, strength, profile)
    direction = bisect(bracket, 5e-3, 5e-6)
    assert exact * (1.0 - 6e-3) < bracket.lower < exact * (1.0 + 1e-12)
    given = direction, bracket.lower, bracket.slip, 1e-8
    assert close_by_newton(bracket, *given)[0] or wavenumbers == "spectral"


def test_any_multiplier_bounds_the_onset_where_some_nodes_do_not_weaken():
    """What is lifted to A y <= 0 bounds the linear programme from above; A z < 0 throughout."""
    rng, shape = np.random.default_rng(8), (14, 12)
    symbol = Lattice((3.0 * LENGTH, 2.3 * LENGTH), moduli(1e9, 0.33)).symbol(shape)
    weakening_rate = np.maximum(RATE * (noise(3.0, rng, shape) - 0.3), 0.0)
    strength, profile = 0.7e6 + 1e6 * noise(2.0, rng, shape), 1.3 + 0.4 * noise(3.0, rng, shape)
    assert 20 < np.sum(weakening_rate == 0.0) < 120
    matrix = dense(symbol, shape) - np.diag(weakening_rate.ravel())
    given = (field.ravel() for field in (weakening_rate, strength, profile))
    exact, _, multiplier = by_linear_programme(dense(symbol, shape), *given)
    bracket = Bracket(symbol, weakening_rate, strength, profile)
    lifting, lifted = bracket.lifting
    assert lifting.min() > 0.0
    assert lifted.min() > 1e-3 * RATE
    np.testing.assert_allclose(lifted, -matrix @ lifting, atol=ROUND_OFF * RATE)
    alone = np.where(np.arange(168) == 70, 1e-3 * RATE, 0.0).reshape(shape)
    assert Bracket(symbol, alone, strength, profile).lifting[1].min() > 0.0
    for rough in (1.0, 1e-2, 1e-5):
        bound = bracket.raise_multiplier(
            multiplier * (1.0 + rough * noise(1.0, rng, shape).ravel())
        )
        assert exact * (1.0 - 1e-12) <= bound
        taken = bracket.multiplier
        assert bracket.upper == pytest.approx(taken @ strength.ravel(), rel=1e-12)
        assert profile.ravel() @ taken == pytest.approx(1.0, rel=1e-12)
        assert (matrix @ taken).max() <= ROUND_OFF * RATE * taken.max()
    assert bracket.upper == pytest.approx(exact, rel=1e-3)


def test_lowest_eigenvector_equals_a_dense_one():
    """From a guess whose square is zero."""
    shape, inside = (20, 16), noise(4.0, 0, (20, 16)) < 0.5
    symbol = HalfSpaces((3.0 * LENGTH, 2.0 * LENGTH), moduli(1e9, 0.33)).symbol(shape)
    matrix, nodes = dense(symbol, shape) - RATE * np.eye(inside.size), np.flatnonzero(inside)
    values, vectors = eigh(matrix[np.ix_(nodes, nodes)], subset_by_index=[0, 0])
    vector = 1e-170 * inside
    given = make_operator(symbol, RATE, shape), inside.reshape(-1), vector.reshape(-1)
    value = lowest_eigenvector(*given, 1e-10 * RATE, 500)
    assert value == pytest.approx(values[0], rel=1e-10, abs=1e-10 * RATE)
    assert np.abs(vector[inside] - np.abs(vectors[:, 0])).max() < 1e-7


@pytest.fixture(scope="module")
def wide():
    """Strength over a wide range, so that ruptures are arrested: a problem and three samples."""
    problem = make_problem((32, 32), (5.0 * LENGTH, 5.0 * LENGTH), residual_strength=3.5e5)
    return problem, np.array([0.4e6 + 4.6e6 * noise(5.0, s, (32, 32)) for s in (20, 23, 0)])


def test_arrest_equals_relaxation_node_by_node(wide):
    problem, strength = wide
    found = exact_onset(problem, strength)
    assert list(found["arrested_events"].values) == [1, 1, 0]
    assert not found["certified"].values.any()
    for number in range(2):
        first = found["first_instability"].values[number]
        last = found["critical_load"].values[number]
        assert first < last
        # Before and after each instability, at some distance: near one, relaxation takes for ever.
        loads = np.array([first * 0.998, first * 1.002, last * 0.998, last * 1.002])
        path = st.equilibrium_path(problem, strength[number], loads)
        assert path["event_load"].item() == pytest.approx(first, rel=1e-5)
        assert list(path["arrested_events"].values) == [0, 1, 1, 1]
        assert list(path["sliding"].values) == [False, False, False, True]
        slip, rest = np.zeros(problem.interface.shape), 1e-8 * strength[number].mean()
        for load, ours in zip(loads[:3], path["slip"].values, strict=False):
            slip = relaxed(problem, strength[number], load, slip, rest)
            # Relaxation stops at 1e-8 of the strength, over the lowest eigenvalue.
            assert np.abs(ours - slip).max() < 1e-4 * 9e-6
        assert relaxed(problem, strength[number], loads[3], slip, rest) is None
        # What slips is at its strength, all else below: 1e-7 of it is the path's own accuracy.
        slip, stress = path["slip"].values[:3], path["stress"].values[:3]
        over = stress - np.maximum(strength[number] - RATE * slip, 3.5e5)
        assert np.abs(over[slip > 0.0]).max() < 1e-6 * strength[number].mean()
        assert over.max() < 1e-6 * strength[number].mean()
        assert path["mean_stress"].values[:3] == pytest.approx(loads[:3], rel=1e-12)


def first_loss_of_stability(problem, strength, load, slip):
    """Follow slip node by node from a state; the load at which K - W is no longer definite."""
    stiff = dense(symbol_of(problem), problem.interface.shape)
    weakening_rate = problem.friction.weakening_rate
    residual = problem.friction.residual_strength
    critical = (strength - residual) / weakening_rate
    fallen, inside = slip >= critical * (1.0 - 1e-9), slip > 0.0
    while True:
        whole = stiff - np.diag(np.where(fallen, 0.0, weakening_rate))
        matrix = whole[np.ix_(inside, inside)]
        if np.linalg.eigvalsh(matrix)[0] < 0.0:
            return load
        carried = np.where(fallen, residual, strength)
        slip, moves = np.zeros(strength.size), np.zeros(strength.size)
        slip[inside] = np.linalg.solve(matrix, (load - carried)[inside])
        moves[inside] = np.linalg.solve(matrix, np.ones(inside.sum()))
        margin, closing = strength - load + stiff @ slip, 1.0 - stiff @ moves
        joins, falls = np.full((2, strength.size), np.inf)
        np.divide(margin, closing, where=~inside & (closing > 0.0), out=joins)
        np.divide(critical - slip, moves, where=inside & ~fallen & (moves > 0.0), out=falls)
        load += max(min(joins.min(), falls.min()), 0.0)
        if joins.min() < falls.min():
            inside[joins.argmin()] = True
        else:
            fallen[falls.argmin()] = True


def test_nodes_that_become_residual_one_by_one_are_events_only_where_stability_is_lost(wide):
    """All of it looks unstable to long steps; the first loss is followed node by node."""
    problem, _ = wide
    strength = 0.4e6 + 4.6e6 * noise(5.0, 5, (32, 32))
    found = exact_onset(problem, strength)
    first = found["first_instability"].item()
    before = st.equilibrium_path(problem, strength, [first * (1.0 - 1e-5)])["slip"].values
    load = first_loss_of_stability(
        problem, strength.ravel(), first * (1.0 - 1e-5), before.ravel()
    )
    assert first == pytest.approx(load, rel=1e-10)
    assert found["arrested_events"].item() == 2
    assert found["critical_load"].item() / first == pytest.approx(1.01224, abs=2e-4)


LAWS = examples("laws of strips")


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_laws_of_several_pieces_on_a_strip_are_those_of_the_line(law):
    """Strength uniform along y; the line follows each corner exactly, with a dense factor."""
    load = {"profile": 1.1 + 0.2 * np.sin(turns(64)), "initial_stress": 3e4 * np.cos(turns(64))}
    line = make_problem(64, 0.02, friction=law, load=st.Load(**load))
    wide = st.Load(**{key: repeated(value, 8) for key, value in load.items()})
    strip = make_problem((64, 8), (0.02, 0.0025), friction=law, load=wide)
    tau_p = beta_strength(3e-3, 0.3e6, 2.66e6).sample(line.interface, samples=4, seed=2)
    exact = exact_onset(line, tau_p)
    assert exact["residual_reached"].any()
    found = exact_onset(strip, repeated(tau_p, 8), tolerance=1e-8)
    # Nothing is found more closely than the gap; measured 7e-9 at most.
    np.testing.assert_allclose(found["critical_load"], exact["critical_load"], rtol=2e-8)
    # A turn at a corner may be passed unseen: its jump is a step of the stable path.
    assert (found["arrested_events"] <= exact["arrested_events"]).all()
    same = found["arrested_events"].values == exact["arrested_events"].values
    assert same.sum() >= 3
    ours, theirs = (onset["first_instability"].values[same] for onset in (found, exact))
    np.testing.assert_allclose(ours, theirs, rtol=2e-8)


def test_a_step_of_the_stable_path_passes_no_steeper_weakening_that_is_unstable():
    """By eigenvalues of the dense matrix: a long step over the steep piece is refused, although
    each end of it is stable; one that only shorter steps show to be stable is taken."""
    law = {"slip": [0.02, 0.05, 1.0], "strength": [0.98, 0.9, 0.0], "weakening_rate": 6e10}
    friction = st.PiecewiseWeakening(**law, residual_strength=1.5e5)
    problem, strength = crooked((24, 20), (0.023, 0.0164), friction=friction)
    search = PlaneSearch(problem)
    sample = sample_of(problem.sample(strength), search.pieces, 0)
    operator = search._operator(sample)
    stiffness, slopes = dense(symbol_of(problem), (24, 20)), sample.pieces.slopes
    first = (sample.excess / sample.profile).min()

    def least(weakening_rate):
        """The lowest eigenvalue of A on the nodes that slip, over K of one node."""
        at = np.flatnonzero(slip > 0.0)
        rates = (weakening_rate * sample.weakening_rate)[at]
        matrix = stiffness[np.ix_(at, at)] - np.diag(rates)
        return eigh(matrix, eigvals_only=True, subset_by_index=[0, 0])[0] / stiffness[0, 0]

    slip, taken, refused, spared = np.zeros(480), 0, 0, 0
    for share in np.arange(1.02, 1.515, 0.01):
        load = share * first
        slip = stable_equilibrium(operator, sample, load, slip, 1e-9, slip)
        present = present_pieces(sample, slip).piece
        steepest = least(np.maximum.accumulate(slopes[:-1])[present])
        rest = np.zeros(480)
        found = stable_equilibrium(operator, sample, load, rest, 1e-9, rest)
        assert (found is not None) == (steepest > 0.0)
        taken, refused = taken + (steepest > 0.0), refused + (steepest <= 0.0)
        spared += steepest > 0.0 > least(np.full(480, slopes.max()))
        if found is not None:
            np.testing.assert_allclose(found, slip, atol=1e-6 * slip.max())
    assert taken > refused > 0
    assert spared > 0


def test_a_coarse_grid_only_says_where_the_path_is_begun(monkeypatch):
    shape, lengths = (48, 40), (6.0 * LENGTH, 4.0 * LENGTH)
    load = st.Load(
        profile=1.0 + 0.3 * noise(4.0, 6, shape), initial_stress=1e5 * noise(4.0, 7, shape)
    )
    rate = RATE * (0.9 + 0.1 * noise(4.0, 5, shape))
    law = {"weakening_rate": rate, "residual_strength": 6.2e5}
    problem = make_problem(shape, lengths, load=load, **law)
    strength = 0.66e6 + 1e6 * noise(4.0, 3, shape)
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


OBLONG = (5.0 * LENGTH, 4.0 * LENGTH)


def rough():
    return 0.66e6 + 1e6 * noise(5.0, 6, (40, 32))


def test_tiny_and_negative_loads_close_as_well():
    plane, strength, ones = Lattice(OBLONG, moduli(1e9, 0.33)), rough(), np.ones((40, 32))
    exact = plane_onset(plane, strength, ones, RATE * ones, 1e-9).upper
    for shift in (exact, 1.2 * exact):
        found = plane_onset(plane, strength - shift, ones, RATE * ones, 1e-7)
        assert found.closed(1e-7)
        assert found.upper == pytest.approx(exact - shift, abs=1e-6 * exact)


def test_barriers_that_never_slip_do_not_count():
    """However strong they are: the accuracy is a share of the load, not of their strength."""
    law = st.LinearWeakening(weakening_rate=RATE, residual_ratio=0.5)
    problem, strength, first = make_problem((40, 32), OBLONG, friction=law), rough(), []
    for barrier in (1e8, 1e13):
        strength[:, 20:] = barrier
        first.append(exact_onset(problem, strength, events=2)["first_instability"].item())
    assert first[1] == pytest.approx(first[0], rel=2e-6)
