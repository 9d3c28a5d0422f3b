"""Figures 8 to 11, beyond the paper: exact onset, the whole trend, loading rate, patches."""

import numpy as np

from reproduction import setting
from reproduction.claims import Data
from reproduction.figures.style import (
    COLOURS,
    GREY,
    OVER_MEAN,
    RED,
    XI,
    letters,
    line,
    new,
    numbers,
    plain_ticks,
)
from reproduction.numbers_with_errors import deviation, lower_spread, mean
from reproduction.setting import MEAN, PROBLEM, RATIOS, H, L
from reproduction.statements_onset import trend
from reproduction.studies import LEVELS, RATES


def figure_8(d: Data):
    """Draw the local criterion and the bound that is strict on the grid against the exact onset."""
    figure = new(5.6)
    top, bottom = figure.subplots(2, 1)
    for ratio in RATIOS:
        exact = d.at("exact", "first_instability", ratio)
        bound = 100 * (d.at("moments", "bound", ratio) / exact - 1)
        local = 100 * d.excess(ratio)
        for axes, values in ((top, bound), (bottom, local)):
            ordered = np.sort(values)
            above = 1.0 - np.arange(ordered.size) / ordered.size
            axes.plot(ordered, above, **line(ratio), label=f"{ratio:g}")
    for axes, text in (
        (top, "the bound, by the grid's eigenvector, above the exact onset (%)"),
        (bottom, "the local criterion above the exact onset (%)"),
    ):
        axes.axvline(0, color=GREY, lw=0.8)
        axes.set(xlim=(-0.1, 2.0), yscale="log", ylim=(1e-3, 1.3), xlabel=text,
                 ylabel="share of samples above")  # fmt: skip
    top.legend(title=XI, loc="upper right")
    letters((top, bottom))
    return figure


def figure_9(d: Data):
    """Draw mean and spread of tau_cr over the whole range of correlation lengths."""
    figure = new(5.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    cases = ((0, COLOURS[0], "-", "o", "fixed mean of $z$, as in the paper"),
             (1, COLOURS[2], "--", "^", "random mean of $z$"))  # fmt: skip
    for mode, colour, dashes, marker, label in cases:
        for axes, function, factor in ((top, mean, 1 / MEAN), (bottom, lower_spread, 1e-3)):
            rows = trend(d, function, factor, mode)
            style = {"color": colour, "ls": dashes, "marker": marker, "label": label}
            numbers(axes, [r for r, _ in rows], [n for _, n in rows], **style)
    rows = trend(d, deviation, 1e-3)
    bottom.plot([r for r, _ in rows], [n.value for _, n in rows], ":", color=GREY,
                label="standard deviation, fixed mean")  # fmt: skip
    for axes in (top, bottom):
        axes.axvspan(RATIOS[0], RATIOS[-1], color="#eeeeee", lw=0, zorder=0)
    top.set(xscale="log", ylabel=rf"mean of $\tau_\mathrm{{cr}}{OVER_MEAN}", ylim=(0.68, 0.92))
    top.text(0.71, 0.69, "the paper's range", ha="center", color=GREY)
    bottom.set(yscale="log", xlabel=XI, ylabel="median less lower quartile (kPa)")
    plain_ticks(bottom.xaxis, (0.0625, 0.25, 1, 4, 16))
    plain_ticks(bottom.yaxis, (10, 20, 50, 100))
    bottom.legend(loc="upper left")
    letters((top, bottom))
    return figure


def figure_10(d: Data):
    """Draw how far ruptures lie above exact equilibrium against the loading rate."""
    figure = new(3.2)
    axes = figure.subplots()
    offset = d["convergence"]["offset"]
    rates = np.array(RATES) * setting.LOADING_RATE * 1e-6
    rows = np.array([offset.sel(case=f"rate {rate:g}").values for rate in RATES]) * 100
    axes.plot(rates, rows, "-", color="#c4ccd4", lw=0.8)
    axes.errorbar(rates, rows.mean(axis=1), 2 * rows.std(axis=1, ddof=1) / np.sqrt(rows.shape[1]),
                  color=COLOURS[0], marker="o", ms=4, label="mean of the samples")  # fmt: skip
    guide = rows.mean(axis=1)[2] * (rates / rates[2])
    axes.plot(rates, guide, ":", color=RED, label="in proportion to the rate")
    axes.axvline(rates[2], color=GREY, lw=0.8, ls="--")
    axes.text(rates[2] * 0.92, 0.3, "all other ruptures", rotation=90, ha="right", va="center",
              color=GREY)  # fmt: skip
    axes.set(xscale="log", yscale="log", ylim=(5e-4, 1), xlabel="loading rate (MPa/s)",
             ylabel="rupture above equilibrium (%)")  # fmt: skip
    axes.legend(loc="upper left")
    return figure


def figure_11(d: Data):
    """Draw how patches grow in number and merge, and how they act on each other."""
    figure = new(7.6)
    grid = figure.add_gridspec(4, 1, height_ratios=(1.0, 0.85, 1.0, 0.9))
    number, one, pair, lowering = (figure.add_subplot(grid[i]) for i in range(4))
    for ratio in RATIOS:
        rows = d.at("growth", "patches", ratio)
        number.errorbar(LEVELS, rows.mean(axis=0), 2 * rows.std(axis=0) / np.sqrt(len(rows)),
                        **line(ratio), lw=1, label=f"{ratio:g}")  # fmt: skip
    number.set(xlabel=r"$\tau_0/\tau_\mathrm{cr}$", ylabel="slipping patches", ylim=(0, None))
    number.legend(title=XI, loc="upper left", ncols=2)
    study = d["mechanism"]
    x = (PROBLEM.interface.x - 0.5 * L) / H
    load = float(study["one_load"])
    one.plot(x, study["one_stress"] / load, color=COLOURS[0], label="stress over load")
    one.plot(x, study["one_strength"] / load, "--", color=GREY, label="strength over load")
    one.set(xlim=(-3, 3), ylim=(0.9, 1.2), xlabel=r"$x/h_\mathrm{n}$ from a single patch")
    one.legend(loc="upper right")
    pair.plot(x, study["pair_strength"] / MEAN, "--", color=GREY, label=r"$\tau_\mathrm{p}$")
    pair.plot(x, study["pair_tau_n"] / MEAN, color=COLOURS[1], label=r"$\tau_\mathrm{n}$")
    for name, marker, text in (
        ("pair_local", "s", "local criterion"),
        ("pair_exact", "o", "exact onset"),
    ):
        place = float(study[name])
        height = float(np.interp(place, PROBLEM.interface.x, study["pair_tau_n"] / MEAN))
        pair.plot((place - 0.5 * L) / H, height, marker, color=RED, ms=6, label=text,
                  mfc=RED if marker == "o" else "none")  # fmt: skip
    pair.set(xlim=(-12, 12), ylim=(0.68, 1.3), xlabel=r"$x/h_\mathrm{n}$",
             ylabel=rf"stress ${OVER_MEAN}")  # fmt: skip
    pair.legend(loc="upper center", ncols=2)
    lowering.loglog(study["distance"], study["lowering"] * 100, "-o", color=COLOURS[0], ms=4)
    lowering.set(xlabel=r"distance of two dips over $h_\mathrm{n}$", ylabel="onset lowered (%)")
    plain_ticks(lowering.xaxis, (1.25, 2, 3, 5, 8))
    plain_ticks(lowering.yaxis, (0.03, 0.1, 0.3))
    letters((number, one, pair, lowering))
    return figure
