"""The figure of `stiction onset`: one profile, and where each method sees sliding begin."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiction.plot.onsets import draw_line_onset, has_maps
from stiction.plot.style import PAGE, new_figure, paper_style, save_figure
from stiction.problem import Problem
from stiction.report.plane_figures import averages_figure, patches_figure


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
        draw = patches_figure if with_maps else averages_figure
        return draw(problem, tau_p, results)
    figure = new_figure(PAGE, 2.8)
    draw_line_onset(figure.subplots(), problem, tau_p, results)
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
