"""One profile and where each method sees sliding begin."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.equilibrium.plane_patches import critical_patch
from stiction.errors import InputError
from stiction.gaps import IN_GAP, listed
from stiction.plot import maps
from stiction.plot.axes import (
    MEGA,
    MILLI,
    add_friction_scale,
    add_legend,
    named,
    need,
    on_axes,
    problem_of,
)
from stiction.plot.fields import finish_line, rows_of
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, color, marker, series
from stiction.problem import Problem

_GAP: dict[str, Any] = {"facecolor": PALE, "alpha": 0.6, "linewidth": 0.0, "zorder": 0.0}
_NAMES = {
    "local_criterion": "local criterion",
    "equilibrium": "equilibrium",
    "rupture": "elastodynamic rupture",
}


def onset(
    result: xr.Dataset | Mapping[str, xr.Dataset] | list[xr.Dataset],
    strength: Any,
    *,
    problem: Problem | None = None,
    sample: int = 0,
    ax: Axes | None = None,
) -> Axes:
    """Draw a strength profile and where sliding begins on it, by one method or several.

    Parameters
    ----------
    result : Dataset, or list or mapping of Dataset
        From `stiction.onset` with this strength; several methods are told apart by their names.
        On a plane the local criterion's critical ellipse is drawn, and with ``slip`` and
        ``sensitivity`` (options of `Equilibrium`) what slips at the onset.
    strength : array
        tau_p, Pa, of shape (nodes,) or (samples, nodes); on a plane (nx, ny) or (samples, nx, ny).
    problem : Problem, optional
        Needed only where the result does not hold it.
    sample : int
        Which one, counted from 0.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes
        Stresses in MPa over mm; beside them friction coefficients where there is a pressure.

    Raises
    ------
    InputError
        If something does not fit together.

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
    if not results:
        raise InputError("result: there is none to draw")
    for one in results.values():
        need(one, "critical_load", "critical_position")
    problem = problem_of(next(iter(results.values())), problem)
    rows = rows_of(problem.interface, strength)
    counts = {rows.shape[0], *(one.sizes["sample"] for one in results.values())}
    if len(counts) > 1 or not 0 <= sample < min(counts):
        raise InputError(
            f"sample: {sample} of results and strength with {', '.join(map(str, sorted(counts)))}"
            " samples; they must have the same number"
        )
    chosen = {name: one.isel(sample=slice(sample, sample + 1)) for name, one in results.items()}
    if problem.interface.is_plane:
        height = 2.0 + 4.0 * maps.relative_height(problem.interface)
        with on_axes(ax, height=height) as axes:
            bar = draw_plane_onset(axes, problem, rows[sample], chosen)
            axes.figure.colorbar(bar, ax=axes, label=r"strength $\tau_p$ (MPa)", **maps.BAR)
            add_legend(axes, ax)
        return axes
    with on_axes(ax, width=PAGE, height=2.8) as axes:
        draw_line_onset(axes, problem, rows[sample], chosen)
        add_legend(axes, ax)
    return axes


