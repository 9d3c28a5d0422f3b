"""Equilibrium: what a user can get wrong, and what he is told."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from refusals import refuses

import stiction as st
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.equilibrium.solver import Solver

HELD = np.full(256, 0.9e6)
INITIAL = 0.95e6 * (np.arange(256) == 77)
RATE = np.where(np.arange(256) == 3, -1.0, 0.5e12)
PROFILES = {
    "sample 0, node 77": {"strength": HELD, "initial_stress": INITIAL},
    "weakening_rate": {"strength": HELD, "weakening_rate": RATE},
}
LOADS = {
    "rise ... entry 1 is 100000": [2e5, 1e5],
    "negative": [-1.0, 1e5],
    "finite": [np.nan],
    "one-dimensional": [],
    "array of numbers": "many",
    "complex": [1e5 + 1j],
}


@pytest.mark.parametrize("words", PROFILES)
def test_profiles_that_are_refused(problem, words):
    refuses(words, lambda: st.onset(problem, PROFILES[words], method=Equilibrium()))


@pytest.mark.parametrize("words", LOADS)
def test_loads_of_a_path_that_are_refused(problem, words):
    refuses(words, lambda: equilibrium_path(problem, HELD, LOADS[words]))


@pytest.mark.parametrize("gap", [1.0, np.nan])
def test_bounds_that_do_not_close_are_not_passed_over(problem, gap):
    no = np.zeros(2, dtype=bool)
    with pytest.warns(st.AccuracyWarning, match="did not close to 1e-09 of it in 1 of 2"):
        Solver(problem)._warn(np.array([1e-6, gap]), np.full(2, 1e6), no, no)


def test_error_of_the_grid_needs_two_grids(problem):
    problem = dataclasses.replace(problem, interface=st.Interface(0.1, 258))
    method = Equilibrium(discretization_error=True)
    words = "multiple of four ... got 258; take 260"
    refuses(words, lambda: st.onset(problem, np.ones(258), method=method))


def test_warning_says_the_estimated_error(problem):
    problem = dataclasses.replace(problem, interface=st.Interface(0.1, 128))
    strength = 1e6 + 3e5 * np.random.default_rng(0).random((3, 128))
    with pytest.warns(st.AccuracyWarning, match="by an estimated .* of 3 samples"):
        st.onset(problem, strength, method=Equilibrium(discretization_error=True))
