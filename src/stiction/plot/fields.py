"""Figures of profiles along a line and maps on a plane, with onsets."""

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed
from stiction.base.model import check, is_whole
from stiction.base.units import unit_for
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.methods.criterion.local import nucleation_stress
from stiction.plot.axes import (
    FigureAxes,
    add_friction_scale,
    named,
    need,
    on_axes,
    problem_of,
    with_unit,
)
from stiction.plot.style import INK, MARKERS, PAGE, QUIET, color, series
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.profiles import at_nodes
from stiction.problem.reading.labels import is_coefficient
from stiction.random.fields import RandomField

MOST_LINES = 6


def field(
    where: Problem | Interface,
    profile: Any,
    *,
    quantity: str | None = None,
    ax: Axes | None = None,
) -> FigureAxes:
    """Draw a profile or a partly measured field, along x or as a map of a plane.

    Parameters
    ----------
    where : Problem or Interface
    profile : array or RandomField
        On a line, an array with shape (nodes,) or (samples,
        nodes). The first six samples are drawn. On a plane,
        an array with shape (nx, ny) or (samples, nx, ny). The
        first sample is drawn. Units and coordinates are read
        as in `stiction.onset`. A field is drawn as its median
        with the measured values (`RandomField.given`), and on
        a line also with its central 90 % band.
    quantity : str, optional
        Name of the property, as `RandomInterface` uses
        it, or 'friction_coefficient'. The default is
        'friction_coefficient' for a field of coefficients
        or a DataArray in the unit 1, else 'strength'.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the profile does not fit the interface, or the quantity is
        unknown.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> st.plot.field(problem, tau_p).get_ylabel()
    'strength (MPa)'
    """
    check("where", where, Problem | Interface)
    interface = where.interface if isinstance(where, Problem) else where
    of_field = isinstance(profile, RandomField)
    if quantity is None:
        pure = profile.quantity if of_field else is_coefficient(profile)
        quantity = "friction_coefficient" if pure else "strength"
    if quantity not in (known := (*PROFILES, "friction_coefficient")):
        raise InputError(f"quantity: must be in {', '.join(known)}, got {quantity!r}")
    si = QUANTITIES[quantity].units
    given = profile.quantile(interface, 0.5) if of_field else profile
    rows = rows_of(interface, given, quantity)
    factor, unit = unit_for(si, rows)
    text = with_unit(quantity.replace("_", " "), unit)
    scale, _ = unit_for("m", interface.lengths)
    conditions = profile.conditions if of_field else None
    if interface.is_plane:
        with on_axes(ax, height=map_height(interface)) as axes:
            draw_map(axes, interface, rows[0] * factor, text, cmap="cividis")
            if conditions is not None:
                axes.plot(*(scale * conditions.places), ".", color="w", markersize=2.0)
        return axes
    x = interface.x * scale
    with on_axes(ax, width=PAGE, height=2.4) as axes:
        for number, row in enumerate(rows[:MOST_LINES]):
            style = {"color": INK} if rows.shape[0] == 1 else series(number)
            axes.plot(x, row * factor, linewidth=0.9, label=str(number), **style)
        if of_field:
            low, high = (profile.quantile(interface, share) * factor for share in (0.05, 0.95))
            axes.fill_between(x, low, high, color=INK, alpha=0.15, linewidth=0.0, label="90 %")
        if conditions is not None:
            place, values = scale * conditions.places[0], conditions.values * factor
            axes.plot(place, values, ".", color=color(1), markersize=3.0)
        name_line(axes, interface, text)
        if isinstance(where, Problem) and si == "Pa":
            add_friction_scale(axes, where, "y", factor)
    return axes


