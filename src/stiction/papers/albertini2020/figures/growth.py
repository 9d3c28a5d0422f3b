"""Beyond the paper: slip patches appear, grow and merge on the way to the onset."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.plot.style import PAGE, color, new_figure, panel, series
from stiction.report.tables import Table

name = "growth"
number = "10"
title = "Slip patches on the way to the onset"
needs: tuple[str, ...] = ("growth",)


def caption(data: Data) -> str:
    """What is seen."""
    return (
        "Not in the paper: (a) number of slipping patches by exact equilibrium against the load,"
        " in units of that of the first instability, mean (lines) and 5 to 95 % range (shade) over"
        f" {data['growth'].sizes['sample']} samples at each correlation length; (b) mean number of"
        " patches that have merged with another one since 0.88 of that load."
    )


def tables(data: Data) -> list[Table]:
    """Means at each load."""
    study = data["growth"]
    rows = [
        (
            ratio,
            float(level),
            float(study["patches"].sel(correlation_ratio=ratio, level=level).mean()),
            float(study["mergers"].sel(correlation_ratio=ratio, level=level).mean()),
        )
        for ratio in data.ratios
        for level in study["level"].values
    ]
    return [
        Table.of(
            "figure-10-growth",
            "Slip patches against load",
            ("xi_0/h_n", "load over that of the onset", "patches", "mergers so far"),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """Patches on the left, mergers on the right."""
    figure = new_figure(PAGE * 0.9, 2.5)
    number_of, mergers = figure.subplots(1, 2)
    study = data["growth"]
    level = study["level"].values
    for i, ratio in enumerate(data.ratios):
        at = study.sel(correlation_ratio=ratio)
        patches = at["patches"].values
        low, high = np.quantile(patches, (0.05, 0.95), axis=0)
        number_of.fill_between(level, low, high, color=color(i), alpha=0.13, linewidth=0)
        number_of.plot(level, patches.mean(axis=0), label=f"{ratio:g}", **series(i))
        mergers.plot(level, at["mergers"].values.mean(axis=0), **series(i))
    for axes in (number_of, mergers):
        axes.set_xlim(level[0], 1.0)
        axes.set_ylim(bottom=0)
        axes.set_xlabel(r"load $\tau_0/\tau_\mathrm{cr}$")
    number_of.set_ylabel("slip patches")
    mergers.set_ylabel("mergers so far")
    number_of.legend(title=r"$\xi_0/h_\mathrm{n}$", title_fontsize=7.5, loc="upper left")
    panel(number_of, "a")
    panel(mergers, "b")
    return figure
