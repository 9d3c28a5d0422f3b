"""Given or new axes, units of their scales, and the problem of a result."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import pydantic
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.base.errors import InputError
from stiction.base.model import check, describe
from stiction.base.units import unit_for
from stiction.base.variables import DIRECTION, FRICTION_COEFFICIENT
from stiction.plot.style import COLUMN, paper_style
from stiction.problem.problem import Problem

if TYPE_CHECKING:

    class FigureAxes(Axes):
        """Axes on a whole figure, which can be saved, rather than on a part of a figure."""

        figure: Figure  # type: ignore[assignment,unused-ignore]
else:
    FigureAxes: TypeAlias = Axes


def with_unit(name: str, unit: str) -> str:
    """Return the label of a scale."""
    return f"{name} ({unit})" if unit else name


def new_figure(width: float, height: float) -> Figure:
    """Return a figure, with sizes in inches, that notebooks and galleries show.

    The figure is made outside `paper_style`, because a backend that is
    loaded here also sets parameters.
    """
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(width, height), layout="constrained")
    figure.set_facecolor("white")
    return figure


@contextmanager
def on_axes(
    ax: Axes | None, width: float = 1.35 * COLUMN, height: float = 2.8
) -> Iterator[Any]:
    """Yield the caller's axes unchanged, or new axes in the style of a printed page."""
    if ax is not None:
        if not isinstance(ax, Axes):
            raise InputError(
                f"ax: must be a matplotlib Axes, such as axes[0], got {type(ax).__name__}"
            )
        yield ax
        return
    figure = new_figure(width, height)
    with paper_style():
        yield figure.subplots()


def problem_of(result: Any, problem: Problem | None = None) -> Problem:
    """Return the given problem, or the problem in the attributes of a result."""
    if problem is not None:
        sizes = check("problem", problem, Problem).interface.shape
        shape = tuple(result.sizes[dim] for dim in ("x", "y") if dim in result.sizes)
        if shape not in ((), sizes):
            raise InputError(f"problem: has {sizes} nodes, but the result has {shape}")
        return problem
    try:
        plain = json.loads(result.attrs["study"])["problem"]
        return pydantic.TypeAdapter(Problem).validate_python(plain)
    except (KeyError, TypeError, ValueError, InputError):
        raise InputError(
            "problem: is incomplete in the result, because a part exists only in Python or was"
            " swept. Pass problem="
        ) from None


def need(result: Any, *names: str, hint: str = "") -> None:
    """Refuse a result without these variables. The message ends with the hint."""
    check("result", result, xr.Dataset)
    missing = [name for name in names if name not in result]
    if missing:
        raise InputError(
            f"result: has no {', '.join(map(str, missing))}. It holds"
            f" {', '.join(map(str, result.data_vars))}{hint}"
        )


def named(results: Any) -> dict[str, xr.Dataset]:
    """Return results by name. If no names are given, use the names of the methods."""
    if isinstance(results, xr.Dataset):
        results = [results]
    if isinstance(results, str) or not isinstance(results, Sequence | Mapping):
        raise InputError(f"result: must be a Dataset, or several, got {describe(results)}")
    for result in results.values() if isinstance(results, Mapping) else results:
        check("result", result, xr.Dataset)
    if not isinstance(results, Mapping):
        by_name: dict[str, Any] = {}
        for number, result in enumerate(results):
            name = f"result {number}"
            with suppress(AttributeError, KeyError, TypeError, ValueError):
                name = json.loads(result.attrs["study"])["method"]["type"].replace("_", " ")
            by_name[f"{name}, result {number}" if name in by_name else name] = result
        results = by_name
    if not results:
        raise InputError("result: is empty. Give one or more results")
    return dict(results)


def shown_quantity(result: xr.Dataset, quantity: str | None = None) -> str:
    """Return the variable of an onset to draw: force, or else coefficient, or else stress.

    On a plane the area is always known, but forces are drawn only on
    request.
    """
    if quantity is None:
        names = ["critical_force"] * (DIRECTION not in result.dims) + ["friction_coefficient"]
        known = [name for name in names if name in result and np.isfinite(result[name]).any()]
        quantity = (*known, "critical_stress")[0]
    need(result, quantity)
    return quantity


def scaled(variable: xr.DataArray, *others: xr.DataArray) -> tuple[float, str, str]:
    """Return the factor, unit and label, such as 'critical stress (MPa)', for like variables."""
    values = np.concatenate([part.values.ravel() for part in (variable, *others)])
    factor, unit = unit_for(str(variable.attrs.get("units", "1")), values)
    name = str(variable.name).replace("_", " ")
    if variable.name == "friction_coefficient":
        name = FRICTION_COEFFICIENT.long_name
    return factor, unit, with_unit(name, unit)


def add_friction_scale(axes: Axes, problem: Problem, which: str, factor: float) -> None:
    """If there is a pressure, add a scale of stress over mean normal pressure on the other side.

    `which` is the scale of stresses, "x" or "y", and `factor` the
    factor of its unit.
    """
    if problem.given_pressure is None:
        return
    pressure = float(np.mean(problem.given_pressure)) * factor
    add_scale(axes, which, 1.0 / pressure, r"$\tau / \langle p \rangle$")


def add_scale(axes: Axes, which: str, ratio: float, label: str) -> None:
    """Add a scale on the other side that shows the values times a ratio."""
    convert = (lambda value: value * ratio, lambda value: value / ratio)
    if which == "y":
        axes.secondary_yaxis("right", functions=convert).set_ylabel(label)
    else:
        axes.secondary_xaxis("top", functions=convert).set_xlabel(label)
