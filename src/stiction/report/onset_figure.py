"""One profile and where each method sees sliding begin."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiction.criterion.nucleation import nucleation_stress
from stiction.errors import InputError
from stiction.gaps import IN_GAP, listed
from stiction.problem import Problem
from stiction.report.patch_figures import draw_patches, has_maps
from stiction.report.plane_figures import draw_plane_onset
from stiction.report.style import (
    PAGE,
    PALE,
    QUIET,
    color,
    marker,
    new_figure,
    paper_style,
    save_figure,
    series,
)

_GAP: dict[str, Any] = {"facecolor": PALE, "alpha": 0.6, "linewidth": 0.0, "zorder": 0.0}
NAMES = {
    "local_criterion": "local criterion",
    "equilibrium": "equilibrium",
    "rupture": "elastodynamic rupture",
}


def draw_onset(
    problem: Problem, tau_p: NDArray[np.float64], results: Mapping[str, xr.Dataset]
) -> Figure:
    """Profile of the strength, the nucleation stress, and the onset by each method.

    Parameters
    ----------
    problem : Problem
    tau_p : (*shape) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each.
    """
    if problem.interface.is_plane:
        with_maps = any(has_maps(result) for result in results.values())
        draw = draw_patches if with_maps else draw_plane_onset
        return draw(problem, tau_p, results, NAMES)
    figure = new_figure(PAGE, 2.8)
    axes = figure.subplots()
    x = problem.interface.x * 1e3
    spans = listed(next(iter(results.values()))) if results else []
    measured = tau_p.copy()
    for begin, end in spans:
        measured[_between(problem, begin, end)] = np.nan
        _shade(axes, problem, begin, end)
    if spans:
        axes.plot(x, tau_p * 1e-6, color=QUIET, linewidth=0.8, linestyle=(0, (2, 2)))
        axes.fill([], [], **_GAP, label="not measured, filled in")
    axes.plot(x, measured * 1e-6, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
    try:
        averaged = nucleation_stress(problem, tau_p)
        axes.plot(x, averaged * 1e-6, label=r"nucleation stress $\tau_n$", **series(0))
    except InputError:  # no single nucleation length: the strength alone is shown
        pass
    for number, (name, result) in enumerate(results.items()):
        place = float(result["critical_position"][0]) * 1e3
        load = float(result["critical_load"][0]) * 1e-6
        axes.plot(
            place,
            load,
            linestyle="none",
            marker=marker(number),
            markersize=7.0 - number,
            markerfacecolor="none" if number else color(number + 1),
            markeredgecolor=color(number + 1),
            markeredgewidth=1.2,
            label=f"{NAMES.get(name, name)}: {load:.4f} MPa at {place:.2f} mm{_remark(result)}",
        )
    axes.set_xlim(0.0, problem.interface.extent * 1e3)
    axes.set_xlabel("position $x$ (mm)")
    axes.set_ylabel("shear stress (MPa)")
    axes.margins(y=0.08)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _between(problem: Problem, begin: float, end: float) -> NDArray[np.bool_]:
    """The nodes of a gap, which may lie across x = 0."""
    x, half = problem.interface.x, 0.5 * problem.interface.spacing
    after, before = x > begin - half, x < end + half
    return after & before if begin <= end else after | before


def _shade(axes: Any, problem: Problem, begin: float, end: float) -> None:
    # From the last measured node to the next one.
    length, spacing = problem.interface.extent * 1e3, problem.interface.spacing * 1e3
    left, right = begin * 1e3 - spacing, end * 1e3 + spacing
    pieces = [(left, right)] if begin <= end else [(left, length), (0.0, right)]
    for piece in pieces:
        axes.axvspan(*piece, **_GAP)


def _remark(result: xr.Dataset) -> str:
    return " (in a gap)" if IN_GAP in result and bool(result[IN_GAP][0]) else ""


def write_onset_figure(
    problem: Problem,
    tau_p: NDArray[np.float64],
    results: Mapping[str, xr.Dataset],
    path: Path,
) -> None:
    """`draw_onset` as a file."""
    with paper_style():
        save_figure(draw_onset(problem, tau_p, results), path)
