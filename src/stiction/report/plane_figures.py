"""Figures of a plane with several maps: strength and what slips, and how patches grow."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure, SubFigure

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.equilibrium.path import equilibrium_path
from stiction.errors import InputError
from stiction.plot import maps
from stiction.plot.axes import MEGA, MICRO
from stiction.plot.onsets import draw_plane_onset, has_maps
from stiction.plot.paths import draw_slip
from stiction.plot.style import PAGE, new_figure, panel
from stiction.problem import Problem

SHARES = (0.9, 0.96, 0.99, 1.0 - 1e-5)
"""Of the load of the first instability, at which the growth of patches is shown."""
WIDE = 1.6
"""Ratio of the lengths along x and y from which on the panels lie below each other."""


def averages_figure(problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset]) -> Figure:
    """Strength and nucleation stress of a plane, with the onset by each method.

    Parameters
    ----------
    problem : Problem
    tau_p : (nx, ny) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each.
    """
    fields = [(tau_p, r"strength $\tau_p$ (MPa)")]
    with suppress(InputError):  # without one critical patch the strength alone is shown
        fields.append((nucleation_stress(problem, tau_p), r"nucleation stress $\tau_n$ (MPa)"))
    across = float(np.clip(maps.relative_height(problem.interface), 0.3, 1.5))
    figure = new_figure(PAGE, 0.9 + 0.42 * PAGE * across)
    panels = np.atleast_1d(figure.subplots(1, len(fields), sharey=True))
    for letter, axes, (values, label) in zip("ab", panels, fields, strict=False):
        drawn = draw_plane_onset(axes, problem, values, results, cmap="cividis")
        figure.colorbar(drawn, ax=axes, label=label, shrink=0.75)
        axes.label_outer()
        panel(axes, letter)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center")
    return figure


def patches_figure(problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset]) -> Figure:
    """Map of the strength with the onset by each method, and the growth of the slip patches.

    Parameters
    ----------
    problem : Problem
        On a plane.
    tau_p : (nx, ny) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each; one of them with `slip` and `sensitivity`.
    """
    exact = next(result for result in results.values() if has_maps(result))
    x, y = problem.interface.lengths
    ratio = maps.relative_height(problem.interface)
    if x > WIDE * y:
        heights = 0.9 * PAGE * ratio + 1.7, 2.0 * (0.44 * PAGE * ratio + 0.3) + 1.0
        figure = new_figure(PAGE, sum(heights))
        parts: Any = figure.subfigures(2, 1, height_ratios=heights)
    else:
        figure = new_figure(PAGE, 0.46 * PAGE * ratio + 1.7)
        parts = figure.subfigures(1, 2, width_ratios=(1.0, 0.96))
    axes = parts[0].subplots()
    drawn = draw_plane_onset(axes, problem, tau_p, results)
    parts[0].colorbar(drawn, ax=axes, label=r"strength $\tau_p$ (MPa)", **maps.BAR)
    parts[0].legend(loc="outside lower center", ncols=1)
    first = float(exact["first_instability"][0]) - float(np.mean(problem.load.initial_stress))
    loads = first / float(np.mean(problem.load_profile)) * np.array(SHARES)
    growth_figure(parts[1], problem, equilibrium_path(problem, tau_p, loads))
    return figure


def growth_figure(figure: Figure | SubFigure, problem: Problem, path: xr.Dataset) -> None:
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
    slip, loads = path["slip"].values, path["load"].values * MEGA
    balanced = np.flatnonzero(~path["sliding"].values)
    most = float(np.nanmax(slip[balanced])) if balanced.size else 0.0
    columns = 2 if balanced.size > 1 else 1
    rows = max(1, -(-balanced.size // columns))
    panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).reshape(-1)
    for axes in panels[balanced.size :]:
        axes.set_axis_off()
    drawn = None
    for axes, number in zip(panels, balanced, strict=False):
        drawn = draw_slip(axes, problem.interface, slip[number], loads[number], most)
        axes.label_outer()
    if drawn is not None:
        shares = (0.01, 0.1, 0.4, 1.0)
        ticks = [0.0, *(float(f"{most * MICRO * share:.1g}") for share in shares)]
        figure.colorbar(
            drawn, ax=list(panels), label=r"slip ($\mu$m)", format="%g",
            ticks=[tick for tick in ticks if tick <= most * MICRO], **maps.BAR,
        )  # fmt: skip
