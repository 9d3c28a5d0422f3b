"""Equilibrium: what a user can get wrong, and what he is told."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.equilibrium.solver import Solver


def test_unstable_before_it_is_loaded(problem):
    initial = np.zeros(256)
    initial[77] = 0.95e6
    with pytest.raises(st.InputError, match="sample 0, node 77"):
        st.onset(
            problem,
            {"strength": np.full(256, 0.9e6), "initial_stress": initial},
            method=Equilibrium(),
        )


def test_weakening_rate_negative_somewhere(problem):
    rate = np.full(256, 0.5e12)
    rate[3] = -1.0
    with pytest.raises(st.InputError, match="weakening_rate"):
        st.onset(
            problem,
            {"strength": np.full(256, 0.9e6), "weakening_rate": rate},
            method=Equilibrium(),
        )


def test_load_profile_not_positive():
    with pytest.raises(st.InputError, match="profile"):
        st.Load(profile=np.linspace(-0.1, 1.0, 256))


def test_unknown_option():
    with pytest.raises(st.InputError, match="sensitivity"):
        Equilibrium(sensitivities=True)


@pytest.mark.parametrize(
    ("loads", "message"),
    [
        ([2e5, 1e5], "rise.*entry 1 is 100000"),
        ([-1.0, 1e5], "negative"),
        ([np.nan], "finite"),
        ([], "one-dimensional"),
        ("many", "array of numbers"),
        ([1e5 + 1j], "complex"),
    ],
)
def test_loads_of_a_path(problem, loads, message):
    with pytest.raises(st.InputError, match=message):
        equilibrium_path(problem, np.full(256, 0.9e6), loads)


def test_path_of_several_samples(problem):
    with pytest.raises(st.InputError, match="one sample"):
        equilibrium_path(problem, np.full((2, 256), 0.9e6), [1e5])


def test_no_events(problem):
    path = equilibrium_path(problem, np.full(256, 0.9e6), [1e5])
    assert path.sizes["event"] == 0
    assert path.event_position.attrs["units"] == "m"


def test_variables_are_labelled(problem, make_strength):
    method = Equilibrium(sensitivity=True, slip=True)
    tau_p = make_strength(0.5).sample(problem.interface, samples=2, seed=1)
    onset = st.onset(problem, tau_p, method=method)
    assert set(onset.data_vars) == set(method.variables(problem))
    for name, variable in method.variables(problem).items():
        assert onset[name].attrs["units"] == variable.units
        assert onset[name].dims == variable.dims


@pytest.mark.parametrize("gap", [1.0, np.nan])
def test_bounds_that_do_not_close_are_not_passed_over(problem, gap):
    no = np.zeros(2, dtype=bool)
    with pytest.warns(st.AccuracyWarning, match="did not close to 1e-09 of it in 1 of 2"):
        Solver(problem)._warn(np.array([1e-6, gap]), np.full(2, 1e6), no, no)


def test_error_of_the_grid_needs_two_grids(solid):
    friction = st.LinearWeakening(weakening_rate=0.5e12)
    problem = st.Problem(solid, st.Interface(0.1, 258), friction)
    with pytest.raises(st.InputError, match="multiple of four.*got 258; take 260"):
        st.onset(problem, np.ones(258), method=Equilibrium(discretization_error=True))


def test_warning_says_the_estimated_error(solid):
    problem = st.Problem(
        solid, st.Interface(0.1, 128), st.LinearWeakening(weakening_rate=0.5e12)
    )
    rng = np.random.default_rng(0)
    with pytest.warns(st.AccuracyWarning, match="by an estimated .* of 3 samples"):
        st.onset(
            problem,
            1e6 + 3e5 * rng.random((3, 128)),
            method=Equilibrium(discretization_error=True),
        )
