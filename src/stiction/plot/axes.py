"""Axes of the caller's or new ones, units of their scales, and the problem behind a result."""

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

_MULTIPLES: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1e-3, "km"), (1.0, "m"), (1e3, "mm"), (1e6, "µm"), (1e9, "nm")),
    "s": ((1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns")),
    "Pa": ((1e-6, "MPa"), (1e-3, "kPa"), (1.0, "Pa")),
}
_LEAST = {"m": 1.0, "s": 1.0, "Pa": 0.1}
"""Largest value on a scale from which on a unit is used, in that unit."""


def unit_for(units: str, values: Any) -> tuple[float, str]:
    """Return the factor and name of the unit that suits the size of SI values."""
    if units not in _MULTIPLES:
        return 1.0, "" if units == "1" else units
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.max(np.abs(array[np.isfinite(array)]), initial=0.0))
    suited = (
        step for step in _MULTIPLES[units] if largest * step[0] >= _LEAST[units] * (1.0 - 1e-9)
    )
    last = _MULTIPLES[units][0 if largest == 0.0 else -1]
    return next(suited, last)


def with_unit(name: str, unit: str) -> str:
    """Return the label of a scale."""
    return f"{name} ({unit})" if unit else name


@contextmanager
def on_axes(
    ax: Axes | None, width: float = 1.35 * COLUMN, height: float = 2.8
) -> Iterator[Axes]:
    """Yield the caller's axes as they are, or new ones in the style of a printed page."""
    if ax is not None:
        if not isinstance(ax, Axes):
            raise InputError(
                f"ax: must be matplotlib axes, got {type(ax).__name__}; of several, choose one"
            )
        yield ax
        return
    import matplotlib.pyplot as plt  # notebooks and galleries show the figures that it manages

    # Made outside the style: a notebook's backend, loaded by its first figure, sets parameters too.
    figure = plt.figure(figsize=(width, height), layout="constrained")
    with paper_style():
        yield figure.subplots()


def add_legend(axes: Axes, given: Axes | None) -> None:
    """Add a legend: below new axes, inside those of the caller, whose layout stays."""
    if given is None:
        axes.figure.legend(loc="outside lower center", ncols=2)
    else:
        axes.legend(fontsize="small")


def problem_of(result: Any, problem: Problem | None = None) -> Problem:
    """Return the given problem, or the one in the attributes of a result.

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
            "problem: the result does not hold all of it (a part exists in Python only, or was"
            " swept); give problem=..."
        ) from None
    return found


def need(result: Any, *names: str, hint: str = "") -> None:
    """Refuse a result without these variables.

    Raises
    ------
    InputError
        Naming what is missing, what there is, and the hint.
    """
    if not isinstance(result, xr.Dataset):
        raise InputError(f"result: must be an xarray.Dataset, got {type(result).__name__}")
    missing = [name for name in names if name not in result]
    if missing:
        raise InputError(
            f"result: has no {', '.join(missing)}; it holds"
            f" {', '.join(map(str, result.data_vars))}{hint}"
        )


def named(results: Any) -> dict[str, xr.Dataset]:
    """Return one or several results by name: that of the method where none is given."""
    if isinstance(results, xr.Dataset):
        results = [results]
    if not isinstance(results, Mapping):
        results = {_method_of(one, number): one for number, one in enumerate(results)}
    if not results:
        raise InputError("result: is empty; give one result or several")
    return dict(results)


def _method_of(result: Any, number: int) -> str:
    try:
        return str(json.loads(result.attrs["study"])["method"]["type"])
    except (AttributeError, KeyError, TypeError, ValueError):
        return f"result {number}"


def shown_quantity(result: xr.Dataset, quantity: str | None = None) -> str:
    """Return what of an onset is drawn: the coefficient if there is a pressure, else the stress.

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
    """Return factor, unit and label, such as 'critical stress (MPa)', of a variable."""
    factor, unit = unit_for(str(variable.attrs.get("units", "1")), variable.values)
    name = str(variable.name).replace("_", " ")
    if variable.name == "friction_coefficient":
        name = FRICTION_COEFFICIENT.long_name
    return factor, unit, with_unit(name, unit)


def add_friction_scale(axes: Axes, problem: Problem, which: str, factor: float) -> None:
    """Add a second scale on the other side: the stress over the mean normal pressure.

    Parameters
    ----------
    axes : Axes
    problem : Problem
        Without a normal pressure nothing is added.
    which : {"x", "y"}
        The scale of stresses.
    factor : float
        Of its unit.
    """
    if problem.load.normal_pressure is None:
        return
    pressure = float(np.mean(problem.load.normal_pressure)) * factor
    convert = (lambda stress: stress / pressure, lambda ratio: ratio * pressure)
    label = r"$\tau / \langle p \rangle$"
    if which == "y":
        axes.secondary_yaxis("right", functions=convert).set_ylabel(label)
    else:
        axes.secondary_xaxis("top", functions=convert).set_xlabel(label)
