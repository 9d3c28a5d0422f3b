"""Laws of loads and specimens, each of which is given to an onset by equilibrium or a rupture."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest
from contracts.bodies import COEFFICIENTS, SOLID, World, _rewritten
from contracts.test_results import alike_but_for_places, assert_alike
from recording import evaluated
from setups import examples

import stiction as st
from stiction.methods.dynamics.summary import front_speeds
from stiction.random.dotted_keys import with_values

pytestmark = pytest.mark.filterwarnings("ignore")
NODES, HEIGHT, INF = 56, 0.021, float("inf")
X = (np.arange(NODES) + 0.5) / NODES
PRESSED = st.Load(normal_pressure=2.1e6)
BASE = st.Base(height=0.03, behind=0.02, ahead=0.05)
SOFTER = st.Solid(shear_modulus=0.7e9, poisson_ratio=0.35, density=1200.0)


def body(specimen: Any = None, load: st.Load = PRESSED) -> st.Problem:
    """A body of 73 mm, whose strength falls to three tenths over 9 micrometres."""
    width = None if specimen else 0.0113
    friction = st.LinearWeakening(critical_slip=9e-6, residual_ratio=0.3)
    interface = st.Interface(0.073, NODES, width=width)
    return st.Problem(SOLID, interface, friction, load, specimen=specimen)


def blocks(drive: Any, **more: Any) -> st.Blocks:
    return st.Blocks(height=HEIGHT, thickness=0.0071, drive=drive, **more)


def pusher(place: float, width: float, **more: Any) -> st.Pusher:
    """A pusher whose middle and width are given as shares of the height."""
    return st.Pusher(height=place * HEIGHT, width=width * HEIGHT, **more)


def slider(drive: Any = None, base: st.Base = BASE, **more: Any) -> st.Problem:
    drive = drive or st.Pusher(height=0.006, width=0.004, stiffness=6e7)
    of_slider = {"height": 0.041, "thickness": 0.0071, "base": base, "drive": drive} | more
    return body(st.Slider(**of_slider), st.Load(pressing_force=1.1e3))


BODIES = evaluated("loads and specimens", globals())
"""A number of each field of Load, Blocks, Slider, Base and of each drive."""
SHAKEN = ("uneven pressure on blocks", "machine", "glued", "pusher down to the interface",
          "pusher of a whole side", "two pushers")  # fmt: skip
CASES = [(name, "equilibrium") for name in BODIES] + [(name, "rupture") for name in SHAKEN]
every = pytest.mark.parametrize(("name", "kind"), CASES)


@cache
def world(name: str, kind: str) -> World:
    """Two samples of friction coefficients on a body."""
    problem = BODIES[name]
    method = st.Equilibrium() if kind == "equilibrium" else st.Rupture()
    study = st.Study(problem=problem, random=COEFFICIENTS, method=method, samples=2)
    return World(study.to_dict(), COEFFICIENTS.sample(problem.interface, samples=2, seed=2))


def onset(w: World) -> Any:
    result = st.onset(w.problem, w.profiles(), method=w.method, progress=False)
    return result.drop_vars(JUMPING, errors="ignore")


JUMPING = ["certificate_gap"]
"""Round-off."""


@cache
def plain(name: str, kind: str) -> Any:
    return onset(world(name, kind))


def test_every_field_of_a_load_and_of_a_specimen_has_another_value():
    parts = [problem.load for problem in BODIES.values()]
    parts += [problem.specimen for problem in BODIES.values() if problem.specimen]
    parts += [part.drive for part in parts if hasattr(part, "drive")]
    parts += [part.base for part in parts if hasattr(part, "base")]
    for kind in (st.Load, st.Blocks, st.Slider, st.Base, st.Platen, st.Pusher, st.TopShear):
        for field in dataclasses.fields(kind):
            own = [getattr(part, field.name) for part in parts if isinstance(part, kind)]
            missing = field.name != "type" and field.default is not dataclasses.MISSING
            assert not missing or any(np.any(value != field.default) for value in own), field


@every
def test_other_units_change_nothing_else(name, kind):
    other = world(name, kind).in_units(Pa=0.25, m=2.0, s=8.0)
    close = 1e-9 if kind == "equilibrium" else 1e-5
    results = plain(name, kind), onset(other)
    before, after = (r.drop_vars("event_magnitude", errors="ignore") for r in results)
    assert_alike(before, after, close, other.factor)


@every
def test_a_mirror_mirrors_the_onset(name, kind):
    w = world(name, kind)
    if isinstance(getattr(w.problem.specimen, "drive", None), st.TopShear):
        return  # it has no side
    after = onset(w.moved(np.flip, {"left": "right", "right": "left"}))
    length, seam = w.interface.lengths[0], 0.0 if w.interface.is_free else w.interface.spacing
    alike_but_for_places(
        plain(name, kind), after, 1e-7 if kind == "equilibrium" else 1e-5, np.flip,
        lambda place: length - seam - place, w.interface, swap=True,
    )  # fmt: skip


@every
def test_round_off_of_any_number_moves_no_other(name, kind):
    """By 1e-12 of each number, such as heights of blocks and of pushers that end together."""
    w, rng = world(name, kind), np.random.default_rng(8)
    nudged = _rewritten(w.plain["problem"], lambda unit: 1.0 + rng.uniform(-1e-12, 1e-12))
    if np.all(w.problem.load.profile == 1.0):  # a profile of one is no number of a user
        nudged["load"]["profile"] = 1.0
    strength = w.strength * (1.0 + rng.uniform(-1e-12, 1e-12, w.strength.shape))
    moved = World(w.plain | {"problem": nudged}, strength)
    assert_alike(plain(name, kind), onset(moved), 1e-6 if kind == "equilibrium" else 1e-5)


def test_a_tie_of_arrivals_moves_no_median_speed():
    """Neighbours that arrive together, or one before the other by round-off, in either order."""
    rng, interface = np.random.default_rng(4), st.Interface(0.064, 64, ends="free")
    for tie in (20, 33, 47):
        steps, speeds = 1e-6 * rng.uniform(0.5, 1.5, 64), []
        for steps[tie] in (-1e-15, 0.0, 1e-15):
            found = front_speeds(interface, 0, np.cumsum(steps), 0.016)
            speeds.append(found["median_rupture_speed"])
        np.testing.assert_allclose(speeds, speeds[1], rtol=1e-6)


@every
def test_twice_the_pressure_and_slip_are_twice_the_stress(name, kind):
    """All is in proportion, so that the friction coefficient stays."""
    w, twice = world(name, kind), {"problem.friction.critical_slip": 1.8e-5}
    for key in ("initial_stress", "normal_pressure", "pressing_force"):
        if (value := getattr(w.problem.load, key)) is not None:
            twice[f"problem.load.{key}"] = 2.0 * np.asarray(value)[()]
    problem = with_values({"problem": w.problem}, twice)["problem"]
    before = plain(name, kind)
    after = st.onset(problem, w.profiles(), method=w.method, progress=False)
    factors = {"Pa": 2.0, "N": 2.0, "1": 1.0}
    names = [key for key in before if before[key].attrs.get("units") in factors]
    names = [key for key in names if "magnitude" not in key]
    assert_alike(
        before[names], after[names], 1e-9 if kind == "equilibrium" else 1e-5, factors.get
    )


@pytest.mark.parametrize("name", [n for n in BODIES if BODIES[n].load.pressing_force])
def test_a_pressing_force_is_its_mean_pressure_times_the_area(name):
    """Alone, and in a sweep of it from a file."""
    w, force = world(name, "equilibrium"), BODIES[name].load.pressing_force
    assert w.study.problem == BODIES[name]
    load = st.Load(normal_pressure=force / BODIES[name].area)
    pressed = dataclasses.replace(w.problem, load=load)
    after = st.onset(pressed, w.profiles(), method=w.method, progress=False)
    assert_alike(plain(name, "equilibrium"), after.drop_vars(JUMPING, errors="ignore"), 1e-9)
    sweep = [{"problem.load.pressing_force": [0.8 * force, force]}]
    swept = st.Study.from_dict(w.plain | {"sweep": sweep}).run(progress=False, pilot=False)
    drawn = w.study.run(progress=False, pilot=False)
    np.testing.assert_array_equal(swept.critical_force[1], drawn.critical_force)
    assert swept.pressing_force.units == "N"


@every
def test_an_initial_stress_in_proportion_to_the_load_is_a_load(name, kind):
    """It lowers the critical load by as much, and changes no stress."""
    w = world(name, kind)
    if isinstance(w.problem.specimen, st.Slider):
        return
    initial = w.problem.load.initial_stress + 2e4 * w.problem.load_profile
    load = dataclasses.replace(w.problem.load, initial_stress=initial)
    problem = dataclasses.replace(w.problem, load=load)
    before = plain(name, kind)
    after = st.onset(problem, w.profiles(), method=w.method, progress=False)
    for key in ("critical_stress", "first_instability"):
        np.testing.assert_allclose(after[key], before[key], rtol=1e-6, err_msg=key)
    np.testing.assert_allclose(after.critical_load + 2e4, before.critical_load, rtol=1e-6)


@pytest.mark.parametrize("name", BODIES)
def test_the_sensitivity_of_a_node_is_the_derivative_by_its_strength(name):
    """In pascals, for the nodes on which the onset depends most."""
    law = st.LinearWeakening(weakening_rate=0.09e12, residual_ratio=0.3)
    law = examples("laws of lap joints")["two pieces"] if "pusher" in name else law
    problem = dataclasses.replace(BODIES[name], friction=law)
    mu = world(name, "equilibrium").strength

    def onset(strength: Any, **options: Any) -> Any:
        method = st.Equilibrium(**options)
        given = {"friction_coefficient": strength}
        return st.onset(problem, given, method=method, progress=False).isel(sample=0)

    found = onset(mu[:1], sensitivity=True)
    nodes = np.argsort(np.abs(found.sensitivity.values))[[-1, -3, -8]]
    pascals = problem.sample({"friction_coefficient": mu[:1]}).strength[0] / mu[0]
    for node in nodes:
        raised, step = mu[:1].copy(), 1e-6
        raised[0, node] += step
        change = float(onset(raised).first_instability - found.first_instability)
        derivative = change / (step * pascals[node])
        assert float(found.sensitivity[node]) == pytest.approx(derivative, rel=1e-3), node
