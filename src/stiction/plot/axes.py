"""Where a plot goes: axes of the caller's or new ones, and what a result says of its problem."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import pydantic
import xarray as xr
from matplotlib.axes import Axes

from stiction.errors import InputError
from stiction.plot.style import COLUMN, paper_style
from stiction.problem import Problem
from stiction.results import FRICTION_COEFFICIENT

MEGA = 1e-6
MILLI = 1e3
MICRO = 1e6
_UNITS = {"Pa": (MEGA, "MPa"), "m": (MILLI, "mm")}


@contextmanager
def on_axes(ax: Axes | None, width: float = 1.35 * COLUMN, height: float = 2.8) -> Iterator[Axes]:
    """The axes to draw on: the caller's as they are, or new ones in the style of a printed page."""
    if ax is not None:
        if not isinstance(ax, Axes):
            raise InputError(
                f"ax: must be matplotlib axes, got {type(ax).__name__}; of several, choose one"
            )
        yield ax
        return
    import matplotlib.pyplot as plt  # notebooks and galleries show the figures that it knows

    # Made outside the style: a notebook's backend, loaded by its first figure, sets parameters too.
    figure = plt.figure(figsize=(width, height), layout="constrained")
    with paper_style():
        yield figure.subplots()


def add_legend(axes: Axes, given: Axes | None) -> None:
    """Below the axes in a figure of our own, where the caller's own layout is not disturbed."""
    if given is None:
        axes.figure.legend(loc="outside lower center", ncols=2)
    else:
        axes.legend(fontsize="small")


def problem_of(result: Any, problem: Problem | None = None) -> Problem:
    """The problem that a result belongs to: the one given, or the one that its attributes hold.

    Raises
    ------
    InputError
        If there is neither.
    """
    if problem is not None:
        if not isinstance(problem, Problem):
            raise InputError(f"problem: must be a Problem, got {type(problem).__name__}")
        return problem
    try:
        found: Problem = pydantic.TypeAdapter(Problem).validate_python(
            json.loads(result.attrs["study"])["problem"]
        )
    except (KeyError, TypeError, ValueError, InputError):
        raise InputError(
            "problem: the result does not hold the whole of it (something in it exists in Python"
            " only, or it was swept); give problem=..."
        ) from None
    return found


def need(result: Any, *names: str) -> None:
    """Refuse a result without these variables.

    Raises
    ------
    InputError
        That says what is missing.
    """
    if not isinstance(result, xr.Dataset):
        raise InputError(f"result: must be an xarray.Dataset, got {type(result).__name__}")
    missing = [name for name in names if name not in result]
    if missing:
        raise InputError(
            f"result: has no {', '.join(missing)}; it holds {', '.join(map(str, result.data_vars))}"
        )


def named(results: Any) -> dict[str, xr.Dataset]:
    """One result or several, by name: that of the method where none is given."""
    if isinstance(results, xr.Dataset):
        results = [results]
    if not isinstance(results, Mapping):
        results = {_method_of(one, number): one for number, one in enumerate(results)}
    return dict(results)


def _method_of(result: Any, number: int) -> str:
    try:
        return str(json.loads(result.attrs["study"])["method"]["type"])
    except (AttributeError, KeyError, TypeError, ValueError):
        return f"result {number}"


def shown_quantity(result: xr.Dataset, quantity: str | None = None) -> str:
    """What of an onset is shown: the coefficient where there is a pressure, else the stress.

    Raises
    ------
    InputError
        If the result has no variable of that name.
    """
    if quantity is not None:
        need(result, quantity)
        return quantity
    name = "friction_coefficient"
    if name in result and bool(np.isfinite(result[name]).any()):
        return name
    need(result, "critical_stress")
    return "critical_stress"


def scaled(variable: xr.DataArray) -> tuple[float, str, str]:
    """Factor, unit and label ('critical stress (MPa)') in which a variable is shown."""
    factor, unit = _UNITS.get(str(variable.attrs.get("units", "1")), (1.0, ""))
    if not unit and variable.attrs.get("units", "1") not in ("1", ""):
        unit = str(variable.attrs["units"])
    name = str(variable.name).replace("_", " ")
    if variable.name == "friction_coefficient":
        name = FRICTION_COEFFICIENT.long_name
    return factor, unit, f"{name} ({unit})" if unit else name


def add_friction_scale(axes: Axes, problem: Problem, which: str) -> None:
    """A second scale at the other side of a scale of stresses in MPa: over the mean pressure.

    Parameters
    ----------
    axes : Axes
    problem : Problem
        Without a normal pressure nothing is added.
    which : {"x", "y"}
        The scale of stresses.
    """
    if problem.load.normal_pressure is None:
        return
    pressure = float(np.mean(problem.load.normal_pressure)) * MEGA
    convert = (lambda stress: stress / pressure, lambda ratio: ratio * pressure)
    label = r"$\tau / \langle p \rangle$"
    if which == "y":
        axes.secondary_yaxis("right", functions=convert).set_ylabel(label)
    else:
        axes.secondary_xaxis("top", functions=convert).set_xlabel(label)
