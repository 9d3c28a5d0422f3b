"""Equilibrium: closed forms, and the conditions of optimality checked with independent products."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from setups import beta_strength, make_problem

import stiction as st
from stiction.elasticity.line import apply_stiffness, make_stiffness, stiffness_column
from stiction.equilibrium.cholesky import (
    append,
    back_substitute,
    make_workspace,
    raise_diagonal,
    row_start,
    substitute,
)
from stiction.equilibrium.dense import LineProgram
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.patches import count_patches, main_patch
from stiction.equilibrium.runaway import block_factor
from stiction.equilibrium.sample import LINEAR, State, make_sample
from stiction.equilibrium.windows import smallest_window, window_mode


def stiffness_times(problem, field):
    """K d by the definition of K: the symbol (G*/2)|k|."""
    symbol = 0.5 * problem.effective_modulus * problem.interface.wavenumbers
    return np.fft.irfft(symbol * np.fft.rfft(field), problem.interface.nodes)


def test_closed_form_of_the_stiffness(problem):
    column = stiffness_column(256, 0.1, problem.effective_modulus)
    unit = np.zeros(256)
    unit[0] = 1.0
    # Both have a few units of round-off in sums of 256 terms.
    np.testing.assert_allclose(column, stiffness_times(problem, unit), atol=1e-14 * column[0])


def test_sparse_product_with_the_stiffness(problem):
    rng = np.random.default_rng(1)
    members = rng.choice(256, 77, replace=False)
    values = rng.standard_normal(77)
    field = np.zeros(256)
    field[members] = values
    column = stiffness_column(256, 0.1, problem.effective_modulus)
    result = np.empty(256)
    apply_stiffness(make_stiffness(column), members, 77, values, np.empty((2, 128)), result)
    np.testing.assert_allclose(result, stiffness_times(problem, field), atol=1e-13 * column[0])


def growing_factor(nodes, column, diagonal, groups):
    """The factor of A on these nodes, appended group by group, and how many are in it."""
    workspace = make_workspace(make_stiffness(column))
    workspace.diagonal[:] = diagonal
    size = 0
    for group in groups:
        workspace.order[:group] = nodes[size : size + group]
        size = append(workspace, size, group)
    return workspace.factor, size


def as_matrix(factor, size):
    rows = [factor[row_start(r) : row_start(r) + r + 1] for r in range(size)]
    return np.array([np.pad(row, (0, size - row.size)) for row in rows])


@pytest.mark.parametrize("groups", [[41], [1] * 41, [5, 17, 2, 17]])
def test_growing_factor_is_the_cholesky_factor(groups):
    column = stiffness_column(256, 0.1, 1e9)
    nodes = np.random.default_rng(2).permutation(256)[: sum(groups)]
    matrix = column[np.abs(nodes[:, None] - nodes)]
    factor, size = growing_factor(nodes, column, column[0], groups)
    reference = np.linalg.cholesky(matrix)
    np.testing.assert_allclose(as_matrix(factor, size), reference, atol=1e-12 * reference.max())
    solution = np.ones(size)
    substitute(factor, 0, size, solution)
    back_substitute(factor, size, solution)
    # The condition number is below 100, so that 1e-12 is generous.
    np.testing.assert_allclose(matrix @ solution, 1.0, atol=1e-12)


def test_factor_of_a_run_of_nodes():
    column = stiffness_column(256, 0.1, 1e9)
    ours = as_matrix(block_factor(column, 60), 60)
    reference = np.linalg.cholesky(scipy.linalg.toeplitz(column[:60]))
    np.testing.assert_allclose(ours, reference, atol=1e-13 * reference.max())


@pytest.mark.parametrize("position", [0, 17, 40])
def test_factor_of_a_matrix_with_a_raised_diagonal_entry(position):
    column = stiffness_column(256, 0.1, 1e9)
    nodes = np.random.default_rng(3).permutation(256)[:41]
    factor, _ = growing_factor(nodes, column, column[0], [41])
    raise_diagonal(factor, 41, position, 0.3 * column[0], np.empty((2, 41)))
    matrix = column[np.abs(nodes[:, None] - nodes)]
    matrix[position, position] += 0.3 * column[0]
    reference = np.linalg.cholesky(matrix)
    # Rotations are as stable as the factorisation itself.
    np.testing.assert_allclose(as_matrix(factor, 41), reference, atol=1e-12 * reference.max())


def test_factor_stops_at_the_node_that_makes_the_matrix_singular():
    nodes = 256
    rate = 12.0  # in units of (G*/2)(2 pi/L)
    width = smallest_window(nodes, rate)
    assert window_mode(nodes, width)[0] <= rate < window_mode(nodes, width - 1)[0]
    column = stiffness_column(nodes, np.pi, 1.0)
    _, size = growing_factor(np.arange(nodes), column, column[0] - rate, [nodes])
    assert size == width - 1


def test_uniform_strength_holds_until_every_node_is_at_it(problem):
    onset = st.onset(problem, np.full(256, 0.9e6), method=Equilibrium(sensitivity=True))
    assert onset.critical_load.item() == pytest.approx(0.9e6, rel=1e-14)
    assert onset.slip_patches.item() == 0
    assert onset.arrested_events.item() == 0
    assert not onset.residual_reached.item()


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 2.0])
def test_conditions_of_optimality(problem, make_strength, ratio):
    tau_p = make_strength(ratio).sample(problem.interface, samples=20, seed=3)
    onset = st.onset(problem, tau_p, method=Equilibrium(sensitivity=True, slip=True))
    rate = problem.friction.weakening_rate
    for sample in range(20):
        one = onset.isel(sample=sample)
        load, slip, y = one.first_instability.item(), one.slip.values, one.sensitivity.values
        balance = tau_p[sample] - load + stiffness_times(problem, slip) - rate * slip
        assert slip.min() >= 0.0
        assert y.min() >= 0.0
        # 1e-11 of the strength: round-off of K d, K d being ten times the strength.
        assert balance.min() > -1e-11 * load
        assert np.abs(balance[slip > 0.0]).max() < 1e-11 * load
        assert (stiffness_times(problem, y) - rate * y).max() < 1e-11 * rate * y.max()
        assert y.sum() == pytest.approx(1.0, rel=1e-13)
        assert y @ tau_p[sample] == pytest.approx(load, rel=1e-11)
        assert one.certificate_gap.item() < 1e-9 * load


def test_first_bound_is_a_bound(problem, make_strength):
    """A y <= 0 for the window chosen, where the weakening rate varies."""
    program = LineProgram(problem)
    tau_p = make_strength(0.5).sample(problem.interface, samples=50, seed=6)
    x = 2.0 * np.pi * np.arange(256) / 256
    for sample, excess in enumerate(tau_p):
        rate = 0.4e12 * (1.0 + 0.6 * np.sin((sample % 9 + 1) * x))
        sample_ = make_sample(excess, np.zeros(256), np.ones(256), rate, LINEAR)
        _, y = program.bound(sample_)
        # The eigenvalue of the window may equal the rate: round-off of its eigenvector.
        assert (stiffness_times(problem, y) - rate * y).max() < 1e-12 * rate.max() * y.max()
        assert np.count_nonzero(y) < 128


def test_certificate_is_the_distance_of_both_bounds(problem, make_strength):
    """From slip and multiplier that are allowed but not optimal."""
    program = LineProgram(problem)
    excess = make_strength(0.5).sample(problem.interface, samples=1, seed=4)[0]
    sample = program.sample_of(problem.sample(excess), 0)
    load, multiplier = program.bound(sample)
    # Without slip nothing below the weakest node is overstressed; above is the local bound.
    gap = program.gap(sample, State(0.0, *np.zeros((3, 256))), multiplier)
    assert gap == pytest.approx(load - excess.min(), rel=1e-9)


def test_gradient_is_the_sensitivity(problem, make_strength):
    tau_p = make_strength(0.25).sample(problem.interface, samples=3, seed=5)
    method = Equilibrium(sensitivity=True)
    rng = np.random.default_rng(0)
    for profile in tau_p:
        y = st.onset(problem, profile, method=method).sensitivity.values[0]
        change = rng.standard_normal(256) * (y > 0.0)
        step = 1.0  # Pa: small enough not to change which nodes slip, large against round-off
        both = np.array([profile + step * change, profile - step * change])
        plus, minus = st.onset(problem, both, method=method).first_instability.values
        # The onset is piecewise linear in the strength: round-off 1e-10 Pa over a step of 1 Pa.
        assert (plus - minus) / (2.0 * step) == pytest.approx(y @ change, abs=1e-6)


def test_patches_on_the_circle():
    slip = np.array([1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0])
    assert count_patches(slip) == 2
    assert count_patches(np.zeros(8)) == 0
    assert count_patches(np.ones(8)) == 1
    y = np.array([3.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0])
    first, length, centre = main_patch(y)
    assert (first, length) == (7, 3)
    assert centre == pytest.approx(0.0)


@pytest.fixture
def wide():
    """Ten profiles of so wide a range that nodes are at the residual before the instability."""
    slow, strength = make_problem(weakening_rate=0.2e12), beta_strength(3e-3, 0.1e6, 3.1e6)
    return slow, strength.sample(slow.interface, samples=10, seed=4)


@pytest.mark.slow
def test_initial_stress_adds_to_the_stress_of_an_event_and_not_to_its_load(wide):
    """A uniform initial stress is a load that is there already."""
    problem, tau_p = wide
    count = 0
    for strength in tau_p:
        plain = st.equilibrium_path(problem, strength, [0.0])
        shifted = st.equilibrium_path(
            problem, {"strength": strength, "initial_stress": 5e4}, [0.0]
        )
        count += plain.sizes["event"]
        np.testing.assert_allclose(shifted["event_stress"], plain["event_stress"], rtol=1e-9)
        np.testing.assert_allclose(shifted["event_load"], plain["event_load"] - 5e4, rtol=1e-9)
        np.testing.assert_allclose(shifted["event_moment"], plain["event_moment"], rtol=1e-6)
    assert count > 5


def test_sensitivity_where_nodes_are_at_the_residual(wide):
    """Against finite differences: a node at its residual strength does not feel its peak."""
    problem, tau_p = wide
    found = st.onset(problem, tau_p, method=st.Equilibrium(sensitivity=True))
    followed = np.nonzero(found.residual_reached.values)[0]
    checked = 0
    for sample in followed[:4]:
        gradient = found.sensitivity.values[sample]
        # The first instability only: where it comes before an event, a shift keeps the order.
        for node in (int(gradient.argmax()), int(tau_p[sample].argmin())):
            step = np.eye(256)[
                node
            ]  # 1 Pa: small against kinks, large against round-off of 1e5 Pa
            moved = np.array([tau_p[sample] - step, tau_p[sample] + step])
            onset = st.onset(problem, moved, method=st.Equilibrium())
            slope = np.diff(onset.first_instability).item() / 2.0
            assert slope == pytest.approx(gradient[node], abs=1e-5)
            checked += 1
    assert checked >= 4


@pytest.fixture
def humped():
    """A line whose law falls more steeply beyond half of its slip, and smooth strengths."""
    friction = st.PiecewiseWeakening(
        slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=8.6e10
    )
    problem = make_problem(96, friction=friction)
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.25), st.PowerLawSpectrum(0.015))
    return problem, field.sample(problem.interface, samples=8, seed=0)


def test_sensitivity_where_a_node_that_weakens_more_steeply_is_the_instability(humped):
    """Against finite differences, at the most sensitive node and along a random direction."""
    problem, tau_p = humped
    rng = np.random.default_rng(1)
    found = st.onset(problem, tau_p, method=st.Equilibrium(sensitivity=True))
    assert np.isnan(found.certificate_gap).sum() >= 3
    for strength, gradient in zip(tau_p, found.sensitivity.values, strict=True):
        unit = np.zeros(96)
        unit[np.argmax(gradient)] = 1.0
        for change in (unit, rng.standard_normal(96)):
            both = {
                "strength": np.array([strength + change, strength - change]),
                "weakening_rate": problem.friction.weakening_rate,
            }
            above, below = st.onset(problem, both, method=st.Equilibrium()).first_instability
            assert float(above - below) / 2.0 == pytest.approx(gradient @ change, rel=1e-5)


def test_no_sensitivity_where_nodes_weaken_more_steeply_at_once(humped):
    """Two dips alike: raising one of them leaves the other, lowering it does not."""
    problem, tau_p = humped
    half = tau_p[0][::2]
    alike = np.concatenate((half, half))
    with pytest.warns(st.AccuracyWarning, match="1 of 1 samples.*sensitivity is NaN"):
        found = st.onset(problem, alike, method=st.Equilibrium(sensitivity=True))
    assert np.isnan(found.sensitivity).all()
