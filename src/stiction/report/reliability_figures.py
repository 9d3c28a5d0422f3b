"""Figures of failure probability: the curve, weak interfaces, what the tail hangs on."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction._typing import Array
from stiction.reliability.result import bounded
from stiction.reliability.tails import LONGER, TailStudy, weakest_link
from stiction.report.plane_figures import plane_weak_spot_figure
from stiction.report.style import (
    ACCENT,
    COLUMN,
    INK,
    PAGE,
    PALE,
    QUIET,
    new_figure,
    panel,
    paper_style,
    series,
)
from stiction.report.tables import Table


def _has_bound(curve: xr.Dataset) -> bool:
    return bounded(float(curve.attrs["lower_bound"]))


def _tail_stress(curve: xr.Dataset) -> tuple[Array, str]:
    """The stress as the tail is best drawn against: above the bound, where there is one."""
    if _has_bound(curve):
        return curve["stress_above_bound"].values * 1e-3, "stress above the\nleast strength (kPa)"
    return curve["stress"].values * 1e-3, "stress (kPa)\n"


def _plain(axes: Axes, x: Array, curve: xr.Dataset, **style: Any) -> None:
    if "plain_probability" not in curve:
        return
    middle = curve["plain_probability"].values
    sides = np.abs(np.stack([curve["plain_low"].values, curve["plain_high"].values]) - middle)
    axes.errorbar(x, middle, yerr=sides, linestyle="none", elinewidth=0.8, **style)


def _decades(axes: Axes, curve: xr.Dataset) -> None:
    axes.set_yscale("log")
    axes.set_ylim(0.5 * float(curve["probability"].min()), 1.0)


def _curve(axes: Axes, x: Array, curve: xr.Dataset) -> None:
    low, high = curve["probability_low"].values, curve["probability_high"].values
    confidence = 100.0 * float(curve.attrs["confidence"])
    axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
    axes.plot(
        x,
        curve["probability"].values,
        marker="o",
        markersize=2.5,
        color=INK,
        linewidth=0.9,
        label=f"subset simulation, {confidence:g} % interval",
    )
    if "rice_probability" in curve:
        style = series(2)
        axes.plot(x, curve["rice_probability"].values, **style, label="Rice's formula (local)")
    _plain(
        axes,
        x,
        curve,
        color=series(1)["color"],
        marker="s",
        markersize=3.0,
        label=f"plain Monte Carlo, {int(curve.attrs['plain_samples']):,} samples",
        zorder=3,
    )
    _decades(axes, curve)


def curve_figure(curve: xr.Dataset) -> Figure:
    """P(onset < s) over decades, against the stress and against the stress above the bound.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    """
    bounded = _has_bound(curve)
    with paper_style():
        figure = new_figure(PAGE if bounded else COLUMN * 1.2, 2.7)
        axes = figure.subplots(1, 2 if bounded else 1, sharey=True, squeeze=False)[0]
        _curve(axes[0], curve["stress"].values * 1e-6, curve)
        axes[0].set_xlabel(r"stress $s$ (MPa)")
        axes[0].set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        if bounded:
            bound = float(curve.attrs["lower_bound"]) * 1e-6
            axes[0].axvline(bound, color=QUIET, linewidth=0.7, linestyle=":")
            axes[0].annotate(
                "least strength",
                (bound, 0.97),
                xycoords=("data", "axes fraction"),
                xytext=(3, 0),
                textcoords="offset points",
                color=QUIET,
                fontsize=7.0,
                va="top",
            )
            _curve(axes[1], curve["stress_above_bound"].values * 1e-3, curve)
            axes[1].set_xscale("log")
            axes[1].set_xlabel("stress above the least strength (kPa)")
            panel(axes[0], "a")
            panel(axes[1], "b")
        axes[0].legend(loc="lower right")
    return figure


def weak_spot_figure(failing: xr.Dataset, nucleation_length: float, stress: float) -> Figure:
    """Profiles of failing samples, moved so that each begins to slide at the middle.

    Parameters
    ----------
    failing : Dataset
        `failing_profiles` of a `FailureProbability`.
    nucleation_length : float
        h_n, m; the unit of length.
    stress : float
        Pa.
    """
    if "y" in failing.dims:
        return plane_weak_spot_figure(failing, nucleation_length)
    x = failing["x"].values
    spacing = float(x[1] - x[0])
    middle = x.size // 2
    shown = np.stack(
        [
            np.roll(row, middle - round(float(at) / spacing))
            for row, at in zip(
                failing["strength"].values, failing["critical_position"].values, strict=True
            )
        ]
    )
    s = (np.arange(x.size) - middle) * spacing / nucleation_length
    near = np.abs(s) <= 4.0
    with paper_style():
        figure = new_figure(COLUMN * 1.2, 2.5)
        axes = figure.subplots()
        axes.axvspan(-0.5, 0.5, color=PALE, linewidth=0.0)
        axes.plot(s[near], shown.T[near] * 1e-6, color=QUIET, linewidth=0.4, alpha=0.7)
        axes.plot(s[near], shown.mean(axis=0)[near] * 1e-6, color=INK, label="mean of these")
        axes.axhline(stress * 1e-6, color=ACCENT, linewidth=0.9, label="stress")
        axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
        axes.set_ylabel("peak strength (MPa)")
        axes.set_xlim(-4.0, 4.0)
        axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")
    return figure


def tail_figure(study: TailStudy) -> Figure:
    """Failure curves by correlation length, by interface length and by the strength's lower end.

    Parameters
    ----------
    study : TailStudy
    """
    with paper_style():
        figure = new_figure(PAGE, 2.7)
        first, second, third = figure.subplots(1, 3, sharey=True)
        for i, (ratio, curve) in enumerate(study.correlation.items()):
            x, label = _tail_stress(curve)
            first.plot(x, curve["probability"].values, **series(i), label=f"{ratio:g}")
        first.set_xscale("log")
        first.set_xlabel(label)
        first.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        first.legend(title=r"$\xi_0/h_n$", title_fontsize=7.5)
        short, long = study.length[1], study.length[LONGER]
        for i, (curve, name) in enumerate(((short, "$L$"), (long, f"${LONGER} L$"))):
            x, _ = _tail_stress(curve)
            second.plot(x, curve["probability"].values, **series(i), label=name)
            style = {"color": series(i)["color"], "marker": "os"[i], "markersize": 2.5}
            _plain(second, x, curve, **style)
        second.plot(
            _tail_stress(short)[0],
            weakest_link(short["probability"].values, LONGER),
            color=ACCENT,
            linewidth=0.8,
            linestyle=":",
            label="weakest link",
        )
        second.set_xscale("log")
        second.set_xlabel(label)
        second.legend()
        for i, (name, curve) in enumerate(study.lower_end.items()):
            x = curve["stress"].values * 1e-6
            third.plot(x, curve["probability"].values, **series(i), label=name)
        third.set_xlabel("stress (MPa)\n")
        third.legend(loc="upper left", fontsize=6.5, handlelength=1.6, borderaxespad=0.1)
        _decades(first, short)
        for axes, letter in zip((first, second, third), "abc", strict=True):
            panel(axes, letter)
    return figure


def curve_table(curve: xr.Dataset) -> Table:
    """The failure curve as a table.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    """
    names = [
        ("stress", "stress (Pa)"),
        ("stress_above_bound", "above the bound (Pa)"),
        ("probability", "P"),
        ("probability_low", "low"),
        ("probability_high", "high"),
        ("coefficient_of_variation", "c.o.v."),
        ("plain_probability", "plain Monte Carlo"),
        ("rice_probability", "Rice's formula"),
    ]
    if not _has_bound(curve):  # then it says the stress again
        del names[1]
    present = [(name, title) for name, title in names if name in curve]
    rows = zip(*(curve[name].values.tolist() for name, _ in present), strict=True)
    titles = tuple(title for _, title in present)
    return Table.of("failure_curve", "Failure probability", titles, rows)


def tail_table(study: TailStudy) -> Table:
    """Stress above the bound at which each curve of a tail study reaches some probabilities."""
    wanted = np.array([1e-3, 1e-6, 1e-9])
    rows = []
    groups: tuple[tuple[str, Any], ...] = (
        ("xi_0/h_n = {:g}", study.correlation),
        ("length x {:g}", study.length),
        ("{}", study.lower_end),
    )
    for text, curves in groups:
        for key, curve in curves.items():
            chances = curve["probability"].values[::-1]
            found = np.interp(np.log(wanted), np.log(chances), curve["stress"].values[::-1])
            # The curve ends within a sample of the probability asked for; further is not known.
            found[wanted < 0.9 * chances[0]] = np.nan
            bound = float(curve.attrs["lower_bound"])
            rows.append((text.format(key), bound, *found.tolist()))
    columns = ("system", "bound (Pa)", *(f"stress at P = {p:g} (Pa)" for p in wanted))
    return Table.of("failure_tails", "Stress at small failure probabilities", columns, rows)
