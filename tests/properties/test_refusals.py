"""What cannot be computed is refused, in words that name the argument and what is wrong."""

import dataclasses
from functools import partial

import numpy as np
import pytest
from refusals import refuses
from ruptures import BREAKING_PLANE
from setups import LENGTH, LOCAL, RATE, SOLID, beta_strength, local_onset, make_problem

import stiction as st
from stiction.criterion.local import excess_of
from stiction.elasticity.exponential_sum import fit_exponentials
from stiction.statistics import combined_mean, density, quantiles
from stiction.theory import energy_release_rate, griffith_length, nucleation_statistics

LINE, FIELD = make_problem(), beta_strength(2e-3)
SPECTRUM, ONE = FIELD.spectrum, np.full(256, 1e6)
RECORD = FIELD.sample(LINE.interface, seed=1)[0]
RATIO = make_problem(residual_ratio=0.5)
UNEVEN = make_problem(load=st.Load(profile=np.linspace(0.9, 1.1, 256)))
PLANE = make_problem((48, 48), (5.0 * LENGTH, 4.0 * LENGTH))
TWO_SCALES = {"strength": FIELD, "weakening_rate": FIELD, "critical_slip": FIELD}
STRETCHED = beta_strength(2e-3, anisotropy=2.0)
IN_STRESS = dataclasses.replace(SOLID, plane="stress")
WIDE = make_problem((64, 48), (0.02, 0.014))
NARROW = make_problem((16, 48), (1.6 * LENGTH, 4.0 * LENGTH))
PAIR = ("strength", "residual_strength")
THREE = {PAIR: 0.9, ("strength", "initial_stress"): 0.9, (PAIR[1], "initial_stress"): -0.9}


def with_barrier(node):
    rows = LINE.sample(ONE)
    strength = rows.strength.copy()
    strength[0, node] = np.inf
    return excess_of(rows._replace(strength=strength))


def random_plane(problem):
    return st.monte_carlo(problem, beta_strength(1e-3), method=LOCAL, samples=2, progress=False)


def uneven_plane():
    rate = np.full((48, 48), RATE)
    rate[3, 4] *= 0.9
    friction = st.LinearWeakening(weakening_rate=rate)
    return random_plane(dataclasses.replace(PLANE, friction=friction))


def correlated(correlation):
    fields = {name: FIELD for name in ("strength", "residual_strength", "initial_stress")}
    return st.RandomInterface(**fields, correlation=correlation)


def simulate(problem, stations):
    strength = np.full(problem.interface.shape, 1e6)
    method, save = st.Rupture(loading_rate=1e8), st.Save(stations=stations)
    return st.simulate_rupture(problem, strength, method=method, save=save)


fit_between = partial(st.fit_field, between=True)


def field_of(**table):
    return st.RandomField(table, SPECTRUM)


CASES = [
    (with_barrier, [3], "must be finite everywhere ... st.Rupture"),
    (fit_exponentials, ["II", 1.7, 1e-14], "tolerance"),
    (energy_release_rate, [RATIO, 1e6, 0.01], "residual_ratio"),  # was taken for zero
    (griffith_length, [RATIO, 1e6, 1.0], "residual_ratio"),
    (energy_release_rate, [LINE, 1e6, 0.2], "lengths"),
    (energy_release_rate, [LINE, 1e6, "all"], "lengths"),
    (energy_release_rate, [LINE, np.nan, 0.01], "load"),
    (griffith_length, [LINE, 1e6, -1.0], "fracture_energy"),
    (griffith_length, [LINE, [1e6, np.inf], 1.0], "load"),
    (griffith_length, [LINE, "1 MPa", 1.0], "load"),
    (nucleation_statistics, [UNEVEN, FIELD], "load.profile ... monte_carlo"),
    (st.theory.rice_distribution, [LINE, FIELD, 3], "profiles"),
    (correlated, [{("strength", "residual"): 0.5}], "did you mean 'residual_strength'"),
    (correlated, [{PAIR: 1.5}], "must be less than or equal to 1, got 1.5"),
    (
        correlated,
        [{("strength", "critical_slip"): 0.5}],
        "correlation: unknown 'critical_slip'",
    ),
    (correlated, [{("strength", "strength"): 0.5}], "two different properties"),
    (correlated, [0.5], "must be a valid dictionary"),
    (correlated, [{PAIR: 0.5, PAIR[::-1]: 0.4}], "given twice"),
    (correlated, [THREE], "contradict each other"),
    (quantiles, [np.arange(10.0), 1.0], "probability"),
    (quantiles, [[1.0, np.nan], 0.5], "finite"),
    (density, [np.ones(50)], "equal"),
    (density, [np.arange(5.0)], "at least 16"),
    (combined_mean, [[1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0]], "inexpensive: each ... [4, 3]"),
    (combined_mean, [[1.0, 2.0]], "at least 3 are needed, got 2"),
    (random_plane, [NARROW], "does not fit on a plane of"),
    (uneven_plane, [], "weakening_rate varies"),
    (simulate, [LINE, {"a": 7.5}], "stations['a']: (7.5,) is not on the interface of 0.1 m"),
    (simulate, [LINE, {"a": (0.01, 0.01)}], "give x in m"),
    (simulate, [BREAKING_PLANE, {"a": 0.01}], "give x and y in m"),
    (simulate, [BREAKING_PLANE, {"a": (0.01, np.nan)}], "must be a finite number, got nan"),
    (simulate, [BREAKING_PLANE, {"a": (-0.01, 0.0)}], "from the first node"),
    (simulate, [LINE, {3: 0.01}], "stations ... must be ... got 3"),
    (simulate, [LINE, [0.01]], "stations: must be a valid dictionary"),
    (st.Lognormal, {"mean": 1e5, "cv": 0.1, "low": 2e5}, "mean must be above low"),
    (st.Weibull, {"mean": 1e5, "cv": -0.1}, "Weibull.cv: must be greater than 0"),
    (st.TruncatedNormal, {"mean": 1e6, "cv": 0.5, "low": 0.6e6}, "these limit the scatter"),
    (st.TruncatedNormal, {"mean": 1e6, "cv": 0.1, "high": 0.5e6}, "must lie between"),
    (field_of, {"type": "lognormal", "mean": 1.0}, "cv: missing"),
    (field_of, {"type": "wiebull", "mean": 1.0}, "mean 'weibull'"),
    (st.RandomInterface, TWO_SCALES, "at most one of weakening_rate"),
    (STRETCHED.sample, [LINE.interface], "anisotropy: ... a line has no y; got 2"),
    (fit_between, [RECORD, LINE.interface], "between: needs several records"),
    (partial(density, bounds=(0.0, None)), [np.linspace(-1, 1, 50)], "below the lower bound"),
    (partial(make_problem, solid=IN_STRESS), [(48, 48), (0.02, 0.02)], "not in plane stress"),
    (local_onset, [WIDE, np.full((48, 64), 1e6)], "swapped: the first axis of a profile is x"),
]


@pytest.mark.parametrize(("call", "arguments", "words"), CASES)
def test_arguments_are_refused(call, arguments, words):
    if isinstance(arguments, dict):
        refuses(words, lambda: call(**arguments))
    else:
        refuses(words, lambda: call(*arguments))
