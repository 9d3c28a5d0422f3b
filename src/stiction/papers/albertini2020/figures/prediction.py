"""Figure 4: static predictions against elastodynamic ruptures."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import displaced, shift_of
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, marker, new_figure, panel
from stiction.report.tables import Table
from stiction.statistics.estimates import mean

name = "prediction"
number = "4"
title = "Theory against simulation"
needs: tuple[str, ...] = ("representative", "ruptures")

PREDICTIONS = ("local", "printed", "exact")


def caption(data: Data) -> str:
    """What is seen."""
    runs = data["ruptures"]
    ratios = ", ".join(f"{ratio:g}" for ratio in data.setting.simulated_ratios)
    return (
        "(a) Strength of the rupture in Figure 3 (thin) and its nucleation stress (thick); the dot"
        " is the predicted onset, the cross the simulated one. (b) Critical stress by the local"
        f" criterion against elastodynamics, {runs.sizes['sample']} ruptures at each of"
        f" xi_0/h_n = {ratios}, loaded at {runs.attrs['loading_rate']:g} Pa/s. (c) Position of"
        " onset predicted with the printed modulus against elastodynamics; rings mark those more"
        " than h_n/2 off, as counted in the table. (d) Error of each prediction of the critical"
        " stress, one dot a rupture, with its mean."
    )


def tables(data: Data) -> list[Table]:
    """Every rupture, and the errors of the predictions."""
    runs = data["ruptures"]
    rows, errors = [], []
    for ratio in data.setting.simulated_ratios:
        at = runs.sel(correlation_ratio=ratio)
        keys = ("number", "critical_stress", "local_critical_stress", "printed_critical_stress",
                "exact_first_instability", "critical_position", "local_critical_position",
                "exact_critical_position", "arrested_events", "rupture_speed")  # fmt: skip
        for row in zip(*(at[key].values.tolist() for key in keys), strict=True):
            rows.append((ratio, *row))
        for prediction in PREDICTIONS:
            shift = shift_of(data, ratio, prediction)
            wrong = int(displaced(data, ratio, prediction).sum())
            bias = mean(shift).scaled(100.0)
            errors.append(
                (ratio, prediction, bias.value, bias.error, 100.0 * float(shift.std()), wrong)
            )
    return [
        Table.of(
            "figure-4-errors",
            "Errors of the predictions of tau_cr (per cent) and misplaced onsets",
            ("xi_0/h_n", "prediction", "mean error", "its error", "scatter", "misplaced"),
            errors,
        ),
        Table.of(
            "figure-4-ruptures",
            "Every rupture (Pa, m, m/s)",
            ("xi_0/h_n", "sample", "tau_cr", "local", "local, printed modulus", "equilibrium",
             "x_cr", "x_cr local", "x_cr equilibrium", "arrested events", "largest front speed"),
            rows,
        ),
    ]  # fmt: skip


def draw(data: Data) -> Figure:
    """Profile on top, three comparisons below."""
    figure = new_figure(PAGE, 4.6)
    grid = figure.add_gridspec(2, 3, height_ratios=(0.8, 1.15), width_ratios=(1.0, 1.0, 1.05))
    profile = figure.add_subplot(grid[0, :])
    stress, place, errors = (figure.add_subplot(grid[1, column]) for column in range(3))
    _profile(profile, data)
    _stress(stress, data)
    _place(place, data)
    _errors(errors, data)
    for axes, letter in zip((profile, stress, place, errors), "abcd", strict=True):
        panel(axes, letter)
    return figure


def _profile(axes: Axes, data: Data) -> None:
    run, interface = data["representative"], data.setting.problem.interface
    x = interface.x / interface.extent
    tau_n = data.relative(run["nucleation_stress"].values)
    axes.plot(
        x, data.relative(run["peak_strength"].values), color=QUIET, linewidth=0.7,
        label=r"$\tau_\mathrm{p}$",
    )  # fmt: skip
    axes.plot(x, tau_n, color=color(1), linewidth=1.6, label=r"$\tau_\mathrm{n}$")
    lowest = int(tau_n.argmin())
    axes.plot([x[lowest]], [tau_n[lowest]], "o", color=INK, markersize=5, zorder=5)
    axes.plot(
        [float(run["critical_position"]) / interface.extent],
        [float(data.relative(run["critical_stress"].values))],
        "x", color=color(2), markersize=7, markeredgewidth=1.6, zorder=6,
    )  # fmt: skip
    axes.set_xlim(0, 1)
    axes.set_xlabel("position $x/L$")
    axes.set_ylabel(r"stress $/\,\langle\tau_\mathrm{p}\rangle$")
    axes.legend(loc="upper right", ncols=2, borderaxespad=0.0)


def _stress(axes: Axes, data: Data) -> None:
    everything = []
    for i, ratio in enumerate(data.setting.simulated_ratios):
        at = data["ruptures"].sel(correlation_ratio=ratio)
        found = data.relative(at["critical_stress"].values)
        style: dict[str, Any] = {"linestyle": "none", "color": color(i), "markersize": 3.6}
        printed, local, exact = (
            data.relative(at[key].values)
            for key in ("printed_critical_stress", "local_critical_stress",
                        "exact_first_instability")
        )  # fmt: skip
        axes.plot(found, printed, **style, marker=marker(i), alpha=0.22, markeredgewidth=0)
        axes.plot(found, local, **style, marker=marker(i), markerfacecolor="none")
        axes.plot(found, exact, **{**style, "markersize": 2.6}, marker="x", markeredgewidth=0.7)
        everything += [found, printed]
    _diagonal(axes, np.concatenate(everything))
    axes.set_xlabel(r"$\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$, simulated")
    axes.set_ylabel(r"$\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$, predicted")
    handles = [
        axes.plot([], [], marker(i), color=color(i), markerfacecolor="none", label=f"{ratio:g}")[0]
        for i, ratio in enumerate(data.setting.simulated_ratios)
    ]
    kinds: tuple[tuple[str, dict[str, Any]], ...] = (
        ("plane state's $G^*$", {"marker": "o", "markerfacecolor": "none", "color": INK}),
        ("printed $G^*$", {"marker": "o", "color": INK, "alpha": 0.3, "markeredgewidth": 0}),
        ("equilibrium", {"marker": "x", "color": INK, "markersize": 3}),
    )
    for label, style in kinds:
        handles += axes.plot([], [], linestyle="none", label=label, **style)
    axes.legend(
        handles=handles, title=r"$\xi_0/h_\mathrm{n}$; by", title_fontsize=6.5, fontsize=6.2,
        loc="upper left", handlelength=1, labelspacing=0.25, borderaxespad=0.0,
    )  # fmt: skip


def _diagonal(axes: Axes, values: np.ndarray) -> None:
    low, high = values.min(), values.max()
    room = 0.05 * (high - low)
    limits = (low - room, high + room)
    axes.plot(limits, limits, color=PALE, linewidth=0.9, zorder=0)
    axes.set_xlim(limits)
    axes.set_ylim(limits)


def _place(axes: Axes, data: Data) -> None:
    length = data.setting.problem.interface.extent
    axes.plot([0, 1], [0, 1], color=PALE, linewidth=0.9, zorder=0)
    for i, ratio in enumerate(data.setting.simulated_ratios):
        at = data["ruptures"].sel(correlation_ratio=ratio)
        found = at["critical_position"].values / length
        local = at["printed_critical_position"].values / length
        wrong = displaced(data, ratio, "printed")
        axes.plot(
            found, local, linestyle="none", marker=marker(i), color=color(i), markersize=3.4,
            markerfacecolor="none",
        )  # fmt: skip
        axes.plot(
            found[wrong], local[wrong], "o", markersize=9, markerfacecolor="none",
            markeredgecolor=color(2), markeredgewidth=0.8,
        )  # fmt: skip
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.set_xlabel(r"$x_\mathrm{cr}/L$, simulated")
    axes.set_ylabel(r"$x_\mathrm{cr}/L$, predicted")


def _errors(axes: Axes, data: Data) -> None:
    generator = np.random.default_rng(0)
    ratios = data.setting.simulated_ratios
    largest = 0.0
    for j, prediction in enumerate(PREDICTIONS):
        for i, ratio in enumerate(ratios):
            shift = 100.0 * shift_of(data, ratio, prediction)
            at = j + 0.26 * (i - 0.5 * (len(ratios) - 1))
            spread = at + 0.07 * generator.uniform(-1.0, 1.0, shift.size)
            axes.plot(
                spread, shift, marker(i), color=color(i), markersize=2.2, alpha=0.5,
                markeredgewidth=0,
            )  # fmt: skip
            axes.plot([at - 0.11, at + 0.11], [shift.mean()] * 2, color=color(i), linewidth=1.8)
            largest = max(largest, float(np.quantile(shift, 0.97)))
    axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    # A rupture that equilibrium holds arrested and inertia does not may lie far out.
    axes.set_ylim(-0.35 * largest, 1.15 * largest)
    axes.set_xticks(range(3), ["local", "printed $G^*$", "exact"])
    axes.set_ylabel("predicted less simulated (%)")
