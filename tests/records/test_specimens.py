"""Recorded outputs: finite blocks, each drive, machine, mode and pressing."""

import dataclasses
from functools import partial

import numpy as np
from recording import CLOSE, Call, Calls, compared
from setups import LOCAL
from specimens import crooked, rough

import stiction as st

calls = Calls()
ELEMENTS = "stiffness by finite elements, tests/oracle/test_block_response.py; "
STEPS = ELEMENTS + "stepping without going back, validation/specimens.py"
EVENTS = st.Equilibrium(events=4, slip=True, sensitivity=True)


def solved(problem, seed=5, method=EVENTS, samples=2):
    return st.onset(problem, rough(problem, seed, samples), method=method)


TWO_PIECES = st.PiecewiseWeakening(
    weakening_rate=0.26e12, residual_strength=0.45e6, slip=(0.3, 1.0), strength=(0.55, 0.0)
)
DRIVEN = {  # and the seed of the strengths
    "platen_under_dead_load": (crooked(nodes=72), 5),
    "platen_behind_a_machine_in_mode_three": (
        crooked(nodes=72, mode="III", drive=st.Platen(stiffness=4.1e7), height=0.019), 7,
    ),
    "pusher_on_the_left_behind_a_machine": (
        crooked(nodes=72, drive=st.Pusher(height=0.006, width=0.0035, stiffness=8.3e7)), 8,
    ),
    "pusher_on_the_right_in_plane_strain": (
        crooked(
            nodes=72, drive=st.Pusher(height=0.013, width=0.007, side="right"),
            plane="strain", nu=0.41, height=0.045,
        ), 9,
    ),
    "pushers_on_both_sides_of_a_stiff_machine": (
        crooked(
            nodes=72, drive=st.Pusher(height=0.004, width=0.002, side="both", stiffness=9e8),
            height=0.021, residual=0.31e6,
        ), 11,
    ),
    "a_law_of_two_pieces": (dataclasses.replace(crooked(nodes=72), friction=TWO_PIECES), 13),
}  # fmt: skip
for name, given in DRIVEN.items():
    calls[name] = Call(partial(solved, *given), STEPS, CLOSE)


@calls(STEPS)
def glued_pressing_of_friction_coefficients():
    problem = crooked(nodes=72, height=0.024)
    blocks = dataclasses.replace(problem.specimen, pressing="glued")
    problem = dataclasses.replace(
        problem,
        specimen=blocks,
        friction=st.LinearWeakening(weakening_rate=0.21e12, residual_ratio=0.37),
    )
    field = st.RandomField(
        st.Lognormal(mean=0.43, cv=0.19),
        st.ExponentialSpectrum(6e-3, power_kept=0.95),
        quantity="friction_coefficient",
    )
    return st.monte_carlo(problem, field, method=st.Equilibrium(events=2), samples=3, seed=2)


@calls("energies and waves, tests/exact/test_block_waves.py", close=1e-5)
def events_with_inertia():
    drive = st.Pusher(height=0.02, width=0.01, stiffness=2e7)
    return solved(crooked(nodes=64, drive=drive), 3, st.Rupture(events=4))


@calls("states checked as equilibria, tests/exact/test_specimens.py")
def a_path_with_travel_and_force():
    drive = st.Pusher(height=0.007, width=0.004, stiffness=6e7)
    problem = crooked(nodes=72, drive=drive)
    loads = np.linspace(3e5, 1.6e6, 7)
    return st.equilibrium_path(problem, rough(problem, 6)[0], loads)


@calls("least place of the block's own windows, tests/exact/test_specimens.py")
def local_criterion_under_a_pusher_and_a_platen():
    drive = st.Pusher(height=0.012, width=0.006)
    return {
        "pusher": solved(crooked(nodes=88, drive=drive), 14, LOCAL, 3),
        "platen": solved(crooked(nodes=88, mode="III", height=0.05), 15, LOCAL, 3),
    }


@calls("response of refined elements, tests/oracle/test_block_response.py", close=1e-5)
def stiffness_and_response_of_blocks():
    drive = st.Pusher(height=0.009, width=0.005, side="both", stiffness=2.2e8)
    found = {}
    for name, problem in {
        "pushers": crooked(nodes=60, drive=drive, nu=0.21),
        "platen": crooked(nodes=60, plane="strain", nu=0.45, height=0.07),
        "three": crooked(nodes=60, mode="III", drive=st.Platen(stiffness=3e7)),
        "three pushed": crooked(nodes=60, mode="III", drive=drive, height=0.023),
    }.items():
        blocks = problem.blocks
        found[name] = {
            "stiffness": blocks.stiffness,
            "shear": blocks.shear,
            "relief": blocks.relief,
            "travel": blocks.travel(1.3e4, np.linspace(0.0, 2e-6, 60)),
        }
    return found


test_outputs_are_as_recorded = compared(calls, __file__)
