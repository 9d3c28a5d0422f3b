"""Figures 8 to 13, beyond the paper."""

import math

import numpy as np

from reproduction import setting
from reproduction.figures import common
from reproduction.figures.common import XI
from reproduction.measures import (
    arrest_shares,
    arrested,
    arrested_again,
    largest_energy,
    trend,
)  # fmt: skip
from reproduction.numbers_with_errors import deviation, lower_spread, mean
from reproduction.runner import Data
from reproduction.setting import MEAN, PROBLEM, RATIOS, H, L
from reproduction.studies import ARRESTS, LOAD_SHARES, loads


def figure_8(d: Data):
    """Draw the local criterion against the exact onset."""
    figure, axes = common.mosaic(3.0, [["whole"]])
    for ratio in RATIOS:
        ordered = 100 * np.sort(d.excess(ratio))
        left = 1.0 - np.arange(ordered.size) / ordered.size
        axes.plot(ordered, left, **common.line(ratio), label=f"{ratio:g}")
    axes.axvline(0, color="grey", lw=0.8)
    axes.set_xscale("symlog", linthresh=0.1, linscale=0.5)
    values = np.concatenate([100 * d.excess(ratio) for ratio in RATIOS])
    left, right = min(-0.06, 1.3 * values.min()), max(0.2, 1.3 * values.max())
    axes.set(yscale="log", ylim=(0.7 / d.size.samples, 1.3), xlim=(left, right))
    ticks = np.outer([-1, 1], np.outer([0.1, 1, 10, 100], [1, 2, 5])).ravel()
    common.plain_ticks(axes.xaxis, [0, *(tick for tick in ticks if left < tick < right)])
    axes.legend(title=XI, loc="upper right")
    return figure


def figure_9(d: Data):
    """Draw mean and spread of tau_cr over the whole range of correlation lengths."""
    figure, top, bottom = common.mosaic(5.6, "a;b", sharex=True)
    for axes, function, factor in ((top, mean, 1 / MEAN), (bottom, lower_spread, 100 / MEAN)):
        drawn = zip(*trend(d, function, factor), strict=True)
        common.numbers(axes, *drawn, color="C0", fmt="-o", label="median less lower quartile")
    rows = trend(d, deviation, 100 / MEAN)
    bottom.plot([r for r, _ in rows], [n.value for _, n in rows], ":", color="grey",
                label="standard deviation")  # fmt: skip
    for axes in (top, bottom):
        axes.axvspan(RATIOS[0], RATIOS[-1], color="0.93", lw=0, zorder=0)
    top.set(xscale="log")
    top.text((RATIOS[0] * RATIOS[-1]) ** 0.5, 0.95, "Figures 5 and 6", ha="center", color="grey",
             transform=top.get_xaxis_transform())  # fmt: skip
    bottom.set(yscale="log")
    common.log_ticks(bottom.yaxis)
    common.plain_ticks(bottom.xaxis, (1 / 16, 0.25, 1, 4, 16), ["1/16", "1/4", "1", "4", "16"])
    bottom.legend(loc="upper left")
    return figure


def figure_10(d: Data):
    """Draw how patches grow in number and merge, and how they act on each other."""
    figure, number, single, lowering = common.mosaic(6.2, "a;b;c")
    for ratio in RATIOS:
        rows = d.at("growth", "patches", ratio)
        number.errorbar(LOAD_SHARES, rows.mean(axis=0), 2 * rows.std(axis=0) / np.sqrt(len(rows)),
                        **common.line(ratio), lw=1, label=f"{ratio:g}")  # fmt: skip
    number.set(ylim=(0, None))
    number.legend(title=XI, loc="upper left", ncols=2)
    study = d["mechanism"]
    x = (PROBLEM.interface.x - 0.5 * L) / H
    load = float(study["one_load"])
    single.plot(x, study["one_stress"] / load, color="C0", label="stress over load")
    single.plot(x, study["one_strength"] / load, "--", color="grey", label="strength over load")
    single.legend(loc="lower right")
    lowering.loglog(study["distance"], study["lowering"] * 100, "-o", color="C0", ms=4)
    common.plain_ticks(lowering.xaxis, (1.25, 2, 3, 5, 8))
    common.log_ticks(lowering.yaxis)
    return figure


