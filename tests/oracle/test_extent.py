"""Interfaces that end, beside own dense linear algebra, and beside interfaces that do not."""

import numpy as np
import pytest
from checks import assert_same
from oracles import dense, symbol_of
from recording import stored
from setups import LOCAL, QUARTER, beta_strength, exact_onset, make_problem, within
from specimens import crooked, rough

import stiction as st

X = st.Interface(0.05, 96).x
LINE = make_problem(
    96, 0.05, weakening_rate=2.2e11, residual_strength=2e5,
    load=st.Load(profile=1.0 + 0.2 * np.cos(40.0 * np.pi * X), normal_pressure=2e6 + 1e7 * X),
)  # fmt: skip
PAD = crooked(nodes=64, drive=st.Pusher(height=0.008, width=0.004, stiffness=3e7))
FIELD = beta_strength(8e-3)


def least_slip(stiffness, sample, load, inside):
    """The least equilibrium, from below: K d is solved for with the strengths of the moment."""
    K = stiffness[np.ix_(inside, inside)]
    peak, residual, weakening_rate, initial = (rows[0][inside] for rows in sample[:4])
    drive, slip = load * sample.load_profile[inside] + initial, np.zeros(len(K))
    for _ in range(20_000):
        strength = np.maximum(peak - weakening_rate * slip, residual)
        moves, before = (slip > 0.0) | (drive - K @ slip > strength), slip.copy()
        if moves.any():
            grown = np.linalg.solve(K[np.ix_(moves, moves)], (drive - strength)[moves])
            slip[moves] = np.maximum(slip[moves], grown)
        if np.abs(slip - before).max() <= 1e-13 * slip.max():
            break
    return slip


EXTENTS = stored("cases")["extents"]
"""Problem within an extent, and seed of its strength."""


@pytest.mark.parametrize("name", EXTENTS)
def test_the_part_that_can_break_follows_its_rows_and_columns_of_the_stiffness(name):
    """Before and after the last instability, after which all of it slips, arrested ones or not."""
    problem, seed = eval(EXTENTS[name])
    strength = FIELD.sample(problem.interface, seed=seed)[0]
    if problem.specimen is not None:
        stiffness, strength = problem.blocks.stiffness, rough(problem, seed)
    else:
        stiffness = dense(symbol_of(problem), (96,))
    inside, sample = problem.interface.breakable, problem.sample(strength)
    found = exact_onset(problem, strength, sensitivity=True)
    loads = np.array([0.7, 0.95, 0.9999, 1.0001, 1.3]) * found.critical_load.item()
    path = st.equilibrium_path(problem, strength, loads)
    slips = [least_slip(stiffness, sample, load, inside) for load in loads]
    assert np.all(path.slip.values[:, ~inside] == 0.0)
    assert path.slip.values[:, inside] == pytest.approx(
        np.array(slips), abs=1e-9 * np.max(slips)
    )
    assert [bool((slip > 0.0).all()) for slip in slips] == [False, False, False, True, True]
    assert list(path.sliding) == [False, False, False, True, True]
    mean = path.stress.values[:, inside].mean(axis=1)
    assert path.mean_stress.values == pytest.approx(mean, rel=1e-12)
    node, step = np.flatnonzero(inside)[20], 20.0
    raised = exact_onset(problem, strength + step * (np.arange(inside.size) == node))
    quotient = (raised.first_instability - found.first_instability).item() / step
    assert found.sensitivity.values[0, node] == pytest.approx(quotient, abs=1e-6)
    if "friction_coefficient" in found:
        pressure = sample.normal_pressure[0, inside].mean()
        assert found.friction_coefficient * pressure == pytest.approx(found.critical_stress)


@pytest.mark.parametrize("method", [LOCAL, st.Equilibrium(), st.Rupture(loading_rate=3e8)])
def test_an_extent_of_everything_is_none(method):
    assert LINE.interface.breakable.sum() == 96
    strength = FIELD.sample(LINE.interface, seed=5)
    whole, given = (
        st.onset(problem, strength, method=method, progress=False)
        for problem in (LINE, within(LINE, np.ones(96, dtype=bool)))
    )
    assert_same(whole, given)


def test_the_event_that_breaks_a_fault_is_not_arrested_and_slip_that_restarts_is_no_event():
    """Locked nodes slip again as the load rises, and the last nodes beside the ends creep."""
    law = st.LinearWeakening(critical_slip=8e-6, residual_strength=3e5)
    fault = make_problem(solid=QUARTER, friction=law, mode="III")
    fault = within(fault, (0.025, 0.075))
    strength = beta_strength(7.5e-3, 3.2e5, 1.5e6, mean_mode=True)
    strength = strength.sample(fault.interface, samples=8, seed=1)
    exact = exact_onset(fault, strength)
    # The load rises by 2e-5 and 2e-3 of the stress scale while waves cross the fault.
    for loading_rate, close in ((1e6, 3e-5), (1e8, 3e-3)):
        found = st.onset(
            fault, strength, method=st.Rupture(loading_rate=loading_rate), progress=False
        )
        np.testing.assert_array_equal(found.arrested_events, 0)  # inertia carries one through
        np.testing.assert_allclose(found.critical_load, exact.critical_load, rtol=close)


PLANE = make_problem((32, 28), (0.02, 0.0175), weakening_rate=4e11, residual_strength=2e5)


def test_a_plane_with_a_hole_follows_its_rows_and_columns_of_the_stiffness():
    x, y = np.meshgrid(*PLANE.interface.coordinates.values(), indexing="ij")
    hole = (np.abs(x - 0.006) < 0.001) & (np.abs(y - 0.006) < 0.001)
    inside = (np.abs(x - 0.01) < 0.0085) & (np.abs(y - 0.0085) < 0.0075) & ~hole
    problem = within(PLANE, inside)
    strength = beta_strength(4e-3).sample(PLANE.interface, seed=2)[0]
    stiffness = dense(symbol_of(problem), inside.shape)
    sample = [rows.reshape(1, -1) for rows in problem.sample(strength)[:4]]
    flat = problem.sample(strength)._replace(load_profile=np.ones(inside.size))
    flat = flat._replace(**dict(zip(flat._fields[:4], sample, strict=True)))
    loads = np.array([0.97, 1.0001]) * exact_onset(problem, strength).critical_load.item()
    path = st.equilibrium_path(problem, strength, loads)
    for load, slip, slides in zip(loads, path.slip.values, (False, True), strict=True):
        expected = least_slip(stiffness, flat, load, inside.ravel())
        assert slip[inside] == pytest.approx(expected, abs=3e-6 * expected.max())
        assert bool((expected > 0.0).all()) == slides
    assert np.all(path.slip.values[:, ~inside] == 0.0)


RATES = np.where(np.arange(64) == 10, 3.6e11, 2e11)
"""A weakening rate whose steepest node has a nucleation length within 5.6 mm, the others not."""


SMALL = stored("cases")["small extents"]


@pytest.mark.parametrize("name", SMALL)
def test_a_small_extent_slides_stably(name):
    problem = eval(SMALL[name])
    strength = beta_strength(4e-3).sample(problem.interface, seed=2)[0]
    with pytest.warns(st.AccuracyWarning, match="slides stably"):
        found = exact_onset(problem, strength)
    for name in ("critical_load", "critical_stress", "first_instability", "critical_position"):
        assert np.isnan(found[name]).all(), name
