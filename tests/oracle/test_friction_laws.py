"""Friction laws that are not linear against brute force, and each method against the other."""

import dataclasses

import numpy as np
import pytest
from oracles import relaxed
from setups import beta_strength, exact_onset, examples, make_problem

import stiction as st

LAWS = examples("polygons")
LAWS["eight pieces"] = st.PiecewiseWeakening.from_law(
    st.ExponentialWeakening(weakening_rate=0.5e12, residual_strength=0.2e6), 8
)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_equilibria_along_polygons_against_relaxation(law):
    # Six nucleation lengths of 16 nodes, of a rate of 0.5e12 Pa/m.
    problem = make_problem(96, 0.0185, friction=law)
    field = beta_strength(0.004, 0.5e6, 3e6, mean_mode=True)
    strength = field.sample(problem.interface, samples=1, seed=3)[0]
    critical = exact_onset(problem, strength).critical_load.item()
    loads = critical * np.array([0.95, 1.0 - 5e-4])
    path = st.equilibrium_path(problem, strength, loads)
    for load, ours in zip(loads, path.slip.values, strict=True):
        theirs = relaxed(problem, strength, load, rest=1e-5)
        # Relaxation stops where a step adds 1e-18 m: it is that times some thousand steps low.
        np.testing.assert_allclose(ours, theirs, atol=1e-8 * theirs.max())
    assert relaxed(problem, strength, critical * (1.0 + 5e-4), rest=1e-5) is None


@pytest.mark.slow
def test_exponential_rupture_is_the_limit_of_polygons(problem, make_strength):
    law = st.ExponentialWeakening(weakening_rate=0.5e12)
    tau_p = make_strength(1.0).sample(problem.interface, samples=2, seed=1)

    def stress(friction, method=None):
        with_law = dataclasses.replace(problem, friction=friction)
        rupture = st.Rupture(loading_rate=2e7)
        return st.onset(with_law, tau_p, method=method or rupture).critical_stress.values

    exact = stress(law)
    eight, polygon = (st.PiecewiseWeakening.from_law(law, pieces) for pieces in (8, 32))
    coarse, fine = (np.abs(stress(friction) / exact - 1.0) for friction in (eight, polygon))
    # Second order in the number of pieces: 16 times closer.
    assert (fine < coarse / 8.0).all()
    assert (fine < 3e-4).all()
    # Equilibrium along as many pieces: loading this fast raises the onset by some 1e-4.
    slow = stress(polygon, st.Equilibrium())
    np.testing.assert_allclose(slow, exact, rtol=1e-3)
    assert (slow > stress(st.LinearWeakening(weakening_rate=0.5e12)) * (1.0 + 5e-5)).any()
