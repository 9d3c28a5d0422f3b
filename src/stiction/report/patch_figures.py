"""Maps of a plane: strength with what slips at the onset, and how patches grow until then."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from stiction._typing import Array
from stiction.equilibrium.path import equilibrium_path
from stiction.equilibrium.plane_patches import critical_patch
from stiction.problem import Problem
from stiction.report.style import (
    ACCENT,
    INK,
    PAGE,
    color,
    marker,
    new_figure,
)

SHARES = (0.9, 0.96, 0.99, 1.0 - 1e-5)
"""Of the load of the first instability, at which the growth of patches is shown."""
WIDE = 1.6
"""Ratio of the lengths along x and y from which on the panels lie below each other."""
_GREYS = LinearSegmentedColormap.from_list("pale greys", ["#6e6e6e", "#fbfbfb"])
"""Light enough for outlines to be seen on it."""
_BAR: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "pad": 0.02, "aspect": 40}
_MILLI = 1e3
_MEGA = 1e-6


def has_maps(result: xr.Dataset) -> bool:
    """Whether it has what `draw_patches` draws."""
    return {"slip", "sensitivity"} <= set(result)


def draw_patches(
    problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset], names: Mapping[str, str]
) -> Figure:
    """Map of the strength with the onset by each method, and the growth of the slip patches.

    Parameters
    ----------
    problem : Problem
        On a plane.
    tau_p : (nx, ny) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each; one of them with `slip` and `sensitivity`.
    names : mapping of str
        What methods are called, by their type.
    """
    exact = next(result for result in results.values() if has_maps(result))
    x, y = problem.interface.lengths
    ratio = _relative_height(problem)
    if x > WIDE * y:
        heights = 0.9 * PAGE * ratio + 1.7, 2.0 * (0.44 * PAGE * ratio + 0.3) + 1.0
        figure = new_figure(PAGE, sum(heights))
        parts: Any = figure.subfigures(2, 1, height_ratios=heights)
    else:
        figure = new_figure(PAGE, 0.46 * PAGE * ratio + 1.7)
        parts = figure.subfigures(1, 2, width_ratios=(1.0, 0.96))
    _draw_strength(parts[0], problem, tau_p, exact, results, names)
    first = float(exact["first_instability"][0]) - float(np.mean(problem.load.initial_stress))
    loads = first / float(np.mean(problem.load_profile)) * np.array(SHARES)
    draw_growth(parts[1], problem, equilibrium_path(problem, tau_p, loads))
    return figure


def _relative_height(problem: Problem) -> float:
    x, y = problem.interface.lengths
    return float(np.clip(y / x, 0.2, 2.0))


def _draw_strength(
    figure: Any,
    problem: Problem,
    tau_p: Array,
    exact: xr.Dataset,
    results: Mapping[str, xr.Dataset],
    names: Mapping[str, str],
) -> None:
    axes = figure.subplots()
    image = _map(axes, problem, tau_p * _MEGA, cmap=_GREYS)
    figure.colorbar(image, ax=axes, label=r"strength $\tau_p$ (MPa)", **_BAR)
    slips = exact["slip"].values[0] > 0.0
    inside, _ = critical_patch(exact["sensitivity"].values[0], problem.interface.spacings)
    _outline(axes, problem, slips, color(1), 0.9)
    _outline(axes, problem, inside, ACCENT, 1.6)
    handles = [
        Line2D([], [], color=color(1), linewidth=0.9, label="slips at the first instability"),
        Line2D([], [], color=ACCENT, linewidth=1.6, label="critical patch"),
    ]
    for number, (name, result) in enumerate(results.items()):
        x, y = result["critical_position"].values[0] * _MILLI
        (point,) = axes.plot(
            x, y, linestyle="none", marker=marker(number), markersize=6.0 - number,
            markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.1,
            label=f"{names.get(name, name)}: {float(result['critical_load'][0]) * _MEGA:.4f} MPa",
        )  # fmt: skip
        handles.append(point)
    _label(axes)
    figure.legend(handles=handles, loc="outside lower center", ncols=1)


def draw_growth(figure: Figure | SubFigure, problem: Problem, path: xr.Dataset) -> None:
    """Slip at several loads, a panel each, on one scale of colours.

    Parameters
    ----------
    figure : Figure or SubFigure
        An empty one to draw on.
    problem : Problem
        On a plane.
    path : Dataset
        From `equilibrium_path`; loads at which the interface slides are left out.
    """
    slip = path["slip"].values * 1e6
    loads = path["load"].values
    balanced = np.flatnonzero(~path["sliding"].values)
    most = max(float(np.nanmax(slip[balanced])), 1e-300) if balanced.size else 1.0
    columns = 2 if balanced.size > 1 else 1
    rows = max(1, -(-balanced.size // columns))
    panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).reshape(-1)
    for axes in panels[balanced.size :]:
        axes.set_axis_off()
    image = None
    for axes, number in zip(panels, balanced, strict=False):
        # Slip grows steeply with the load: a root shows small patches beside the last ones.
        image = _map(
            axes, problem, slip[number], cmap="viridis", norm=PowerNorm(0.4, vmin=0.0, vmax=most)
        )
        moving = slip[number] > 0.0
        _outline(axes, problem, moving, "white", 0.4)
        share = 100.0 * moving.mean()
        axes.set_title(
            rf"$\tau_0$ = {loads[number] * _MEGA:.4f} MPa, {share:.2g} % slips", fontsize=7.5
        )
        _label(axes)
        axes.label_outer()
    if image is not None:
        ticks = [0.0, *(float(f"{most * share:.1g}") for share in (0.01, 0.1, 0.4, 1.0))]
        ticks = [tick for tick in ticks if tick <= most]
        figure.colorbar(
            image, ax=list(panels), label=r"slip ($\mu$m)", ticks=ticks, format="%g", **_BAR
        )


def _map(axes: Any, problem: Problem, field: Array, **options: Any) -> Any:
    """A field (nx, ny) with x to the right and y upwards; a node is the centre of its cell."""
    return axes.imshow(
        field.T, origin="lower", extent=_edges(problem), interpolation="nearest", aspect="equal",
        **options,
    )  # fmt: skip


def _edges(problem: Problem) -> tuple[float, float, float, float]:
    (x, y), (dx, dy) = problem.interface.lengths, problem.interface.spacings
    left, right, bottom, top = -0.5 * dx, x - 0.5 * dx, -0.5 * dy, y - 0.5 * dy
    return left * _MILLI, right * _MILLI, bottom * _MILLI, top * _MILLI


def _outline(axes: Any, problem: Problem, mask: NDArray[np.bool_], ink: str, width: float) -> None:
    """The border of a set of nodes, closed across the borders of the map."""
    if not mask.any() or mask.all():
        return
    padded = np.pad(mask.astype(float), 1, mode="wrap")
    (dx, dy), (nx, ny) = problem.interface.spacings, mask.shape
    x, y = np.arange(-1, nx + 1) * dx * _MILLI, np.arange(-1, ny + 1) * dy * _MILLI
    axes.contour(x, y, padded.T, levels=[0.5], colors=[ink], linewidths=[width])
    left, right, bottom, top = _edges(problem)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def _label(axes: Any) -> None:
    axes.set_xlabel("$x$ (mm), direction of slip")
    axes.set_ylabel("$y$ (mm)")
