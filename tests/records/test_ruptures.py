"""Recorded outputs: ruptures on lines with every kind of law, load, start and stop."""

import dataclasses
import json

import numpy as np
from crooked import across_the_seam, uneven
from recording import Calls, compared, inside, refusal
from ruptures import wavy_line
from setups import beta_strength, make_problem, within

import stiction as st
from stiction.methods.dynamics.save import open_rupture

calls = Calls()
WAVES = (
    "Kostrov's crack, Lamb's load and convolution, tests/exact/test_dynamics_waves.py; uguca"
)
CLOSE = 1e-5
FASTER = 1e-5


def line(nodes=128, **more):
    """A line with nothing symmetric about it, and a weak place."""
    about = {"weakening_rate": 0.42e12, "residual_strength": 2.1e5}
    interface = st.Interface(0.043, nodes)
    load = st.Load(
        profile=1.0 + 0.2 * uneven(interface, seed=1),
        initial_stress=4e4 + 3e4 * uneven(interface, seed=2),
    )
    problem = make_problem(nodes, 0.043, load=load, **about | more)
    dip = across_the_seam(problem.interface, 3e-3)
    strength = 1.05e6 + 1.1e5 * uneven(problem.interface, seed=3) - 3.1e5 * np.roll(dip, 41)
    return problem, strength


def run(problem, strength, save=None, **options):
    given = {"loading_rate": 8e8, "kernel_tolerance": FASTER, "max_steps": 20_000}
    method = st.Rupture(**given | options)
    save = save or st.Save(
        ["slip", "slip_rate", "strength"], every=60, stations={"a": 0.011, "b": 0.0371}
    )
    return st.simulate_rupture(problem, strength, method=method, save=save)


def summary(problem, strength, **options):
    """The numbers of a run without its fields."""
    found = run(problem, strength, st.Save([], every=500), **options)
    # Without residual strength the kinetic stress is zero, or a round-off error of about 1e-10 Pa.
    return found.drop_dims(["step", "time"]).assign(
        kinetic_stress=found.kinetic_stress.round(3)
    )


@calls(WAVES, close=CLOSE)
def in_plane_with_stations():
    return run(*line())


@calls(WAVES, close=CLOSE)
def antiplane_with_an_exponential_law():
    interface = st.Interface(0.043, 128)
    friction = st.ExponentialWeakening(
        critical_slip=1.7e-6 + 3e-7 * uneven(interface, seed=4), residual_strength=1.6e5
    )
    return run(*line(mode="III", friction=friction), courant=0.7, arrival=0.3, start="rest")


@calls(WAVES, close=CLOSE)
def a_law_that_steepens_in_plane_stress():
    friction = st.PiecewiseWeakening(
        weakening_rate=0.4e12, residual_strength=1.9e5, slip=(0.4, 1.0), strength=(0.8, 0.0)
    )
    solid = st.Solid(shear_modulus=1.1e9, poisson_ratio=0.29, density=1210.0, plane="stress")
    return run(*line(friction=friction, solid=solid))


@calls(WAVES, close=CLOSE)
def a_load_history_that_is_held_and_lowered():
    problem, strength = line(nodes=96)
    load = dataclasses.replace(problem.load, normal_pressure=4.3e4)  # which is doubted
    problem = dataclasses.replace(problem, load=load)
    history = ([0.0, 9e-4, 1.1e-3, 1.5e-3], [0.0, 6.6e5, 6.9e5, 5.1e5])
    return run(problem, strength, loading_rate=None, load=history, end_time=1.6e-3, stop="rest")


@calls("every number of the setting enters the digest, read", close=CLOSE)
def a_folder_that_holds_the_run_of_another_load():
    problem, strength = line(nodes=96)
    with inside():
        save = st.Save(["slip"], every=40, stations={"a": 0.013}, to="run")
        given, times = {"loading_rate": None, "stop": "onset", "save": save}, [0.0, 1e-3, 2e-3]
        ends = {"same": 9e5, "again": 9e5, "other": 8e5}
        found = {
            name: refusal(
                lambda at=at: run(problem, strength, load=(times, [0, 9e5, at]), **given)
            )
            for name, at in ends.items()
        }
        about = open_rupture("run").attrs
    return {"stopped": about["stopped"], "study": sorted(json.loads(about["study"]))} | {
        name: one if isinstance(one, str) else one.critical_stress
        for name, one in found.items()
    }


def placed(problem, low, high):
    """Nodes within a range of x/L."""
    x = problem.interface.x / problem.interface.length
    return (x > low) & (x < high)


@calls(WAVES, close=CLOSE)
def barriers_that_arrest():
    problem, strength = line()
    x = problem.interface.x / problem.interface.length
    walled = np.where((np.abs(x - 0.32) > 0.12) & (np.abs(x - 0.32) < 0.17), 4e6, strength)
    return run(problem, walled, stop="rest")


@calls("the onset as by equilibrium, .4 % later at so fast a load", close=CLOSE)
def barriers_that_never_slip():
    """And a uniform critical slip, by which a barrier weakens the more steeply."""
    problem, strength = line(nodes=96)
    by_slip = dataclasses.replace(problem, friction=st.LinearWeakening(critical_slip=3e-6))
    inside = placed(problem, 0.6, 0.8)
    return {
        "to the end": summary(within(problem, ~inside), strength),
        "onset": summary(within(by_slip, ~inside), strength, stop="onset"),
        "too steep": summary(by_slip, np.where(placed(problem, 0.31, 0.35), 2e7, strength)),
    }


