"""Figures of the onset by each method on a profile."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiction.base.errors import InputError
from stiction.base.units import unit_for
from stiction.methods.criterion.local import nucleation_stress
from stiction.plot.axes import (
    add_friction_scale,
    named,
    need,
    on_axes,
    problem_of,
    with_unit,
)
from stiction.plot.fields import draw_map, map_height, name_line, rows_of
from stiction.plot.style import PAGE, PALE, QUIET, color, series
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.profiles.placing import IN_GAP, MEASURED
from stiction.problem.profiles.reading import is_coefficient

Array = NDArray[np.float64]


def onset(
    result: xr.Dataset | Mapping[str, xr.Dataset] | list[xr.Dataset],
    strength: Any,
    *,
    problem: Problem | None = None,
    sample: int = 0,
    ax: Axes | None = None,
) -> Axes:
    """Draw a strength profile and the position of its onset, by one or several methods.

    Parameters
    ----------
    result : Dataset, or list or mapping of Dataset
        From `stiction.onset` with this strength. Give several methods as a list, or by name.
    strength : array
        tau_p, Pa, of shape (nodes,) or (samples, nodes); on a plane (nx, ny) or (samples, nx, ny).
        A DataArray of friction coefficients (unit 1) is multiplied by the normal pressure.
    problem : Problem, optional
        Needed only if the result does not hold it.
    sample : int
        Number of the sample, counted from 0.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        With a second scale of friction coefficients if there is a pressure.

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
    for one in results.values():
        need(one, "critical_load", "critical_position")
    problem = problem_of(next(iter(results.values())), problem)
    rows = rows_of(problem.interface, strength)
    if is_coefficient(strength) and problem.given_pressure is not None:
        rows = rows * problem.normal_pressure
    counts = {rows.shape[0], *(one.sizes["sample"] for one in results.values())}
    if len(counts) > 1 or not 0 <= sample < min(counts):
        raise InputError(
            f"sample: {sample} of results and strength with {', '.join(map(str, sorted(counts)))}"
            " samples; they must have the same number"
        )
    chosen = {name: one.isel(sample=slice(sample, sample + 1)) for name, one in results.items()}
    is_plane = problem.interface.is_plane
    size = {"height": map_height(problem.interface, 2.0)} if is_plane else {"width": PAGE}
    with on_axes(ax, **size) as axes:
        (_draw_plane if is_plane else _draw_line)(axes, problem, rows[sample], chosen)
        if ax is None:  # below new axes; inside those of the caller, whose layout stays
            axes.figure.legend(loc="outside lower center", ncols=2)
        else:
            axes.legend(fontsize="small")
    return axes


def _draw_line(
    axes: Axes, problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset]
) -> None:
    interface = problem.interface
    x = interface.x * unit_for("m", interface.lengths)[0]
    factor, unit = unit_for("Pa", tau_p)
    found = next(iter(results.values()))
    axes.plot(x, tau_p * factor, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
    if MEASURED in found.coords:
        missing = ~found[MEASURED].values.reshape(-1)
        beside = np.roll(missing, 1) | np.roll(missing, -1)
        axes.fill_between(
            x, 0.0, 1.0, where=missing | beside, transform=axes.get_xaxis_transform(),
            facecolor=PALE, alpha=0.6, linewidth=0.0, zorder=0.0, label="not measured, filled in",
        )  # fmt: skip
    with suppress(InputError):  # no single nucleation length: the strength alone is drawn
        averaged = nucleation_stress(problem, tau_p)
        axes.plot(x, averaged * factor, label=r"nucleation stress $\tau_n$", **series(0))
    _mark(axes, interface, results, factor)
    name_line(axes, interface, with_unit("shear stress", unit))
    axes.margins(y=0.08)
    add_friction_scale(axes, problem, "y", factor)


def _draw_plane(
    axes: Axes, problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset]
) -> None:
    interface = problem.interface
    factor, unit = unit_for("Pa", tau_p)
    draw_map(axes, interface, tau_p * factor, rf"strength $\tau_p$ ({unit})", cmap="cividis")
    _mark(axes, interface, results, factor)


def _mark(
    axes: Axes, interface: Interface, results: Mapping[str, xr.Dataset], factor: float
) -> None:
    """Mark the positions of onsets, on a line at their loads in the unit of that factor."""
    length, length_unit = unit_for("m", interface.lengths)
    for number, (name, result) in enumerate(results.items()):
        place = np.atleast_1d(result["critical_position"].values[0]) * length
        load = float(result["critical_load"][0])
        own, unit = unit_for("Pa", load)
        text = f"{name}: {load * own:.4f} {unit}"
        if "friction_coefficient" in result:
            text += f" (coefficient {float(result['friction_coefficient'][0]):.4f})"
        text += f" at {', '.join(f'{one:.2f}' for one in place)} {length_unit}"
        text += " (in a gap)" if IN_GAP in result and bool(result[IN_GAP][0]) else ""
        style: dict[str, Any] = {"linestyle": "none", "color": color(number + 1), "label": text}
        style |= {"marker": "os^DvP"[number % 6], "markersize": max(9.0 - 3.5 * number, 2.0)}
        at = place if interface.is_plane else (*place, load * factor)
        axes.plot(*at, markeredgecolor="white", markeredgewidth=0.8, **style)
