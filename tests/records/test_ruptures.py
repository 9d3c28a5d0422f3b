"""Recorded outputs: ruptures on lines with every kind of law, load, start and stop."""

import dataclasses
import json
import tempfile
from pathlib import Path

import numpy as np
from crooked import across_the_seam, uneven
from recording import Calls, compared, refusal
from setups import make_problem

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
    with tempfile.TemporaryDirectory() as folder:
        save = st.Save(["slip"], every=40, stations={"a": 0.013}, to=Path(folder) / "run")
        given, times = {"loading_rate": None, "stop": "onset", "save": save}, [0.0, 1e-3, 2e-3]
        ends = {"same": 9e5, "again": 9e5, "other": 8e5}
        found = {
            name: refusal(
                lambda at=at: run(problem, strength, load=(times, [0, 9e5, at]), **given)
            )
            for name, at in ends.items()
        }
        about = open_rupture(Path(folder) / "run").attrs
    return {"stopped": about["stopped"], "study": sorted(json.loads(about["study"]))} | {
        name: one.replace(folder, "") if isinstance(one, str) else one.critical_stress
        for name, one in found.items()
    }


@calls(WAVES, close=CLOSE)
def barriers_that_arrest():
    problem, strength = line()
    x = problem.interface.x / problem.interface.length
    walled = np.where((np.abs(x - 0.32) > 0.12) & (np.abs(x - 0.32) < 0.17), 4e6, strength)
    return run(problem, walled, stop="rest")


@calls("onset of each as by simulate_rupture, to the bit", close=CLOSE)
def an_ensemble():
    problem, _ = line(nodes=96)
    field = st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6), st.PowerLawSpectrum(2.1e-3)
    )
    method = st.Rupture(loading_rate=9e8, kernel_tolerance=FASTER, stop="onset")
    return st.monte_carlo(problem, field, method=method, samples=3, seed=7, workers=1)


test_outputs_are_as_recorded = compared(calls, __file__)
