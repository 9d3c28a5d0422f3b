"""Figures of planes: strength, nucleation stress and where each method sees it let go."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.report.style import COLUMN, PAGE, color, marker, new_figure, panel, paper_style

_MAP = "cividis"
_EDGE = "white"
Box = tuple[float, float, float, float]
NEAR = 2.0
"""Nucleation lengths on either side that are shown of weak spots."""


def _image(figure: Figure, axes: Axes, values: Array, box: Box, label: str) -> None:
    """A field of a plane (nx, ny), Pa, over `box` in the units of the axes."""
    drawn = axes.imshow(values.T * 1e-6, origin="lower", extent=box, cmap=_MAP)
    figure.colorbar(drawn, ax=axes, label=label, shrink=0.75)


def draw_plane_onset(
    problem: Problem, tau_p: Array, results: Mapping[str, xr.Dataset], names: Mapping[str, str]
) -> Figure:
    """Strength and nucleation stress of a plane, with the onset by each method.

    Parameters
    ----------
    problem : Problem
    tau_p : (nx, ny) array
        Pa.
    results : mapping of Dataset
        By the type of the method, one sample each.
    names : mapping of str
        What methods are called, by their type.
    """
    fields = [(tau_p, r"strength $\tau_p$ (MPa)")]
    with suppress(InputError):  # without one critical patch the strength alone is shown
        fields.append((nucleation_stress(problem, tau_p), r"nucleation stress $\tau_n$ (MPa)"))
    lengths = [1e3 * length for length in problem.interface.lengths]
    across = min(max(lengths[1] / lengths[0], 0.3), 1.5)
    figure = new_figure(PAGE, 0.9 + 0.42 * PAGE * across)
    panels = np.atleast_1d(figure.subplots(1, len(fields), sharey=True))
    step = [1e3 * spacing for spacing in problem.interface.spacings]
    # A pixel around each node; the first node is at the origin.
    box = (-0.5 * step[0], lengths[0] - 0.5 * step[0], -0.5 * step[1], lengths[1] - 0.5 * step[1])
    for letter, axes, (values, label) in zip("ab", panels, fields, strict=False):
        _image(figure, axes, values, box, label)
        for number, (name, result) in enumerate(results.items()):
            _mark(axes, result, number, names.get(name, name), lengths)
        axes.set_xlim(box[0], box[1])
        axes.set_ylim(box[2], box[3])
        axes.set_xlabel("$x$, along the slip (mm)")
        panel(axes, letter)
    panels[0].set_ylabel("$y$ (mm)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center")
    return figure


def _mark(axes: Axes, result: xr.Dataset, number: int, name: str, lengths: list[float]) -> None:
    x, y = (float(one) * 1e3 for one in result["critical_position"].values[0])
    load = float(result["critical_load"][0]) * 1e-6
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=marker(number),
        markersize=5.0,
        markerfacecolor=_EDGE,
        markeredgecolor=color(number + 1),
        label=f"{name}: {load:.4f} MPa at ({x:.2f}, {y:.2f}) mm",
    )
    if "critical_aspect" not in result:
        return
    extent = result["critical_patch_extent"].values[0] * 1e3
    for i, j in itertools.product((-1, 0, 1), repeat=2):  # it may lie across the edges
        axes.add_patch(
            Ellipse(
                (x + i * lengths[0], y + j * lengths[1]), *extent, fill=False, edgecolor=_EDGE,
                linewidth=0.9,
            )
        )  # fmt: skip


def plane_weak_spot_figure(failing: xr.Dataset, nucleation_length: float) -> Figure:
    """Mean strength of failing samples of a plane, each moved so that it lets go in the middle.

    Parameters
    ----------
    failing : Dataset
        `failing_profiles` of a `FailureProbability`.
    nucleation_length : float
        h_n, m; the unit of length.
    """
    places = [failing[dim].values for dim in ("x", "y")]
    spacings = [float(place[1] - place[0]) for place in places]
    middle = [place.size // 2 for place in places]
    positions = failing["critical_position"].values
    total: Any = 0.0
    for strength, at in zip(failing["strength"].values, positions, strict=True):
        shift = [m - round(float(a) / h) for m, a, h in zip(middle, at, spacings, strict=True)]
        total = total + np.roll(strength, shift, (0, 1)) / positions.shape[0]
    reach = [
        min(m, max(1, int(NEAR * nucleation_length / h)))
        for m, h in zip(middle, spacings, strict=True)
    ]
    near = total[
        middle[0] - reach[0] : middle[0] + reach[0] + 1,
        middle[1] - reach[1] : middle[1] + reach[1] + 1,
    ]
    ends = [(r + 0.5) * h / nucleation_length for r, h in zip(reach, spacings, strict=True)]
    with paper_style():
        figure = new_figure(COLUMN * 1.2, 2.7)
        axes = figure.subplots()
        box = (-ends[0], ends[0], -ends[1], ends[1])
        _image(figure, axes, near, box, "mean strength (MPa)")
        axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
        axes.set_ylabel(r"$(y - y_{\mathrm{cr}})/h_n$")
    return figure
