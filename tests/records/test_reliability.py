"""Recorded outputs: failure probabilities, design stresses, curves, and lists of interfaces."""

import dataclasses
import pickle
from functools import partial

import numpy as np
import scipy.stats
import xarray as xr
from crooked import LINE, of_width
from recording import Calls, compared
from setups import EXACT, LOCAL, beta_strength, gradient_load, make_problem, turns, without
from specimens import crooked
from stand_ins import BoundedStandIn

import stiction as st
from stiction.random.stresses import share_below_residual

calls = Calls()
COUNTED = "counting of many samples, tests/oracle/test_reliability.py"
BOUNDED = beta_strength(2.3e-3)
LOAD = gradient_load(
    st.Interface(0.031, 96), 0.2, 0.3, initial_stress=4e4, normal_pressure=2.3e6
)
SMALL = make_problem(96, 0.031, weakening_rate=0.42e12, residual_strength=1.3e5, load=LOAD)
WIDE = of_width(SMALL, 0.0117)
EXPONENTIAL = st.ExponentialSpectrum(3e-3, power_kept=0.95)
PRESSED = st.RandomInterface(
    strength=st.RandomField(
        st.Lognormal(mean=0.43, cv=0.14), EXPONENTIAL, quantity="friction_coefficient"
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
    bare = without(SMALL, "load.normal_pressure")
    return probability(None, bare, random=PRESSED, method=LOCAL, target_cv=0.5, seed=7, **given)


def paper(nodes=256):
    problem = st.paper.problem(nodes=nodes)
    return {"problem": problem, "random": st.paper.strength(problem, 0.5)}


SYSTEM = paper()
designed = partial(st.design_stress, method=LOCAL, workers=1)


@calls("P = 7e-5 by counting lies within; upper limits where a run ended", close=1e-5)
def what_small_budgets_leave_open():
    """And runs of twenty samples, of which two go on, and chains repeat them."""
    few = {"max_evaluations": 3000}
    given = SYSTEM | {"method": LOCAL}
    found = {
        f"{algorithm} {most}": probability(
            6.65e5, target_cv=0.05, algorithm=algorithm, max_evaluations=most, **SYSTEM
        )
        for algorithm in ("auto", "plain", "subset", "two_level")
        for most in (100, 400)
    }
    return found | {
        "subset": probability(6.605e5, algorithm="subset", **few, **given),
        "design": designed(probability=1e-9, **few, **SYSTEM),
        "curve": st.failure_curve(smallest=1e-9, **few, **given),
        "ties": probability(
            6.6001e5, method=LOCAL, algorithm="subset", max_evaluations=150, **paper(136)
        ),
    }


@calls("a pilot that leads to counting is not counted; Clopper and Pearson", close=1e-5)
def frequent_failures_and_a_median_interface_that_fails():
    """At the origin of the draws the strength is its median, 0.97 MPa, everywhere."""
    given = SYSTEM | {"method": LOCAL}
    return {
        "subset": probability(9.9e5, algorithm="subset", **given),
        "auto": probability(9.9e5, **given),
        "counted": probability(7e5, target_cv=0.1, seed=4, **given),
    }


@calls("the bound itself, below which nothing lies", close=1e-5)
def onsets_that_pile_up_on_the_bound():
    """By the local criterion under another name, low onsets piled up as by rounding."""

    def piled(rows, stress):
        return np.where(stress < 6.75e5, 6.6e5, stress)

    found = {}
    for stage in ("local_criterion", None):
        method = BoundedStandIn(piled, "equilibrium", stage, seconds=1e-3)
        given = SYSTEM | {"method": method, "target_cv": 0.3}
        found[stage or "none"] = designed(probability=1e-5, **given)
        found[f"few {stage}"] = designed(probability=1e-12, max_evaluations=100, **given)
    return found


def rough(share, cv, **residual):
    """Strength that varies within a share of h_n, on four of these."""
    problem = make_problem(96, 0.0144, weakening_rate=0.5e12, **residual)
    spectrum = st.PowerLawSpectrum(share * problem.nucleation_length)
    random = st.RandomField(st.Lognormal(mean=1e6, cv=cv), spectrum, True)
    return {"problem": problem, "random": random}


@calls("2,000 samples by both: equilibrium fails .7 and 1.45 times as often", close=1e-5)
def the_local_criterion_beside_equilibrium():
    """Onsets that come later, and earlier, where nearly all of the last level fails."""
    later, earlier = rough(0.3, 0.25, residual_ratio=0.5), rough(0.12, 0.2)
    subset = {"method": LOCAL, "algorithm": "subset"}
    return {
        "later": probability(6.6e5, target_cv=0.2, **subset, **later),
        "design": designed(probability=1e-3, target_cv=0.3, **later),
        "earlier": probability(7.505e5, **subset, **earlier),
    }


@calls("10,000 samples, and a place that would be impossible without its scan", close=1e-5)
def a_specimen_that_was_scanned():
    problem, spectrum = SMALL, BOUNDED.spectrum
    places = problem.interface.x[:30]
    scan = xr.DataArray(0.9e6 + 1e5 * np.sin(600.0 * places), {"x": places}, "x")
    weak = st.RandomField(st.Lognormal(mean=1e6, cv=0.12), spectrum)
    known = [BOUNDED.given(scan, noise=2e4), weak.given(0.4 * scan, noise=1e3)]
    given = {"method": LOCAL, "target_cv": 0.4}
    return [
        probability(stress, random=one, **given)
        for one, stress in zip(known, (6.7e5, 3.7e5), strict=True)
    ]


@calls("counted over 4,000 samples, and a thirty-second by hand of uniform ones")
def shares_of_the_strength_below_the_residual():
    """Of correlated fields; of stresses and of coefficients under a pressure that varies."""
    lognormal = st.RandomField(st.Lognormal(mean=7e5, cv=0.15), BOUNDED.spectrum)
    problem, both = SYSTEM["problem"], {"strength": BOUNDED, "residual_strength": lognormal}
    found = {}
    for rho in (0.9, -0.6, 1.0):
        random = st.RandomInterface(**both, correlation={tuple(both): rho})
        found[str(rho)] = share_below_residual(problem, random)
    pressure = 2e6 * (1.0 + 0.3 * np.cos(turns(256)) + 0.1 * np.sin(2.0 * turns(256)))
    pressed = dataclasses.replace(problem, load=st.Load(normal_pressure=pressure))
    for units in ((1.0, 1.0), (2e6, 1.0), (1.0, 2e6), (2e6, 2e6)):
        fields = {
            name: st.RandomField(
                scipy.stats.uniform(low / unit, 4e5 / unit),
                BOUNDED.spectrum,
                quantity=None if unit == 1.0 else "friction_coefficient",
            )
            for name, low, unit in zip(both, (3e5, 0.0), units, strict=True)
        }
        found[str(units)] = share_below_residual(pressed, st.RandomInterface(**fields))
    return found


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
    bare = without(SMALL, "load.normal_pressure")
    state = st.external.limit_state(bare, PRESSED, EXACT)
    draws = state.draws(seed=3, first=255, samples=3)
    field, names = (
        dataclasses.replace(BOUNDED, mean_mode=True),
        ("correlation_length", "marginal.low"),
    )
    by = st.external.simulator(LINE, field, names, method=LOCAL, samples=3, seed=2)
    by = pickle.loads(pickle.dumps(by))  # for the processes of a sampler
    return {
        "written": repr(state),
        "dimension": state.dimension,
        "bounds": state.bounds,
        "stress": state(draws),
        "profiles": state.profiles(draws),
        "simulated": [by([2.2e-3, 6.1e5]), by([3.9e-3, 5.5e5], first=4)],
    }


test_outputs_are_as_recorded = compared(calls, __file__)
