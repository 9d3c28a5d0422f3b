"""A slider on a base for tests."""

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

import stiction as st

SOLID = st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress")
SLIDER = st.Slider(
    height=0.075, thickness=0.006, base=st.Base(height=0.03, behind=0.06, ahead=0.10),
    drive=st.Pusher(height=0.02, width=0.01),
)  # fmt: skip


def rig_problem(nodes: int = 64, *, problem: Any = None, **of_slider: Any) -> st.Problem:
    """A slider of acrylic. Arguments replace parts of the slider, `problem` parts of the rest."""
    parts = {
        "solid": SOLID,
        "interface": st.Interface(length=0.14, nodes=nodes),
        "friction": st.LinearWeakening(weakening_rate=1e11, residual_ratio=0.6),
        "load": st.Load(pressing_force=4e3),
        "specimen": dataclasses.replace(SLIDER, **of_slider),
    }
    return st.Problem(**(parts | (problem or {})))


def coefficients(
    problem: st.Problem, mean: float = 0.7, *, amplitude: float = 0.1
) -> xr.DataArray:
    """A profile of friction coefficients with two waves."""
    x = problem.interface.x
    values = mean + amplitude * np.sin(4.0 * np.pi * x / problem.interface.measure)
    return xr.DataArray(values, {"x": x}, "x", attrs={"units": "1"})
