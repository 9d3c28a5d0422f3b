"""Recorded outputs: failure probabilities, design stresses, curves, and lists of interfaces."""

import dataclasses

from crooked import LINE
from recording import Calls, compared
from setups import EXACT, LOCAL, make_problem
from specimens import crooked

import stiction as st

calls = Calls()
COUNTED = "counting of many samples, tests/oracle/test_reliability.py"
BOUNDED = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    st.PowerLawSpectrum(2.3e-3, truncation=2.5),
)
SMALL = make_problem(
    96,
    0.031,
    weakening_rate=0.42e12,
    residual_strength=1.3e5,
    load=st.Load(
        profile=st.GradientLoad(amplitude=0.2, centre=0.3),
        initial_stress=4e4,
        normal_pressure=2.3e6,
    ),
)
WIDE = dataclasses.replace(SMALL, interface=st.Interface(0.031, 96, width=0.0117))
PRESSED = st.RandomInterface(
    strength=st.RandomField(
        st.Lognormal(mean=0.43, cv=0.14),
        st.ExponentialSpectrum(3e-3, power_kept=0.95),
        of="friction_coefficient",
    ),
    normal_pressure=st.RandomField(
        st.Gamma(mean=2.3e6, cv=0.1), st.SquaredExponentialSpectrum(4e-3)
    ),
)


def probability(stress, problem=SMALL, random=BOUNDED, method=EXACT, **more):
    return st.failure_probability(problem, random, stress, method=method, workers=1, **more)


@calls(COUNTED, close=1e-5)
def rare_by_subset_simulation_with_force():
    return probability(6.9e5, WIDE, method=LOCAL, target_cv=0.3, seed=4)


@calls(COUNTED, close=1e-5)
def frequent_by_counting():
    given = {"event": "first_instability", "max_evaluations": 2000}
    return probability(8.1e5, target_cv=0.25, seed=5, **given)


@calls(COUNTED, close=1e-5)
def two_levels():
    given = {"algorithm": "two_level", "max_evaluations": 30_000}
    return probability(7.3e5, target_cv=0.5, seed=6, **given)


@calls(COUNTED, close=1e-5)
def a_coefficient_under_a_random_pressure():
    given = {"algorithm": "subset", "max_evaluations": 20_000, "friction_coefficient": 0.31}
    return probability(None, random=PRESSED, method=LOCAL, target_cv=0.5, seed=7, **given)


@calls("bounds of the strength, tests/exact/test_reliability_bounds.py")
def below_and_above_what_any_interface_carries():
    return [probability(stress, method=LOCAL) for stress in (4.1e5, 2.1e6)]


@calls(COUNTED, close=1e-5)
def design_stress_of_a_list():
    list_ = [
        dataclasses.replace(BOUNDED, marginal=st.Lognormal(mean=mean, cv=cv))
        for mean, cv in ((9.7e5, 0.17), (1.04e6, 0.22), (1.11e6, 0.15))
    ]
    return st.design_stress(
        WIDE, list_, probability=3e-3, method=LOCAL, target_cv=0.3, seed=8, workers=1
    )


@calls(COUNTED, close=1e-5)
def a_curve_to_a_thousandth():
    return st.failure_curve(
        WIDE, BOUNDED, method=LOCAL, smallest=1e-3, target_cv=0.3, seed=9, workers=1
    )


@calls(COUNTED, close=1e-5)
def a_specimen_in_newtons():
    problem = crooked(nodes=72, drive=st.Pusher(height=0.012, width=0.006))
    field = dataclasses.replace(BOUNDED, spectrum=st.PowerLawSpectrum(4e-3))
    given = {"target_cv": 0.4, "max_evaluations": 1500}
    return probability(7.1e5, problem, field, seed=3, **given)


@calls("onset of the profiles of the same draws")
def limit_state_and_simulator():
    state = st.external.limit_state(SMALL, PRESSED, EXACT, event="first_instability")
    draws = state.draws(seed=3, first=255, samples=3)
    by = st.external.simulator(
        LINE,
        dataclasses.replace(BOUNDED, mean_mode=True),
        ("correlation_length", "marginal.low"),
        method=LOCAL,
        samples=3,
        seed=2,
    )
    return {
        "written": repr(state),
        "dimension": state.dimension,
        "bounds": state.bounds,
        "stress": state(draws),
        "profiles": state.profiles(draws),
        "simulated": [by([2.2e-3, 6.1e5]), by([3.9e-3, 5.5e5], first=4)],
    }


test_outputs_are_as_recorded = compared(calls, __file__)
