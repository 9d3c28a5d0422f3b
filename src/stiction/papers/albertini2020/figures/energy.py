"""Beyond the paper: the energy that keeps a rupture growing, what is arrested, and how fast."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import release_rate, toughest
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, marker, new_figure, panel, series
from stiction.report.tables import Table

name = "energy"
number = "9"
title = "Run-away propagation"
needs: tuple[str, ...] = ("monte_carlo", "interaction", "arrest", "ruptures")

LENGTHS = np.linspace(0.0, 4.5, 91)


def caption(data: Data) -> str:
    """What is seen."""
    events = data["arrest"]
    typical = float(data["ruptures"]["median_rupture_speed"].median())
    fast = typical > data.setting.problem.solid.shear_wave_speed
    count = events.sizes["event"]
    return (
        "Not in the paper: (a) static energy release rate of a crack under the stress drop"
        " tau_cr - tau_r against its length, over the largest fracture energy Gamma_max; the shade"
        " spans 5 to 95 % of samples, dots mark the length from which nothing arrests the crack."
        " (b) Longest arrested patch by equilibrium in the samples whose first instability comes to"
        f" rest, {count} of them, each run again with inertia: filled where it comes to rest with"
        " inertia, too, open where inertia carries it through. (c) Speed of the front in each"
        " rupture of Figure 4, its median over the interface (filled) and its largest over two"
        " nucleation lengths (open), against the Rayleigh, shear and dilatational wave speeds."
        " These are apparent speeds: patches that grow ahead of the front and are swallowed add to"
        " them, so that they may exceed c_d, which no disturbance does."
        f"{' The ruptures are supershear.' if fast else ''}"
    )


def tables(data: Data) -> list[Table]:
    """Lengths beyond which nothing arrests, and the arrested events."""
    strongest = toughest(data)
    rows = []
    for ratio in data.ratios:
        stress = data.at(ratio)["critical_stress"].values
        for p in (0.05, 0.5, 0.95):
            unit = release_rate(data, float(np.quantile(stress, p)), 1.0)
            rows.append((ratio, p, float(strongest / unit)))
    events = data["arrest"]
    keys = ("ratio", "number", "length", "load", "dynamic_arrests")
    return [
        Table.of(
            "figure-9-lengths",
            "Length from which G exceeds Gamma_max, in units of h_n",
            ("xi_0/h_n", "quantile of tau_cr", "length/h_n"),
            rows,
        ),
        Table.of(
            "figure-9-arrests",
            "Samples with an arrested event by equilibrium, run again with inertia",
            ("xi_0/h_n", "sample", "longest arrested patch (m)", "load (Pa)", "arrests, dynamic"),
            zip(*(events[key].values.tolist() for key in keys), strict=True),
        ),
    ]


def draw(data: Data) -> Figure:
    """Release rate on the left, arrested patches on the right."""
    figure = new_figure(PAGE, 2.6)
    rate, lengths, speed = figure.subplots(1, 3, width_ratios=(1.2, 0.9, 0.9))
    _rate(rate, data)
    _lengths(lengths, data)
    _speeds(speed, data)
    for axes, letter in zip((rate, lengths, speed), "abc", strict=True):
        panel(axes, letter)
    return figure


def _speeds(axes: Axes, data: Data) -> None:
    solid, runs = data.setting.problem.solid, data["ruptures"]
    unit = solid.shear_wave_speed
    waves = {
        r"$c_\mathrm{R}$": (solid.rayleigh_wave_speed / unit, "top"),
        r"$c_\mathrm{s}$": (1.0, "bottom"),
        r"$c_\mathrm{d}$": (solid.dilatational_wave_speed / unit, "center"),
    }
    ratios = data.setting.simulated_ratios
    for name, (value, side) in waves.items():
        axes.axhline(value, color=PALE, linewidth=0.8, zorder=0)
        axes.text(len(ratios) - 0.45, value, name, ha="left", va=side)
    for place, ratio in enumerate(ratios):
        # The same colour as in the other panels.
        i = data.ratios.index(ratio) if ratio in data.ratios else place
        at = runs.sel(correlation_ratio=ratio)
        for key, face, aside in (
            ("median_rupture_speed", color(i), -0.14),
            ("rupture_speed", "white", 0.14),
        ):
            speed = at[key].values / unit
            spread = place + aside + np.linspace(-0.09, 0.09, speed.size)
            axes.plot(
                spread, speed, marker(i), color=color(i), markerfacecolor=face, markersize=2.8,
                markeredgewidth=0.6,
            )  # fmt: skip
    axes.set_xticks(range(len(ratios)), [f"{ratio:g}" for ratio in ratios])
    axes.set_xlim(-0.5, len(ratios) - 0.5)
    axes.set_ylim(0, 1.1 * float(np.nanmax(runs["rupture_speed"].values)) / unit)
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    axes.set_ylabel(r"front speed$\,/c_\mathrm{s}$")
    axes.plot([], [], "o", color=INK, markersize=2.8, label="median")
    axes.plot([], [], "o", color=INK, markerfacecolor="white", markersize=2.8, label="largest")
    axes.legend(loc="upper left", handlelength=1.0)


def _rate(axes: Axes, data: Data) -> None:
    strongest = toughest(data)
    top = 1.8
    for i, ratio in enumerate(data.ratios):
        stress = data.at(ratio)["critical_stress"].values
        low, middle, high = np.quantile(stress, (0.05, 0.5, 0.95))
        curve = release_rate(data, middle, LENGTHS) / strongest
        axes.plot(LENGTHS, curve, label=f"{ratio:g}", **series(i))
        axes.fill_between(
            LENGTHS,
            release_rate(data, low, LENGTHS) / strongest,
            release_rate(data, high, LENGTHS) / strongest,
            color=color(i),
            alpha=0.12,
            linewidth=0,
        )
        axes.plot([1.0 / curve[-1] * LENGTHS[-1]], [1.0], marker(i), color=color(i), zorder=5)
    axes.axhline(1.0, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)
    axes.text(4.45, 1.02, r"$\Gamma_\mathrm{max}$", ha="right", va="bottom", color=QUIET)
    axes.axvline(1.0, color=PALE, linewidth=0.8, zorder=0)
    axes.set_xlim(0, LENGTHS[-1])
    axes.set_ylim(0, top)
    axes.set_xlabel(r"crack length $h/h_\mathrm{n}$")
    axes.set_ylabel(r"energy release rate $/\,\Gamma_\mathrm{max}$")
    axes.legend(title=r"$\xi_0/h_\mathrm{n}$", title_fontsize=7.5, loc="upper left")


def _lengths(axes: Axes, data: Data) -> None:
    events, unit = data["arrest"], data.setting.problem.nucleation_length
    length = events["length"].values / unit
    stays = events["dynamic_arrests"].values > 0
    for i, ratio in enumerate(data.ratios):
        here = events["ratio"].values == ratio
        for chosen, face in ((stays, color(i)), (~stays, "white")):
            keep = here & chosen
            spread = np.linspace(-0.15, 0.15, max(int(keep.sum()), 1))[: int(keep.sum())]
            axes.plot(
                i + spread, length[keep], marker(i), color=color(i), markerfacecolor=face,
                markersize=4.5,
            )  # fmt: skip
    axes.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    axes.set_xticks(range(len(data.ratios)), [f"{ratio:g}" for ratio in data.ratios])
    axes.set_xlim(-0.5, len(data.ratios) - 0.5)
    axes.set_ylim(0, max(1.15 * float(length.max(initial=0.0)), 3.5))
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    axes.set_ylabel(r"arrested patch$\,/h_\mathrm{n}$")
    axes.plot([], [], "o", color=INK, markersize=4.5, label="with inertia, too")
    axes.plot([], [], "o", color=INK, markerfacecolor="white", markersize=4.5, label="without only")
    axes.legend(loc="upper left", handlelength=1.0)
    if not length.size:
        axes.text(
            0.5, 0.5, "no arrested event\nin these samples", transform=axes.transAxes, ha="center",
            va="center", color=INK,
        )  # fmt: skip