def rows_of(interface: Interface, profile: Any, quantity: str = "strength") -> Array:
    """Return a profile as (samples, *shape) in SI, with NaN in gaps, or raise an `InputError`.

    >>> interface = Interface(0.1, 8)
    >>> rows_of(interface, np.arange(8.0)).shape, rows_of(interface, np.ones((3, 8)), "slip").shape
    ((1, 8), (3, 8))
    >>> plane = Interface((0.1, 0.2), (8, 10))
    >>> rows_of(plane, np.ones((8, 10))).shape, rows_of(plane, np.ones((2, 8, 10))).shape
    ((1, 8, 10), (2, 8, 10))
    >>> for values in (np.ones((1, 2, 8)), np.ones((0, 8))):
    ...     try:
    ...         rows_of(interface, values)
    ...     except InputError as error:
    ...         print(str(error)[:31])
    profile: must have shape (8) or
    profile: must have shape (8) or
    """
    shape = interface.shape
    with prefixed("profile"):
        values = at_nodes(quantity, profile, interface, missing=True)
    if values.shape[-len(shape) :] != shape or values.ndim > len(shape) + 1 or values.size == 0:
        wanted = ", ".join(map(str, shape))
        raise InputError(
            f"profile: must have shape ({wanted}) or (samples, {wanted}), got {values.shape}"
        )
    return values.reshape(-1, *shape)


def name_line(axes: Axes, interface: Interface, text: str) -> None:
    """Label the scales of profiles along a line.

    >>> from stiction.plot.axes import new_figure
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> name_line(axes, Interface(0.25, 8), "strength (MPa)")
    >>> axes.get_xlabel(), axes.get_ylabel(), tuple(map(float, axes.get_xlim()))
    ('position $x$ (mm)', 'strength (MPa)', (0.0, 250.0))
    """
    factor, unit = unit_for("m", interface.lengths)
    axes.set_xlim(0.0, interface.measure * factor)
    axes.set(xlabel=f"position $x$ ({unit})", ylabel=text)


def draw_map(
    axes: Axes, interface: Interface, values: NDArray[Any], text: str, **options: Any
) -> Any:
    """Draw values (nx, ny) on a plane, with their scale and the names of the directions.

    Cells of 25 mm along x and of 20 mm along y are centred at the nodes:

    >>> from stiction.plot.axes import new_figure
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> values = np.arange(80.0).reshape(8, 10)
    >>> drawn = draw_map(axes, Interface((0.2, 0.2), (8, 10)), values, "slip", cmap="cividis")
    >>> [round(float(end), 9) for end in drawn.get_extent()], drawn.origin
    ([-12.5, 187.5, -10.0, 190.0], 'lower')
    >>> float(drawn.get_array()[3, 2]), drawn.get_cmap().name  # row 3 along y
    (23.0, 'cividis')
    >>> axes.get_xlabel(), axes.get_ylabel()
    ('$x$ (mm), direction of slip', '$y$ (mm)')
    >>> axes.figure.axes[1].get_xlabel()
    'slip'
    """
    factor, unit = unit_for("m", interface.lengths)
    (x, y), (dx, dy) = interface.lengths, interface.spacings
    ends: Any = factor * np.array([-0.5 * dx, x - 0.5 * dx, -0.5 * dy, y - 0.5 * dy])
    options |= {"origin": "lower", "extent": ends, "interpolation": "nearest"}
    drawn = axes.imshow(values.T, aspect="equal", **options)
    axes.figure.colorbar(
        drawn, ax=axes, label=text, location="bottom", shrink=0.8, pad=0.02, aspect=40
    )
    axes.set(xlabel=f"$x$ ({unit}), direction of slip", ylabel=f"$y$ ({unit})")
    axes.autoscale(False)  # whatever is drawn beyond it
    return drawn


def map_height(interface: Interface, more: float = 1.0) -> float:
    """Return the height, inches, of a figure with a map and `more` for other parts.

    >>> [round(map_height(Interface((0.1, y), (8, 8))), 9) for y in (0.05, 0.001, 0.5)]
    [3.0, 1.8, 9.0]
    >>> map_height(Interface((0.1, 0.05), (8, 8)), 2.5)
    4.5
    """
    x, y = interface.lengths
    return more + 4.0 * float(np.clip(y / x, 0.2, 2.0))