@calls("a patch that breaks at once is no onset, read", close=CLOSE)
def a_patch_that_is_overstressed():
    """At once, by explicit steps alone; and under no load at all."""
    problem, strength = line(nodes=96)
    patch = np.where(placed(problem, 0.2, 0.33), 1.1 * strength, 5e5)
    problem = dataclasses.replace(problem, load=st.Load(initial_stress=patch))
    held = {"loading_rate": None, "load": ([0.0, 1.0], [0.0, 0.0]), "stop": "time"}
    return {
        "loaded": summary(problem, strength),
        "explicit": summary(problem, strength, implicit=False).arrival_time,
        "held": summary(problem, strength, end_time=3e-5, **held),
    }


@calls("read beside the rule: slip may not reverse", close=CLOSE)
def slip_that_would_reverse():
    problem, strength = line(nodes=96)
    pulled = st.Load(initial_stress=np.where(placed(problem, 0.9, 1.1), -2e6, 0.0))
    pulled = dataclasses.replace(problem, load=pulled)
    load = ([0.0, 9e-4, 1.1e-3], [0.0, 6.9e5, -2e6])
    return {
        "unloaded": summary(problem, strength, loading_rate=None, load=load),
        "pulled": summary(pulled, strength, stop="onset"),
    }


@calls("the first global sliding only counts, read", close=CLOSE)
def loads_after_global_sliding():
    """Unloaded to rest; and a sudden load on a barrier, whose mean stress rises above the onset."""
    problem, strength = line(nodes=96)
    slow, given = 1.2e-3, {"loading_rate": None, "stop": "time"}
    falls = ([0.0, slow, 1.25e-3, 1.35e-3, 1.6e-3], [0.0, 1.1e6, 1.1e6, 1e5, 1e5])
    sudden = ([0.0, slow, 1.21e-3, 2e-3], [0.0, 1e6, 2.2e6, 2.2e6])
    walled = within(problem, ~placed(problem, 0.6, 0.8))
    return {
        "falls": summary(problem, strength, load=falls, end_time=1.55e-3, **given).drop_vars(
            "event_area_stress_drop"  # which is zero
        ),
        "sudden": summary(walled, strength, load=sudden, end_time=1.4e-3, **given),
    }


@calls("the onset as by equilibrium, .4 % later at so fast a load", close=CLOSE)
def nodes_that_hardly_weaken():
    problem, strength = line(nodes=96)
    residual = np.broadcast_to(problem.friction.residual_strength, 96)
    weak = np.where(np.arange(96) == 70, residual * (1.0 + 1e-5), strength)
    high = dataclasses.replace(
        problem, friction=st.LinearWeakening(critical_slip=2e-6, residual_strength=9.5e5)
    )
    return {
        "one": summary(problem, weak),
        "many": summary(high, strength, implicit=False),
        "at once": summary(high, strength, loading_rate=8e9, stop="onset").critical_stress,
    }


@calls("the onset of equilibrium to 4e-4, and the mean slip of explicit steps", close=CLOSE)
def onsets_and_waves_of_slow_loads():
    """Under a negative mean stress; waves of an arrested rupture; patches about equally slow."""
    problem, strength = wavy_line()
    x = np.arange(128) / 128
    pushed = np.abs(x - 0.5) < 0.3
    load = st.Load(initial_stress=np.where(pushed, -3e6, 0.0))
    method = st.Rupture(loading_rate=1e7, stop="onset")
    found = {
        "pushed": st.onset(
            dataclasses.replace(problem, load=load),
            np.where(pushed, 5e6, strength),
            method=method,
        )
    }
    at = np.arange(1024) / 1024
    arrested = np.where(np.abs(at - 0.4) < 0.25, 0.8e6 + 1e3 * at, 6e6)  # not symmetric
    end = {"stop": "time", "end_time": 0.8e6 / 1e8 + 2.2e-4}  # four times the period over c_s
    method, save = st.Rupture(loading_rate=1e8, **end), st.Save([], every=500)
    line, _ = wavy_line(1024, weakening_rate=0.5e12)
    found["waves"] = st.simulate_rupture(line, arrested, method=method, save=save).mean_slip
    problem = st.paper.problem(nodes=512)
    field = st.paper.strength(problem, correlation_ratio=0.5)
    strength = field.sample(problem.interface, samples=1, seed=3, first=18)
    method = st.Rupture(loading_rate=1e3)
    found["place"] = st.onset(problem, strength, method=method).critical_position
    return found


@calls("onset of each as by simulate_rupture, to the bit", close=CLOSE)
def an_ensemble():
    problem, _ = line(nodes=96)
    method = st.Rupture(loading_rate=9e8, kernel_tolerance=FASTER, stop="onset")
    return st.monte_carlo(
        problem, beta_strength(2.1e-3), method=method, samples=3, seed=7, workers=1
    )


test_outputs_are_as_recorded = compared(calls, __file__)
