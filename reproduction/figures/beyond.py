"""Figures 8 to 16, beyond the paper."""

import dataclasses
import math

import numpy as np
from scipy.stats import binomtest

from reproduction import setting
from reproduction.claims import Data
from reproduction.figures import common
from reproduction.figures.common import COLOURS, DARK, GREY, OVER_MEAN, RED, TAU_CR, XI
from reproduction.numbers_with_errors import deviation, lower_spread, mean
from reproduction.setting import HIGH, MEAN, PROBLEM, RATIOS, SIMULATED, H, L
from reproduction.statements_onset import bound_above, trend
from reproduction.statements_rupture import arrested, largest_energy, shares, with_inertia
from reproduction.studies import DRIVING, LOAD_SHARES, RATES


def figure_8(d: Data):
    """Draw the local criterion and the bound that is strict on the grid against the exact onset."""
    figure = common.new(5.6)
    top, bottom = figure.subplots(2, 1)
    for axes, text, above in (
        (top, "the bound, by the grid's eigenvector, above the exact onset (%)", bound_above),
        (bottom, "the local criterion above the exact onset (%)", Data.excess),
    ):
        for ratio in RATIOS:
            ordered = 100 * np.sort(above(d, ratio))
            left = 1.0 - np.arange(ordered.size) / ordered.size
            axes.plot(ordered, left, **common.line(ratio), label=f"{ratio:g}")
        axes.axvline(0, color=GREY, lw=0.8)
        axes.set_xscale("symlog", linthresh=0.1, linscale=0.5)
        axes.set(yscale="log", ylim=(0.7 / d.size.samples, 1.3), xlabel=text, xlim=(-0.06, 10),
                 ylabel="share of samples above")  # fmt: skip
        common.plain_ticks(axes.xaxis, (0, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10))
    top.legend(title=XI, loc="upper right")
    common.letters((top, bottom))
    return figure