def onset(
    result: xr.Dataset | Mapping[str, xr.Dataset] | list[xr.Dataset],
    strength: Any,
    *,
    problem: Problem | None = None,
    sample: int = 0,
    ax: Axes | None = None,
) -> FigureAxes:
    """Draw a strength profile and the position of its onset, by one or more methods.

    Parameters
    ----------
    result : Dataset, or list or mapping of Dataset
        From `stiction.onset` with this strength. Give several methods
        as a list, or by name.
    strength : array
        tau_p, Pa, with shape (nodes,) or (samples, nodes), or on a
        plane (nx, ny) or (samples, nx, ny). Units and coordinates are
        read as in `stiction.onset`. A DataArray of friction
        coefficients (unit 1) is multiplied by the normal pressure.
    problem : Problem, optional
        Needed only if the result does not hold it.
    sample : int
        Number of the sample, counted from 0.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        If there is a pressure, a second scale shows friction coefficients.

    Raises
    ------
    InputError
        If results, strength and problem do not fit together.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> found = st.onset(problem, tau_p, method=st.LocalCriterion())
    >>> st.plot.onset(found, tau_p).get_xlabel()
    'position $x$ (mm)'
    """
    results = named(result)
    for dataset in results.values():
        need(dataset, "critical_load", "critical_position")
    problem = problem_of(next(iter(results.values())), problem)
    rows = strength_of(problem, strength)
    row = chosen_row(rows, results, sample)
    is_plane = problem.interface.is_plane
    size = {"height": map_height(problem.interface, 2.0)} if is_plane else {"width": PAGE}
    with on_axes(ax, **size) as axes:
        tau_p, interface = rows[int(sample)], problem.interface
        factor, unit = unit_for("Pa", tau_p)
        if is_plane:
            text = rf"strength $\tau_p$ ({unit})"
            draw_map(axes, interface, tau_p * factor, text, cmap="cividis")
        else:
            x = interface.x * unit_for("m", interface.lengths)[0]
            axes.plot(x, tau_p * factor, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
            # Without a single nucleation length the strength alone is drawn.
            with suppress(InputError):
                averaged = nucleation_stress(problem, tau_p) * factor
                axes.plot(x, averaged, label=r"nucleation stress $\tau_n$", **series(0))
            name_line(axes, interface, with_unit("shear stress", unit))
            axes.margins(y=0.08)
            add_friction_scale(axes, problem, "y", factor)
        _mark(axes, interface, row, factor)
        if ax is None:  # below new axes, but inside axes of the caller, whose layout stays
            axes.figure.legend(loc="outside lower center", ncols=2)
        else:
            axes.legend(fontsize="small")
    return axes


def strength_of(problem: Problem, strength: Any) -> Array:
    """Return profiles (samples, *shape) in Pa, with coefficients multiplied by the pressure.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> from dataclasses import replace
    >>> pressed = replace(problem, load=st.Load(normal_pressure=2e6))
    >>> coefficients = xr.DataArray(np.full(256, 0.4), {"x": problem.interface.x})
    >>> coefficients.attrs["units"] = "1"
    >>> strength_of(pressed, coefficients)[0, 0].round(6).tolist()
    800000.0
    >>> strength_of(pressed, np.full(256, 0.4))[0, 0].tolist()  # numbers alone are in Pa
    0.4
    """
    if is_coefficient(strength) and problem.given_pressure is not None:
        coefficient = rows_of(problem.interface, strength, "friction_coefficient")
        return np.asarray(coefficient * problem.normal_pressure)
    return rows_of(problem.interface, strength)


def chosen_row(
    rows: Array | None, results: Mapping[str, xr.Dataset], sample: int
) -> dict[str, xr.Dataset]:
    """Return a sample of each result.

    Results must have as many samples as the profile has rows.

    >>> several = xr.Dataset({"load": ("sample", [3.0, 5.0, 7.0])})
    >>> both = {"a": several, "b": 2.0 * several}
    >>> chosen_row(np.zeros((3, 8)), both, 1)["b"]["load"].values.tolist()
    [10.0]
    >>> chosen_row(None, {"a": xr.Dataset({"load": 3.0})}, 0)["a"]["load"].values.tolist()
    [3.0]
    >>> chosen_row(np.zeros((9, 8)), {}, 8), chosen_row(None, {}, 99)
    ({}, {})
    >>> for rows, sample in ((np.zeros((2, 8)), 0), (None, 3), (None, -1), (None, 0.5)):
    ...     try:
    ...         chosen_row(rows, {"a": several}, sample)
    ...     except InputError as error:
    ...         print(error)
    results: need as many samples as strength, got [2, 3]
    sample: must be 0 to 2, got 3
    sample: must be 0 to 2, got -1
    sample: must be 0 to 2, got 0.5
    """
    by_sample = {
        name: result if "sample" in result.dims else result.expand_dims("sample")
        for name, result in results.items()
    }
    counts = {result.sizes["sample"] for result in by_sample.values()}
    counts |= set() if rows is None else {len(rows)}
    if len(counts) > 1:
        raise InputError(f"results: need as many samples as strength, got {sorted(counts)}")
    last = min(counts, default=math.inf) - 1
    if not is_whole(sample, 0) or sample > last:
        raise InputError(f"sample: must be 0 to {last}, got {sample}")
    only = slice(int(sample), int(sample) + 1)
    return {name: result.isel(sample=only) for name, result in by_sample.items()}


def _mark(
    axes: Axes, interface: Interface, results: Mapping[str, xr.Dataset], factor: float
) -> None:
    """Mark the positions of onsets. On a line, their heights are the loads times `factor`.

    Loads in Pa are drawn in MPa, and lengths in mm:

    >>> from stiction.plot.axes import new_figure
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> result = xr.Dataset(
    ...     {"critical_position": ("sample", [0.03]), "critical_load": ("sample", [7e5])})
    >>> pressed = result.assign(friction_coefficient=("sample", [0.35]))
    >>> _mark(axes, Interface(0.1, 8), {"one": result, "two": pressed}, 1e-6)
    >>> for line in axes.lines:
    ...     print(line.get_label(), line.get_xydata().round(6).tolist(), line.get_markersize())
    one: 0.7000 MPa at 30.00 mm [[30.0, 0.7]] 9.0
    two: 0.7000 MPa (coefficient 0.3500) at 30.00 mm [[30.0, 0.7]] 5.5
    >>> [line.get_marker() for line in axes.lines], axes.lines[1].get_color() == color(2)
    (['o', 's'], True)

    On a plane the place is marked:

    >>> plane = Interface((0.1, 0.2), (8, 10))
    >>> place = xr.Dataset({"critical_position": (("sample", "direction"), [[0.03, 0.05]]),
    ...                     "critical_load": ("sample", [7e5])})
    >>> _mark(axes, plane, {"three": place}, 1e-6)
    >>> axes.lines[2].get_label(), axes.lines[2].get_xydata().tolist()
    ('three: 0.7000 MPa at 30.00, 50.00 mm', [[30.0, 50.0]])
    """
    length, length_unit = unit_for("m", interface.lengths)
    for number, (name, result) in enumerate(results.items()):
        place = np.atleast_1d(result["critical_position"].values[0]) * length
        load = float(result["critical_load"][0])
        factor_of_load, unit = unit_for("Pa", load)
        text = f"{name}: {load * factor_of_load:.4f} {unit}"
        if "friction_coefficient" in result:
            text += f" (coefficient {float(result['friction_coefficient'][0]):.4f})"
        text += f" at {', '.join(f'{part:.2f}' for part in place)} {length_unit}"
        style: dict[str, Any] = {"linestyle": "none", "color": color(number + 1), "label": text}
        style["marker"] = MARKERS[number % len(MARKERS)]
        style["markersize"] = max(9.0 - 3.5 * number, 2.0)
        at = place if interface.is_plane else (*place, load * factor)
        axes.plot(*at, markeredgecolor="white", markeredgewidth=0.8, **style)
