"""Nodes whose strength is not above their residual strength, whatever the method."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import stiction as st

RESIDUAL = 0.95e6


@pytest.fixture
def half_weak(solid):
    """A problem and a strength that is below the residual strength at 29 % of the nodes."""
    friction = st.LinearWeakening(critical_slip=2e-6, residual_strength=RESIDUAL)
    problem = st.Problem(solid, st.Interface(length=0.1, nodes=512), friction)
    x = np.arange(512) / 512
    strength = 1e6 + 1e5 * np.cos(2 * np.pi * x) + 5e4 * np.cos(14 * np.pi * x)
    return problem, strength


def test_dynamics_agrees_with_equilibrium(half_weak):
    problem, strength = half_weak
    exact = st.onset(problem, strength, method=st.Equilibrium(), progress=False)
    rupture = st.Rupture(loading_rate=2e8, implicit=False)
    found = st.onset(problem, strength, method=rupture, progress=False)
    # Of the mean stress on the interface, not of the load, which runs ahead: 2e-5 at this rate.
    assert found.critical_stress.item() == pytest.approx(exact.critical_stress.item(), rel=1e-4)
    # What does not weaken arrives with its own first slip, not when the run begins.
    assert np.isfinite(found.median_rupture_speed.item())


def test_implicit_steps_pass_first_slip_below_the_residual_strength(half_weak):
    """The first node slips before the load provides any stress drop to measure tolerances in."""
    problem, strength = half_weak
    found = st.simulate_rupture(
        problem, strength, method=st.Rupture(loading_rate=2e9, stop="onset"), progress=False
    )
    assert found.attrs["stopped"] == "onset"


def test_nothing_but_barriers_and_constant_strength(solid):
    friction = st.LinearWeakening(critical_slip=2e-6, residual_strength=RESIDUAL)
    problem = st.Problem(solid, st.Interface(length=0.1, nodes=512), friction)
    strength = np.full(512, 0.9e6)
    strength[:50] = np.inf
    with pytest.raises(st.InputError, match="above residual_strength at one node or more"):
        st.onset(problem, strength, method=st.Rupture(loading_rate=2e8), progress=False)


@pytest.mark.parametrize("what", ["onset", "monte_carlo", "failure_probability"])
def test_said_once(solid, make_strength, what):
    friction = st.LinearWeakening(weakening_rate=0.5e12, residual_strength=0.7e6)
    problem = st.Problem(solid, st.Interface(length=0.1, nodes=512), friction)
    field, exact = make_strength(0.01 / problem.nucleation_length), {"method": st.Equilibrium()}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if what == "onset":
            st.onset(problem, field.sample(problem.interface, samples=8, seed=1), **exact)
        elif what == "monte_carlo":
            st.monte_carlo(problem, field, samples=40, seed=1, **exact)
        else:
            st.failure_probability(
                problem, field, 1e6, algorithm="plain", max_evaluations=100, **exact
            )
    assert sum("residual" in str(warning.message) for warning in caught) == 1
