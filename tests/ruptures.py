"""A line that breaks from its weakest place, and its simulation."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from setups import SOLID, make_problem

import stiction as st
from stiction.dynamics.simulate import simulate_rupture

STRESS = dataclasses.replace(SOLID, plane="stress")


def wavy_line(nodes: int = 128, rate: float = 0.2e12, **options: Any) -> tuple[Any, Any]:
    """A problem in plane stress, and a strength: first slip at 0.759 MPa, onset at 0.7885 MPa."""
    x = np.arange(nodes) / nodes
    strength = 1e6 - 2e5 * np.cos(2 * np.pi * x) + 5e4 * np.sin(10 * np.pi * x)
    return make_problem(nodes, 0.05, solid=STRESS, weakening_rate=rate, **options), strength


def simulate(problem: Any, strength: Any, save: Any = None, **method: Any) -> Any:
    """A rupture at 1e7 Pa/s, or under another load; of the fields only slip is kept."""
    options = {} if "load" in method else {"loading_rate": 1e7}
    return simulate_rupture(
        problem, strength, method=st.Rupture(**options | method), save=save or st.Save(["slip"])
    )