def figure_11(d: Data):
    """Draw the energy balance of a growing rupture, and the share of arrested ones."""
    figure, top, bottom = common.mosaic(6.0, "a;b", (1.2, 1.0))
    drops = {ratio: d.stress(ratio, "exact").mean() - setting.RESIDUAL for ratio in RATIOS}
    unit = math.pi * 0.5 * H / (2 * setting.G_STAR) / largest_energy()
    length = np.linspace(0, 1.5 / (unit * max(drops.values()) ** 2), 100)
    for ratio, drop in drops.items():
        look = common.line(ratio) | {"label": f"{XI} = {ratio:g}"}
        top.plot(length, unit * length * drop**2, **look)
    top.axhline(1, color="firebrick", lw=1)
    text = r"largest fracture energy $\Gamma_\mathrm{max}$"
    top.text(0.02 * length[-1], 1.03, text, color="firebrick")
    top.axvspan(0, 1, color="0.93", lw=0, zorder=0)
    top.text(0.5, 0.6, "not yet\nunstable", ha="center", color="grey")
    events = d["arrest"]
    moving = events["dynamic"].values > 0
    for chosen, y, marker, text in (
        (~moving, 0.04, "o", "carried through by inertia"),
        (moving, 0.12, "X", "arrested with inertia, too"),
    ):
        place = events["length"].values[chosen] / H
        top.plot(place, y + 0 * place, marker, color="black", ms=5, mfc="none", label=text)
    top.set(xlim=(0, length[-1]), ylim=(0, 1.6))
    top.legend(loc="lower center", bbox_to_anchor=(0.5, 1.09), ncols=3)
    for function, shift, colour, marker, text in (
        (arrested, 0.0, "C0", "o", "without inertia"),
        (_with_inertia, 0.1, "firebrick", "D", "with inertia"),
    ):
        rows = [function(d, ratio) * 100 for ratio in RATIOS]
        style = {"fmt": marker, "color": colour, "ms": 5, "label": text}
        common.numbers(bottom, np.log2(RATIOS) + shift, rows, **style)
    common.ratio_axis(bottom)
    bottom.set(ylim=(0, None))
    bottom.legend()
    return figure


def _with_inertia(d: Data, ratio: float):
    return arrested(d, ratio, "dynamic") if "dynamic" in d else arrested_again(d, ratio)


ENDLESS = 45.0  # where a length over h_n that is infinite is drawn


def figure_12(d: Data):
    """Draw arrested fronts under non-uniform loads beside Griffith's lengths."""
    figure, top, bottom = common.mosaic(5.2, "a;b", (0.8, 1.2))
    for i, (case, profile) in enumerate(loads().items()):
        x = np.arange(profile.size) / profile.size
        top.plot(x, profile, color=f"C{i}", label=case)
    top.set(xlim=(0, 1), ylim=(0, None))
    top.legend()
    study = d["driving"]
    for i, case in enumerate(("edge", "gradient", "uniform")):
        here = study.sel(case=case)
        length = here["event_length"].values.ravel() / H
        griffith = np.minimum(here["griffith"].values.ravel() / H, ENDLESS)
        bottom.plot(griffith, length, "osv"[i], color=f"C{2 - i}", ms=4,
                    label=f"{case}, without inertia ({np.isfinite(length).sum()})")  # fmt: skip
    moving = study["dynamic_length"].values / H
    first = study["griffith"].sel(case="edge")[:, 0] / H
    bottom.plot(first, moving, "D", color="firebrick", mfc="none",
                label=f"edge, first event, with inertia ({np.isfinite(moving).sum()})")  # fmt: skip
    bottom.axline((1, 1), (10, 10), color="grey", lw=0.8)
    bottom.axvline(L / H, color="grey", lw=0.8, ls=":")
    bottom.set(xscale="log", yscale="log", ylim=(0.8, 200))
    common.plain_ticks(bottom.yaxis, (1, 2, 5, 10, 20, 40))
    common.plain_ticks(bottom.xaxis, (5, 10, 20, ENDLESS), ["5", "10", "20", r"$\infty$"])
    bottom.legend(loc="upper left")
    return figure


def _points(axes, rows, shift: float = 0.0, **style) -> None:
    """Draw named numbers below each other, with bars of twice their errors."""
    values, errors = [100 * n.value for _, n in rows], [200 * n.error for _, n in rows]
    places = np.arange(len(rows)) + shift
    axes.errorbar(values, places, xerr=errors, ms=4, **{"fmt": "o"} | style)
    axes.set_yticks(np.arange(len(rows)), [label for label, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)


def figure_13(d: Data):
    """Draw the share of arrested samples where more is random, with and without inertia."""
    figure, *panels = common.mosaic(6.4, "a;b;c", (4, 6, 6), sharex=True)
    for axes, name in zip(panels, ARRESTS, strict=True):
        _points(axes, arrest_shares(d, name), -0.12, color="C0", label="without inertia")
        _points(axes, arrest_shares(d, f"{name}-inertia"), 0.12, color="firebrick", fmt="D",
                label="with inertia")  # fmt: skip
    panels[1].legend(loc="upper right")
    return figure