def figure_9(d: Data):
    """Draw mean and spread of tau_cr over the whole range of correlation lengths."""
    figure = common.new(5.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    tiny = d["vanishing"]["stress"]
    for axes, function, factor in ((top, mean, 1 / MEAN), (bottom, lower_spread, 1e-3)):
        finer = [function(row.values) * factor for row in tiny]
        common.numbers(axes, tiny.ratio.values, finer, color=COLOURS[0], marker="o", mfc="white",
                       ls="-", label="finer grid, other draws")  # fmt: skip
        rows = trend(d, function, factor)
        common.numbers(axes, [r for r, _ in rows], [n for _, n in rows], color=COLOURS[0],
                       marker="o", label="median less lower quartile")  # fmt: skip
    rows = trend(d, deviation, 1e-3)
    bottom.plot([r for r, _ in rows], [n.value for _, n in rows], ":", color=GREY,
                label="standard deviation")  # fmt: skip
    for axes in (top, bottom):
        axes.axvspan(RATIOS[0], RATIOS[-1], color="#eeeeee", lw=0, zorder=0)
    top.set(xscale="log", ylabel=rf"mean of $\tau_\mathrm{{cr}}{OVER_MEAN}")
    top.text((RATIOS[0] * RATIOS[-1]) ** 0.5, 0.03, "Figures 5 and 6", ha="center", color=GREY,
             transform=top.get_xaxis_transform())  # fmt: skip
    bottom.set(yscale="log", xlabel=XI, ylabel="spread (kPa)")
    common.plain_ticks(bottom.xaxis, (1 / 64, 1 / 16, 0.25, 1, 4, 16),
                       ["1/64", "1/16", "1/4", "1", "4", "16"])  # fmt: skip
    bottom.legend(loc="upper left")
    common.letters((top, bottom))
    return figure


def figure_10(d: Data):
    """Draw how far ruptures lie above exact equilibrium against the loading rate."""
    figure = common.new(3.2)
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
    axes.text(rates[2] * 0.92, 0.7, "other ruptures", rotation=90, ha="right", va="center",
              color=GREY, transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="loading rate (MPa/s)",
             ylabel="rupture above equilibrium (%)")  # fmt: skip
    axes.legend(loc="upper left")
    return figure


def figure_11(d: Data):
    """Draw how patches grow in number and merge, and how they act on each other."""
    figure = common.new(7.6)
    grid = figure.add_gridspec(4, 1, height_ratios=(1.0, 0.85, 1.0, 0.9))
    number, single, pair, lowering = (figure.add_subplot(grid[i]) for i in range(4))
    for ratio in RATIOS:
        rows = d.at("growth", "patches", ratio)
        number.errorbar(LOAD_SHARES, rows.mean(axis=0), 2 * rows.std(axis=0) / np.sqrt(len(rows)),
                        **common.line(ratio), lw=1, label=f"{ratio:g}")  # fmt: skip
    number.set(xlabel=r"$\tau_0/\tau_\mathrm{cr}$", ylabel="slipping patches", ylim=(0, None))
    number.legend(title=XI, loc="upper left", ncols=2)
    study = d["mechanism"]
    x = (PROBLEM.interface.x - 0.5 * L) / H
    load = float(study["one_load"])
    single.plot(x, study["one_stress"] / load, color=COLOURS[0], label="stress over load")
    single.plot(x, study["one_strength"] / load, "--", color=GREY, label="strength over load")
    single.set(xlim=(-3, 3), xlabel=r"$x/h_\mathrm{n}$ from a single patch")
    single.legend(loc="lower right")
    pair.plot(x, study["pair_strength"] / MEAN, "--", color=GREY, label=r"$\tau_\mathrm{p}$")
    pair.plot(x, study["pair_tau_n"] / MEAN, color=COLOURS[1], label=r"$\tau_\mathrm{n}$")
    for name, marker, face, text in (("pair_local", "s", "none", "local criterion"),
                                     ("pair_exact", "o", RED, "exact onset")):  # fmt: skip
        place = float(study[name])
        height = float(np.interp(place, PROBLEM.interface.x, study["pair_tau_n"] / MEAN))
        pair.plot((place - 0.5 * L) / H, height, marker, color=RED, ms=6, mfc=face, label=text)
    pair.set(xlim=(-12, 12), ylim=(None, 1.3), xlabel=r"$x/h_\mathrm{n}$",
             ylabel=rf"stress ${OVER_MEAN}")  # fmt: skip
    pair.legend(loc="upper center", ncols=2)
    lowering.loglog(study["distance"], study["lowering"] * 100, "-o", color=COLOURS[0], ms=4)
    lowering.set(xlabel=r"distance of two dips over $h_\mathrm{n}$", ylabel="onset lowered (%)")
    common.plain_ticks(lowering.xaxis, (1.25, 2, 3, 5, 8))
    common.letters((number, single, pair, lowering))
    return figure


def figure_12(d: Data):
    """Draw the energy balance of a growing rupture, and the share of arrested ones."""
    figure = common.new(5.6)
    top, bottom = figure.subplots(2, 1, height_ratios=(1.2, 1.0))
    drops = {
        ratio: d.stress(ratio, "exact").mean() - setting.residual(MEAN) for ratio in RATIOS
    }
    unit = math.pi * 0.5 * H / (2 * setting.G_STAR) / largest_energy()
    length = np.linspace(0, 1.5 / (unit * max(drops.values()) ** 2), 100)
    for ratio, drop in drops.items():
        top.plot(length, unit * length * drop**2, **common.line(ratio), label=f"{ratio:g}")
    top.axhline(1, color=RED, lw=1)
    top.text(
        0.02 * length[-1], 1.03, r"largest fracture energy $\Gamma_\mathrm{max}$", color=RED
    )
    top.axvspan(0, 1, color="#eeeeee", lw=0, zorder=0)
    top.text(0.5, 0.6, "not yet\nunstable", ha="center", color=GREY)
    events = d["arrest"]
    moving = events["dynamic"].values > 0
    for chosen, y, marker, text in (
        (~moving, 0.04, "o", "carried through by inertia"),
        (moving, 0.12, "X", "arrested with inertia, too"),
    ):
        place = events["length"].values[chosen] / H
        top.plot(place, y + 0 * place, marker, color=DARK, ms=5, mfc="none", label=text)
    top.set(xlabel=r"length of the rupture over $h_\mathrm{n}$", xlim=(0, length[-1]),
            ylim=(0, 1.6), ylabel=r"$G/\Gamma_\mathrm{max}$")  # fmt: skip
    top.legend(loc="lower right", title=XI)
    for function, shift, colour, marker, text in (
        (arrested, 0.0, COLOURS[0], "o", "without inertia"),
        (with_inertia, 0.1, RED, "D", "with inertia (drawn beside)"),
    ):
        rows = [function(d, ratio) * 100 for ratio in RATIOS]
        style = {"fmt": marker, "color": colour, "ms": 5, "label": text}
        common.numbers(bottom, np.log2(RATIOS) + shift, rows, **style)
    common.ratio_axis(bottom)
    bottom.set(ylabel="samples with an\narrested event (%)", ylim=(0, None))
    bottom.legend()
    common.letters((top, bottom))
    return figure


ENDLESS = 45.0
"""Where a length over h_n that is infinite is drawn."""


def figure_13(d: Data):
    """Draw arrested fronts under non-uniform loads beside Griffith's lengths."""
    figure = common.new(5.2)
    top, bottom = figure.subplots(2, 1, height_ratios=(0.8, 1.2))
    x = PROBLEM.interface.x / L
    for (case, load), colour in zip(DRIVING.items(), COLOURS, strict=False):
        profile = dataclasses.replace(PROBLEM, load=load).load_profile
        top.plot(x, np.broadcast_to(profile, x.shape), color=colour, label=case)
    top.set(xlabel="$x/L$", ylabel="load over its mean", xlim=(0, 1), ylim=(0, None))
    top.legend()
    study = d["driving"]
    for i, case in enumerate(("edge", "gradient", "uniform")):
        here = study.sel(case=case)
        length = here["length"].values.ravel() / H
        griffith = np.minimum(here["griffith"].values.ravel() / H, ENDLESS)
        bottom.plot(griffith, length, "osv"[i], color=COLOURS[2 - i], ms=4,
                    label=f"{case}, without inertia ({np.isfinite(length).sum()})")  # fmt: skip
    edge = study.sel(case="edge")
    bottom.plot(edge["griffith"].values[:, 0] / H, edge["dynamic_length"].values / H, "D",
                color=RED, mfc="none", ms=5, label="edge, first event, with inertia"
                f" ({np.isfinite(edge['dynamic_length'].values).sum()})")  # fmt: skip
    bottom.axline((1, 1), (10, 10), color=GREY, lw=0.8)
    bottom.axvline(L / H, color=GREY, lw=0.8, ls=":")
    bottom.set(xscale="log", yscale="log", xlabel=r"Griffith's length over $h_\mathrm{n}$",
               ylabel=r"arrested length over $h_\mathrm{n}$", ylim=(0.8, 200))  # fmt: skip
    common.plain_ticks(bottom.yaxis, (1, 2, 5, 10, 20, 40))
    common.plain_ticks(bottom.xaxis, (5, 10, 20, ENDLESS), ["5", "10", "20", r"$\infty$"])
    bottom.legend(loc="upper left")
    common.letters((top, bottom))
    return figure


def _shares(axes, d: Data, name: str, title: str) -> None:
    places = {case: i for i, (case, _) in enumerate(shares(d, name).rows)}
    for inertia, shift, colour, marker, text in (
        (False, -0.12, COLOURS[0], "o", "without inertia"),
        (True, 0.12, RED, "D", "with inertia"),
    ):
        series = shares(d, name, inertia=inertia)
        size = d[f"{name}-inertia" if inertia else name].sizes["sample"]
        y = [places[case] + shift for case, _ in series.rows]
        value = np.array([100 * number.value for _, number in series.rows])
        exact = [binomtest(round(0.01 * v * size), size).proportion_ci() for v in value]
        error = np.abs(100 * np.transpose(exact) - value)
        axes.errorbar(value, y, xerr=error, fmt=marker, color=colour, ms=4, label=text)
    axes.set_yticks(range(len(places)), places)
    axes.set(xlim=(-3, 103), title=title, ylim=(len(places) - 0.5, -0.5))


def figure_14(d: Data):
    """Draw the share of arrested samples where more is random, with and without inertia."""
    figure = common.new(5.6)
    axes = figure.subplots(3, 1, height_ratios=(4, 6, 6), sharex=True)
    for panel, (name, title) in zip(axes, (
        ("wide_strength", "range of the strength"),
        ("random_load", "random initial stress"),
        ("random_residual", "random residual strength"),
    ), strict=True):  # fmt: skip
        _shares(panel, d, name, title)
    axes[1].legend(loc="upper right")
    axes[-1].set_xlabel("samples with an arrested event (%)")
    common.letters(axes, x=-0.25)
    return figure


def figure_15(d: Data):
    """Draw the effect of length, pressure and ends, and the failure probability."""
    figure = common.new(8.0)
    length, pressure, end, tail = figure.subplots(4, 1)
    extents = np.array((12.5, 25, 50, 100, 200, 400, 800))
    rows = d["length"]["critical_stress"].values
    scatter = [deviation(row / row.mean()) * 100 for row in rows]
    common.numbers(length, extents, scatter, color=COLOURS[0], marker="o")
    length.set(xscale="log", yscale="log", xlabel="length of the interface (mm)",
               ylabel=f"variation of {TAU_CR} (%)")  # fmt: skip
    common.plain_ticks(length.xaxis, extents)
    common.plain_ticks(length.yaxis, (2, 3, 5))
    for chosen, colour, marker, text in (
        ((0, 1, 2), COLOURS[0], "o", r"$\xi_0$ fixed"),
        ((3, 1, 4), COLOURS[2], "^", r"$\xi_0/h_\mathrm{n}$ fixed"),
    ):
        rows = [d.what_if("normal_load", "friction_coefficient", i) for i in chosen]
        pressure.errorbar((1, 2, 4), [row.mean() for row in rows], [row.std() for row in rows],
                          color=colour, marker=marker, ms=4, capsize=3, label=text)  # fmt: skip
    pressure.set(xlabel="normal pressure (MPa)", ylabel="friction coefficient", xlim=(0.5, 4.5))
    pressure.legend(title="mean \N{PLUS-MINUS SIGN} sd of samples")
    change = [mean(row) * 100 for row in d["free_end"]["change"].values]
    shortest, count = np.log2(RATIOS[:1]), len(RATIOS)
    for x, rows, look, text in ((np.log2(RATIOS), change[:count], 0, "$L$"),
                                (shortest, change[count + 1:], 1, "$L/2$"),
                                (shortest, change[count:count + 1], 2, "$L/4$")):  # fmt: skip
        common.numbers(end, x, rows, color=COLOURS[look], marker="os^"[look], label=text)
    end.axhline(0, color=GREY, lw=0.8)
    common.ratio_axis(end)
    end.set(ylabel=f"{TAU_CR} by free ends (%)")
    end.legend(loc="lower right", ncols=3)
    study = d["failure"]
    tail.semilogy(study["stress"] * 1e-6, study["probability"], color=COLOURS[0],
                  label="subset simulation, 95 %")  # fmt: skip
    tail.fill_between(study["stress"] * 1e-6, study["probability_low"], study["probability_high"],
                      color=COLOURS[1], alpha=0.3, lw=0)  # fmt: skip
    ordered = np.sort(d.stress(RATIOS[1])) * 1e-6
    counted = np.arange(1, ordered.size + 1) / ordered.size
    tail.semilogy(ordered[: ordered.size // 2], counted[: ordered.size // 2], ".", color=RED, ms=2,
                  label="counting, 95 %", zorder=0)  # fmt: skip
    error = 2 * np.sqrt(counted * (1 - counted) / ordered.size)
    tail.fill_between(ordered, np.maximum(counted - error, 1e-9), counted + error, color=RED,
                      alpha=0.2, lw=0, where=counted <= 0.5)  # fmt: skip
    tail.set(xlabel="stress (MPa)", ylabel="probability of failure", ylim=(5e-7, 1))
    tail.legend(loc="lower right")
    common.letters((length, pressure, end, tail))
    return figure


def figure_16(d: Data):
    """Draw what other strengths and spectra do to the onset."""
    figure = common.new(4.6)
    skew, spectrum = figure.subplots(2, 1)
    for average, start, colour, marker, text in (
        (MEAN, 0, COLOURS[0], "o", "the paper's strength"),
        (setting.LOW + HIGH - MEAN, 4, COLOURS[2], "^", "its mirror image"),
    ):
        rows = [d.what_if("skewness", "critical_stress", start + i) / average for i in range(4)]
        skew.errorbar(np.log2(RATIOS) + 0.01 * start, [row.mean() for row in rows],
                      [row.std() for row in rows], color=colour, marker=marker, ms=4, capsize=3,
                      label=text)  # fmt: skip
    skew.set(ylabel=r"$\tau_\mathrm{cr}$ over own $\langle\tau_\mathrm{p}\rangle$")
    skew.legend(title="mean \N{PLUS-MINUS SIGN} sd of samples", loc="upper right")
    for k, ratio in enumerate(SIMULATED):
        usual = d.what_if("exponent", "critical_stress", 4 * k + 2).mean()
        rows = [d.what_if("exponent", "critical_stress", 4 * k + j).mean() for j in range(4)]
        look = common.dots(ratio) | {"linestyle": "-", "ms": 4, "label": f"{ratio:g}"}
        spectrum.plot((1.5, 2, 4, 8), [100 * (row / usual - 1) for row in rows], **look)
    spectrum.set(xlabel="exponent of the spectrum, at equal decay length", xscale="log",
                 ylabel=f"mean {TAU_CR} (%)")  # fmt: skip
    common.plain_ticks(spectrum.xaxis, (1.5, 2, 4, 8))
    spectrum.legend(title=XI, loc="upper right")
    common.ratio_axis(skew)
    common.letters((skew, spectrum))
    return figure
