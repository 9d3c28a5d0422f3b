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
    """Return the label of a scale.

    >>> with_unit("slip", "mm"), with_unit("coefficient", "")
    ('slip (mm)', 'coefficient')
    """
    return f"{name} ({unit})" if unit else name


def new_figure(width: float, height: float) -> Figure:
    """Return a figure, with sizes in inches, that notebooks and galleries show.

    The figure is made outside `paper_style`, because a backend that is
    loaded here also sets parameters.

    >>> figure = new_figure(3.0, 2.0)
    >>> figure.get_size_inches().tolist(), figure.get_facecolor()
    ([3.0, 2.0], (1.0, 1.0, 1.0, 1.0))
    """
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(width, height), layout="constrained")
    figure.set_facecolor("white")
    return figure


@contextmanager
def on_axes(
    ax: Axes | None, width: float = 1.35 * COLUMN, height: float = 2.8
) -> Iterator[Any]:
    """Yield the caller's axes unchanged, or new axes in the style of a printed page.

    >>> with on_axes(None, width=4.0, height=2.0) as axes:
    ...     axes.figure.get_size_inches().tolist()
    [4.0, 2.0]
    >>> with on_axes(axes) as same:
    ...     same is axes
    True
    >>> with on_axes("axes") as axes:
    ...     pass
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ax: must be a matplotlib Axes, such as axes[0], got str
    """
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
    """Return the given problem, or the problem in the attributes of a result.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> result = xr.Dataset({"slip": ("x", np.zeros(256))}, attrs={"study": "{}"})
    >>> problem_of(result, problem) is problem, problem_of(xr.Dataset(), problem) is problem
    (True, True)
    >>> problem_of(result.isel(x=slice(8)), problem)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: problem: has (256,) nodes, but the result has (8,)
    >>> problem_of(result)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: problem: is incomplete in the result, because a part exists ...
    """
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
    """Refuse a result without these variables. The message ends with the hint.

    >>> result = xr.Dataset({"slip": 1.0, "load": 2.0})
    >>> need(result, "slip", "load")
    >>> need(result, "slip", "stress", "time", hint=". Keep them")
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: result: has no stress, time. It holds slip, load. Keep them
    """
    check("result", result, xr.Dataset)
    missing = [name for name in names if name not in result]
    if missing:
        raise InputError(
            f"result: has no {', '.join(map(str, missing))}. It holds"
            f" {', '.join(map(str, result.data_vars))}{hint}"
        )


def named(results: Any) -> dict[str, xr.Dataset]:
    """Return results by name. If no names are given, use the names of the methods.

    >>> first, second = (xr.Dataset(attrs={"study": json.dumps({"method": {"type": name}})})
    ...                  for name in ("local_criterion", "equilibrium"))
    >>> list(named([first, second, first, xr.Dataset()]))
    ['local criterion', 'equilibrium', 'local criterion, result 2', 'result 3']
    >>> named(second)["equilibrium"] is second, named({"a": first})["a"] is first
    (True, True)
    >>> for given in ("result", 3, [], {}, [3]):
    ...     try:
    ...         named(given)
    ...     except InputError as error:
    ...         print(str(error)[:17])
    result: must be a
    result: must be a
    result: is empty.
    result: is empty.
    result: must be a
    """
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

    >>> result = xr.Dataset({"critical_stress": ("sample", [1.0, 2.0])})
    >>> shown_quantity(result)
    'critical_stress'
    >>> result["friction_coefficient"] = "sample", [0.1, np.nan]
    >>> result["critical_force"] = "sample", [np.nan, np.nan]
    >>> shown_quantity(result), shown_quantity(result, "critical_force")
    ('friction_coefficient', 'critical_force')
    >>> result["critical_force"] = "sample", [np.nan, 3.0]
    >>> shown_quantity(result), shown_quantity(result.expand_dims(DIRECTION))
    ('critical_force', 'friction_coefficient')
    >>> shown_quantity(result, "slip")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: result: has no slip. It holds critical_stress, ...
    """
    if quantity is None:
        names = ["critical_force"] * (DIRECTION not in result.dims) + ["friction_coefficient"]
        known = [name for name in names if name in result and np.isfinite(result[name]).any()]
        quantity = (*known, "critical_stress")[0]
    need(result, quantity)
    return quantity


def scaled(variable: xr.DataArray, *others: xr.DataArray) -> tuple[float, str, str]:
    """Return the factor, unit and label, such as 'critical stress (MPa)', for like variables.

    >>> small = xr.DataArray([0.2, 0.3], name="critical_stress", attrs={"units": "Pa"})
    >>> large = 1e6 * small.assign_attrs(units="Pa")
    >>> factor, unit, label = scaled(small, large)
    >>> round(factor * 1e6, 9), unit, label
    (1.0, 'MPa', 'critical stress (MPa)')
    >>> scaled(xr.DataArray([0.3], name="friction_coefficient"))[2]
    'static friction coefficient'
    """
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

    Stresses in MPa, and a mean pressure of 2 MPa:

    >>> from types import SimpleNamespace
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> add_friction_scale(axes, SimpleNamespace(given_pressure=np.array([1e6, 3e6])), "y", 1e-6)
    >>> _ = axes.set_ylim(0.0, 3.0)
    >>> axes.figure.canvas.draw()
    >>> [round(float(end), 9) for end in axes.child_axes[0].get_ylim()]
    [0.0, 1.5]
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> add_friction_scale(axes, SimpleNamespace(given_pressure=None), "y", 1e-6)
    >>> axes.child_axes
    []
    """
    if problem.given_pressure is None:
        return
    pressure = float(np.mean(problem.given_pressure)) * factor
    add_scale(axes, which, 1.0 / pressure, r"$\tau / \langle p \rangle$")


def add_scale(axes: Axes, which: str, ratio: float, label: str) -> None:
    """Add a scale on the other side that shows the values times a ratio.

    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> add_scale(axes, "x", 0.5, "half")
    >>> add_scale(axes, "y", 4.0, "fourfold")
    >>> _ = axes.set(xlim=(0.0, 3.0), ylim=(1.0, 2.0))
    >>> axes.figure.canvas.draw()
    >>> top, right = axes.child_axes
    >>> top.get_xlabel(), tuple(map(float, top.get_xlim()))
    ('half', (0.0, 1.5))
    >>> right.get_ylabel(), tuple(map(float, right.get_ylim()))
    ('fourfold', (4.0, 8.0))
    """
    convert = (lambda value: value * ratio, lambda value: value / ratio)
    if which == "y":
        axes.secondary_yaxis("right", functions=convert).set_ylabel(label)
    else:
        axes.secondary_xaxis("top", functions=convert).set_xlabel(label)
