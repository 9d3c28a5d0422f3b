"""One profile and where each method sees it let go."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiction.criterion.nucleation import nucleation_stress
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.report.style import (
    PAGE,
    QUIET,
    color,
    marker,
    new_figure,
    paper_style,
    save_figure,
    series,
)

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
    tau_p : (nodes,) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each.
    """
    figure = new_figure(PAGE, 2.8)
    axes = figure.subplots()
    x = problem.interface.x * 1e3
    axes.plot(x, tau_p * 1e-6, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
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
            label=f"{NAMES.get(name, name)}: {load:.4f} MPa at {place:.2f} mm",
        )
    axes.set_xlim(0.0, problem.interface.length * 1e3)
    axes.set_xlabel("position $x$ (mm)")
    axes.set_ylabel("shear stress (MPa)")
    axes.margins(y=0.08)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def write_onset_figure(
    problem: Problem,
    tau_p: NDArray[np.float64],
    results: Mapping[str, xr.Dataset],
    path: Path,
) -> None:
    """`draw_onset` as a file."""
    with paper_style():
        save_figure(draw_onset(problem, tau_p, results), path)
