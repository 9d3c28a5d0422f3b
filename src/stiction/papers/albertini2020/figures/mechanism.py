"""Beyond the paper: how slip patches act on each other."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, color, new_figure, panel
from stiction.report.tables import Table

name = "mechanism"
number = "13"
title = "How patches act on each other"
needs: tuple[str, ...] = ("mechanism",)


def caption(data: Data) -> str:
    """What is seen."""
    return (
        "Not in the paper, by exact equilibrium: (a) strength and stress at 0.999 of the onset for"
        " a single dip of the strength; the stress falls where it slips and rises beside it. (b) By"
        " how much a second dip like it lowers the onset, against their distance. (c) Strength with"
        " three dips, and its nucleation stress: the local criterion expects the onset at the"
        " lonely dip on the left (circle), but the slightly less critical one on the right has a"
        " neighbour, and slides first (cross)."
    )


def tables(data: Data) -> list[Table]:
    """Lowering against distance."""
    study = data["mechanism"]
    rows = zip(study["distance"].values.tolist(), study["lowering"].values.tolist(), strict=True)
    return [
        Table.of(
            "figure-13-lowering",
            "Lowering of the onset by a second dip",
            ("distance/h_n", "of the stress"),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """One patch, two patches, a pair."""
    figure = new_figure(PAGE, 4.2)
    grid = figure.add_gridspec(2, 2)
    one, two = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    pair = figure.add_subplot(grid[1, :])
    study, setting = data["mechanism"], data.setting
    unit, length = setting.problem.nucleation_length, setting.problem.interface.extent
    x = (study["x"].values - 0.5 * length) / unit
    _levels(one, data, x, "one_strength", "one_stress", r"$\tau$")
    one.axhline(study.attrs["one_load"] / setting.mean, color=PALE, linewidth=0.8, zorder=0)
    one.text(
        2.95, study.attrs["one_load"] / setting.mean, "load", ha="right", va="bottom",
        color=QUIET, fontsize=7.5,
    )  # fmt: skip
    one.set_xlim(-3, 3)
    two.plot(study["distance"].values, 100.0 * study["lowering"].values, "o-", color=color(1))
    two.set_ylim(bottom=0)
    two.set_xlabel(r"distance of the dips$\,/h_\mathrm{n}$")
    two.set_ylabel("onset lower by (%)")
    _levels(pair, data, x, "pair_strength", "pair_nucleation_stress", r"$\tau_\mathrm{n}$")
    for place, symbol, shade, text in (
        ("pair_local", "o", INK, "local criterion"),
        ("pair_exact", "x", ACCENT, "exact equilibrium"),
    ):
        where = (float(study[place]) - 0.5 * length) / unit
        pair.plot(
            [where], [float(study["pair_stress"]) / setting.mean], symbol, color=shade,
            markersize=7, markerfacecolor="none", markeredgewidth=1.4, linestyle="none", label=text,
        )  # fmt: skip
    pair.set_xlim(-12, 12)
    pair.legend(ncols=2)
    for axes, letter in zip((one, two, pair), "abc", strict=True):
        panel(axes, letter)
    return figure


def _levels(axes: Axes, data: Data, x: np.ndarray, strength: str, stress: str, text: str) -> None:
    study = data["mechanism"]
    axes.plot(x, data.relative(study[strength].values), color=QUIET, linewidth=0.9,
              label=r"$\tau_\mathrm{p}$")  # fmt: skip
    axes.plot(x, data.relative(study[stress].values), color=color(1), linewidth=1.5, label=text)
    axes.set_xlabel(r"position $x/h_\mathrm{n}$")
    axes.set_ylabel(r"stress$\,/\langle\tau_\mathrm{p}\rangle$")
    axes.legend()
