"""Factors between specimens of properties that are not random, and of the pressing force."""

import dataclasses

import numpy as np
import pytest
from joint import FIELD, GIVEN, PROBLEM
from setups import EXACT, LOCAL, ensemble

import stiction as st

FACTOR = st.Lognormal(mean=1.0, cv=0.1)
PRESSED = dataclasses.replace(PROBLEM, load=st.Load(pressing_force=5e6 * PROBLEM.area))
STRENGTH = dataclasses.replace(FIELD, marginal=st.Gamma(mean=1e6, cv=0.15), of=None)
SLIP = dataclasses.replace(PROBLEM, friction=st.LinearWeakening(critical_slip=4e-6))


@pytest.mark.parametrize(
    ("problem", "name", "strength", "method"),
    [
        (PROBLEM, "normal_pressure", FIELD, LOCAL),
        (PRESSED, "pressing_force", FIELD, EXACT),
        (SLIP, "critical_slip", STRENGTH, EXACT),
        (PROBLEM, "residual_strength", STRENGTH, EXACT),
    ],
)
def test_a_factor_multiplies_a_constant_of_the_problem(problem, name, strength, method):
    """Sample by sample the onset is that of a problem with the constant times the factor."""
    random = st.RandomInterface(strength=strength, between={name: FACTOR})
    interface = problem.interface
    found = ensemble(problem, random, 12, method=method, seed=3)
    factors = next(
        v for k, v in random.profiles(interface, samples=12, seed=3).items() if k[0] == "b"
    )
    profiles = strength.sample(interface, samples=12, seed=3)
    table, key = {
        "normal_pressure": ("load", "normal_pressure"),
        "pressing_force": ("load", "pressing_force"),
        "critical_slip": ("friction", "critical_slip"),
        "residual_strength": ("friction", "residual_ratio"),
    }[name]
    part = getattr(problem, table)
    for number in range(12):
        value = getattr(part, key) * factors[number, 0]
        changed = dataclasses.replace(
            problem, **{table: dataclasses.replace(part, **{key: value})}
        )
        of = {"friction_coefficient": profiles[number]} if strength.of else profiles[number]
        exact = st.onset(changed, of, method=method)
        assert float(found.critical_stress[number]) == pytest.approx(
            float(exact.critical_stress[0]), rel=1e-9
        )
    assert np.std(factors[:, 0]) > 0.03


def test_a_design_has_the_scatter_of_the_pressing_force():
    """With coefficients it is one more factor of the strength; both are counted."""
    random = st.RandomInterface(
        strength=FIELD, between={"strength": FACTOR, "pressing_force": FACTOR}
    )
    both = st.RandomInterface(
        strength=FIELD, between={"strength": st.Lognormal(mean=1.0, cv=np.sqrt(1.01**2 - 1.0))}
    )
    designs = [
        st.design_stress(PRESSED, given, probability=1e-2, **GIVEN) for given in (random, both)
    ]
    assert "specimens of each sample" in designs[0].reason
    lows, highs = zip(*(design.interval for design in designs), strict=True)
    assert max(lows) < min(highs) < 1.03 * max(lows)  # the intervals overlap
    found = st.failure_probability(PRESSED, random, friction_coefficient=0.14, **GIVEN)
    alone = st.RandomInterface(strength=FIELD, between={"strength": FACTOR})
    exact = st.failure_probability(PRESSED, alone, friction_coefficient=0.14, **GIVEN)
    error = 3.0 * np.hypot(found.cv, exact.cv)
    assert np.log(found.probability / exact.probability) == pytest.approx(0.0, abs=error)


def test_members_may_have_different_factors():
    likely = [
        st.RandomInterface(strength=FIELD),
        st.RandomInterface(strength=FIELD, between={"normal_pressure": FACTOR}),
    ]
    found = ensemble(PROBLEM, likely, 40, seed=3)
    alone = ensemble(PROBLEM, FIELD, 40, seed=3)
    ratios = (found.critical_stress / alone.critical_stress).values
    assert 5 < np.sum(ratios == 1.0) < 35
