"""A line that breaks from its weakest place, its simulation, and runs by single steps."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from setups import QUARTER, SOLID, make_problem, turns

import stiction as st
from stiction.methods.dynamics.method import make_run
from stiction.methods.dynamics.simulate import simulate_rupture
from stiction.methods.dynamics.summary import energy_balance

STRESS = dataclasses.replace(SOLID, plane="stress")


def wavy_line(
    nodes: int = 128, weakening_rate: float = 0.2e12, **options: Any
) -> tuple[Any, Any]:
    """A problem in plane stress, and a strength: first slip at 0.759 MPa, onset at 0.7885 MPa."""
    x = np.arange(nodes) / nodes
    strength = 1e6 - 2e5 * np.cos(2 * np.pi * x) + 5e4 * np.sin(10 * np.pi * x)
    return make_problem(
        nodes, 0.05, solid=STRESS, weakening_rate=weakening_rate, **options
    ), strength


def simulate(problem: Any, strength: Any, save: Any = None, **method: Any) -> Any:
    """A rupture at 1e7 Pa/s, or under another load; of the fields only slip is kept."""
    options = {} if "load_history" in method else {"loading_rate": 1e7}
    return simulate_rupture(
        problem, strength, method=st.Rupture(**options | method), save=save or st.Save(["slip"])
    )


def run_of(problem: Any, strength: Any, method: Any, **options: Any) -> Any:
    """A run of one sample that has not begun."""
    rows = problem.sample(strength, **options)
    return make_run(method, method.medium(problem), rows, 0)


def with_step(method: Any, problem: Any, step: float) -> Any:
    """The method with an explicit step, s."""
    return dataclasses.replace(method, courant=step / method.medium(problem).largest_step)


def stepped(
    problem: Any, strength: Any, load: float, end: float, steps: int, slip: Any = None
) -> Any:
    """A run of so many explicit steps at a constant load from t = 0 to `end`, and its state."""
    method = st.Rupture(
        load_history=([0.0, 1.0], [load, load]), stop="time", end_time=1.0, implicit=False
    )
    method = with_step(method, problem, end / steps)
    run = run_of(problem, strength, method, accept=("overstress",))
    state = run.start(0.0, slip)
    run.take_steps(state, steps)
    return run, state


def radiated_energy(run: Any, state: Any) -> float:
    """Energy that has gone off as waves, J/m or J."""
    return energy_balance(run, state)["radiated_energy"]


def dip(interface: st.Interface, centre: Any, radius: float) -> Any:
    """A smooth bump of height one around a place, on a line or a plane."""
    places = np.meshgrid(*interface.coordinates.values(), indexing="ij")
    centre = np.atleast_1d(centre)
    return np.exp(-sum(((x - c) / radius) ** 2 for x, c in zip(places, centre, strict=True)))


BREAKING_PLANE = make_problem(
    (40, 36), (0.04, 0.03), solid=QUARTER, weakening_rate=3e11, residual_strength=2e5
)

_ANGLE = turns(128)
_UNEVEN = st.Load(
    profile=1.2 + 0.2 * np.cos(_ANGLE), initial_stress=5e4 + 3e4 * np.sin(2 * _ANGLE)
)
CROOKED = make_problem(
    128, 0.05, solid=STRESS, weakening_rate=0.2e12 + 2e10 * np.sin(_ANGLE),
    residual_strength=3e5 + 5e4 * np.cos(_ANGLE), load=_UNEVEN,
)  # fmt: skip
CROOKED_STRENGTH = 1.3e6 - 2e5 * np.cos(_ANGLE) + 5e4 * np.sin(5 * _ANGLE)
"""A line on which everything varies, under a load of a mean other than one."""
