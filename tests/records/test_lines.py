"""Recorded outputs: onsets, paths and theory on lines where nothing is symmetric."""

import dataclasses

import numpy as np
from crooked import LINE, TWO, of_width, uneven
from recording import Calls, compared
from setups import EXACT, LOCAL, edge_load, gradient_load, make_problem, without

import stiction as st
from stiction.problem.resolution import nodes_in_nucleation_length

calls = Calls()
INTERFACE = LINE.interface
ROUGH = 1.15e6 + 5.2e5 * uneven(INTERFACE, seed=21)
"""A strength of a range so wide that instabilities are arrested."""
ORACLE = "linear programme and sums over patches, tests/oracle/test_crooked.py"
EVENTS = "stepping event by event, tests/oracle/test_equilibrium.py"
READ = "formula read beside the code"


def barred(interface, low=4.2e5):
    """A weak place within barriers."""
    x = interface.x / interface.length
    wall = (np.abs(x - 0.31) < 0.14) & (np.abs(x - 0.31) > 0.09)
    dip = 1.2e6 + 9e4 * uneven(interface, seed=9) - low * np.exp(-(((x - 0.77) / 0.09) ** 2))
    weak = 6e5 + 8e4 * uneven(interface, seed=6)
    return np.where(wall, 3.3e6, np.where(np.abs(x - 0.31) <= 0.09, weak, dip))


def law(kind, **more):
    about = {
        "residual_strength": 1.7e5 + 4e4 * uneven(INTERFACE, seed=4),
        "weakening_rate": 2.3e11,
    }
    return dataclasses.replace(LINE, friction=kind(**about | more))


@calls("closed form of the mean stress; " + ORACLE)
def local_criterion_with_forces_in_mode_three():
    problem = dataclasses.replace(of_width(LINE, 0.0123), mode="III")
    return st.onset(problem, TWO, method=LOCAL)


@calls(ORACLE + "; sensitivity by difference quotients, tests/exact/test_equilibrium.py")
def exact_onsets_with_slip_sensitivity_and_forces():
    method = st.Equilibrium(slip=True, sensitivity=True)
    return st.onset(of_width(LINE, 0.0123), TWO, method=method)


@calls(EVENTS)
def arrested_events_of_two_strengths():
    both = np.stack([barred(INTERFACE), np.roll(barred(INTERFACE, 3.1e5), 17)])
    return st.onset(LINE, both, method=st.Equilibrium(events=3))


@calls(EVENTS)
def a_law_of_two_pieces_with_critical_slip_along_x():
    slip = 2.6e-6 + 7e-7 * uneven(INTERFACE, seed=12)
    pieces = {"slip": (0.4, 1.0), "strength": (0.35, 0.0)}
    problem = law(st.PiecewiseWeakening, weakening_rate=None, critical_slip=slip, **pieces)
    return st.onset(problem, TWO, method=st.Equilibrium(events=2, slip=True))


@calls(EVENTS)
def a_law_that_rests_and_steepens():
    problem = law(
        st.PiecewiseWeakening, slip=(0.2, 0.5, 0.8, 1.0), strength=(0.7, 0.69, 0.15, 0.0)
    )
    return st.onset(problem, TWO, method=st.Equilibrium(sensitivity=True))


@calls("difference quotients of 20 Pa, to 1e-7", close=1e-5)
def sensitivity_of_a_law_of_two_pieces():
    """Of so wide a range that weak nodes pass corners before the first instability."""
    scale = {"weakening_rate": 2.9e11, "slip": (0.05, 1.0), "strength": (0.8, 0.0)}
    problem = make_problem(96, 0.037, friction=st.PiecewiseWeakening(**scale))
    rough = 1e5 + 3.0 * (TWO - TWO.min(axis=1, keepdims=True))
    return st.onset(problem, rough, method=st.Equilibrium(sensitivity=True, slip=True))


@calls(EVENTS + ", and the same if no patch counts as too long to be stopped")
def arrests_of_a_law_that_falls_late():
    friction = st.PiecewiseWeakening(
        weakening_rate=2.9e10, residual_strength=2e5, slip=(0.8, 1.0), strength=(0.9, 0.0)
    )
    problem = make_problem(96, 0.037, friction=friction)
    away = np.abs(problem.interface.x / 0.037 - 0.4)
    weak = 6e5 + 2e4 * np.cos(40.0 * away + 0.3)
    strength = np.where(away < 0.09, weak, np.where(away < 0.18, 1.73e6, 2.4e6))
    found = st.onset(problem, strength, method=st.Equilibrium(events=3))
    return found.drop_vars("sliding_position")  # of two alike, on both sides


@calls(EVENTS)
def several_profiles_by_name():
    profiles = {
        "strength": TWO,
        "residual_strength": 2.1e5 + 5e4 * uneven(INTERFACE, seed=13),
        "initial_stress": -3e4 + 6e4 * uneven(INTERFACE, seed=14),
        "weakening_rate": 2.6e11 + 4e10 * uneven(INTERFACE, seed=15),
        "normal_pressure": np.stack(
            [1.6e5 * s + 8e5 * uneven(INTERFACE, seed=s) for s in (16, 17)]
        ),
    }
    keys = "friction.residual_strength", "friction.weakening_rate"
    bare = without(LINE, *keys, "load.initial_stress", "load.normal_pressure")
    return st.onset(bare, profiles, method=EXACT)


@calls("states checked as equilibria, tests/properties/test_equilibrium.py")
def a_path_through_an_arrested_event():
    loads = [1.1e5, 2.9e5, 3.6e5, 4.1e5, 4.6e5, 5.6e5, 9e5]
    return st.equilibrium_path(of_width(LINE, 0.0123), barred(INTERFACE), loads)


@calls(READ + ": excess * exp(-distance/decay), 1 + amplitude cos")
def loads_with_an_edge_and_a_gradient():
    found = {}
    for name, shape in {
        "edge": edge_load(LINE.interface, 1.7, 0.0031, 0.23),
        "gradient": gradient_load(LINE.interface, 0.41, 0.37),
    }.items():
        load = dataclasses.replace(LINE.load, profile=shape.profile)
        problem = dataclasses.replace(LINE, load=load)
        found[name] = st.onset(problem, TWO, method=EXACT)
    return found


@calls(READ + ": h_n = 2 lambda_0 G*/W, and nodes in that of the steepest slope")
def nodes_in_the_nucleation_length_of_a_law_that_falls_late():
    late = st.PiecewiseWeakening(weakening_rate=5e9, slip=(0.5, 1.0), strength=(0.99, 0.0))
    problem = make_problem(512, 0.05, friction=late)
    return [problem.nucleation_length, *nodes_in_nucleation_length(problem, 5e9)]


test_outputs_are_as_recorded = compared(calls, __file__)