def draw_line_onset(
    axes: Axes, problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset]
) -> None:
    """The onset on a line, without a legend; of one sample, by the types of the methods."""
    interface = problem.interface
    x = interface.x * MILLI
    spans = listed(next(iter(results.values()))) if results else []
    measured = tau_p.copy()
    for begin, end in spans:
        measured[_between(problem, begin, end)] = np.nan
        _shade(axes, problem, begin, end)
    if spans:
        axes.plot(x, tau_p * MEGA, color=QUIET, linewidth=0.8, linestyle=(0, (2, 2)))
        axes.fill([], [], **_GAP, label="not measured, filled in")
    axes.plot(x, measured * MEGA, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
    try:
        averaged = nucleation_stress(problem, tau_p)
        axes.plot(x, averaged * MEGA, label=r"nucleation stress $\tau_n$", **series(0))
    except InputError:  # no single nucleation length: the strength alone is shown
        pass
    for number, (name, result) in enumerate(results.items()):
        place = float(result["critical_position"][0]) * MILLI
        load = float(result["critical_load"][0]) * MEGA
        axes.plot(
            place,
            load,
            linestyle="none",
            marker=marker(number),
            markersize=7.0 - number,
            markerfacecolor="none" if number else color(number + 1),
            markeredgecolor=color(number + 1),
            markeredgewidth=1.2,
            label=f"{_label(name, result)} at {place:.2f} mm{_remark(result)}",
        )
    finish_line(axes, interface, "shear stress (MPa)")
    axes.margins(y=0.08)
    add_friction_scale(axes, problem, "y")


def draw_plane_onset(
    axes: Axes,
    problem: Problem,
    field: Array,
    results: Mapping[str, xr.Dataset],
    *,
    cmap: Any = None,
) -> Any:
    """A field of a plane (Pa) as a map with the onset by each method; the image is returned.

    What slips is drawn where a result has `slip` and `sensitivity`, else the critical ellipse.
    """
    exact = next((one for one in results.values() if has_maps(one)), None)
    interface = problem.interface
    cmap = cmap or (maps.GREYS if exact is not None else "cividis")
    drawn = maps.image(axes, interface, field * MEGA, cmap=cmap)
    if exact is not None:
        inside, _ = critical_patch(exact["sensitivity"].values[0], interface.spacings)
        maps.outline(axes, interface, exact["slip"].values[0] > 0.0, color(1), 0.9)
        maps.outline(axes, interface, inside, ACCENT, 1.6)
        axes.plot([], [], color=color(1), linewidth=0.9, label="slips at the first instability")
        axes.plot([], [], color=ACCENT, linewidth=1.6, label="critical patch")
    for number, (name, result) in enumerate(results.items()):
        x, y = result["critical_position"].values[0] * MILLI
        axes.plot(
            x, y, linestyle="none", marker=marker(number), markersize=6.0 - number,
            markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.1,
            label=f"{_label(name, result)} at ({x:.2f}, {y:.2f}) mm",
        )  # fmt: skip
        if exact is None and "critical_aspect" in result:
            _ellipse(axes, problem, x, y, result["critical_patch_extent"].values[0] * MILLI)
    maps.keep_edges(axes, interface)
    maps.label(axes)
    return drawn


def has_maps(result: xr.Dataset) -> bool:
    """Whether it says what slips at the onset."""
    return {"slip", "sensitivity"} <= set(result)


def _label(name: str, result: xr.Dataset) -> str:
    text = f"{_NAMES.get(name, name)}: {float(result['critical_load'][0]) * MEGA:.4f} MPa"
    if "friction_coefficient" in result:
        text += f" (coefficient {float(result['friction_coefficient'][0]):.4f})"
    return text


def _ellipse(axes: Axes, problem: Problem, x: float, y: float, extent: Array) -> None:
    lengths = [length * MILLI for length in problem.interface.lengths]
    for i, j in itertools.product((-1, 0, 1), repeat=2):  # it may lie across the edges
        place = (x + i * lengths[0], y + j * lengths[1])
        axes.add_patch(Ellipse(place, *extent, fill=False, edgecolor="white", linewidth=0.9))


def _between(problem: Problem, begin: float, end: float) -> Any:
    """The nodes of a gap, which may lie across x = 0."""
    x, half = problem.interface.x, 0.5 * problem.interface.spacing
    after, before = x > begin - half, x < end + half
    return after & before if begin <= end else after | before


def _shade(axes: Axes, problem: Problem, begin: float, end: float) -> None:
    # From the last measured node to the next one.
    length, spacing = problem.interface.extent * MILLI, problem.interface.spacing * MILLI
    left, right = begin * MILLI - spacing, end * MILLI + spacing
    pieces = [(left, right)] if begin <= end else [(left, length), (0.0, right)]
    for piece in pieces:
        axes.axvspan(*piece, **_GAP)


def _remark(result: xr.Dataset) -> str:
    return " (in a gap)" if IN_GAP in result and bool(result[IN_GAP][0]) else ""
