"""Beyond the paper: sequences of arrested events where the strength has a wide range."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.studies.sequence import FACTOR
from stiction.plot.style import ACCENT, INK, PAGE, QUIET, color, new_figure, panel, series
from stiction.report.tables import Table
from stiction.statistics.estimates import share

name = "sequence"
number = "15"
title = "Event sequences and cascades"
needs: tuple[str, ...] = ("sequence", "interaction")


def caption(data: Data) -> str:
    """What is seen."""
    study = data["sequence"]
    return (
        f"Not in the paper: arrested events by equilibrium with {FACTOR:g} times the range of the"
        f" strength, {study.sizes['sample']} samples at xi_0/h_n ="
        f" {study.attrs['correlation_ratio']:g}; stress and slip are carried on from one event to"
        " the next. (a) The sequences of the samples with most events: load and length of each; the"
        " dot is global sliding. (b) Share of events with a larger moment. (c) Share of samples"
        " with an arrested event against the correlation length, with the paper's range of"
        " strength, by equilibrium (bars: one standard error): most frequent at half of h_n."
    )


def tables(data: Data) -> list[Table]:
    """Every event."""
    study = data["sequence"]
    rows = []
    for case in study["case"].values:
        at = study.sel(case=case)
        for sample, event in np.argwhere(np.isfinite(at["event_length"].values)):
            rows.append(
                (
                    str(case), int(sample), int(event),
                    *(float(at[key].values[sample, event]) for key in (
                        "event_stress", "event_position", "event_length", "event_moment")),
                )
            )  # fmt: skip
    return [
        Table.of(
            "figure-15-events",
            "Arrested events (Pa, m, m, N)",
            ("strength", "sample", "event", "stress", "position", "length", "moment"),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """Sequences, sizes, and arrest against correlation length."""
    figure = new_figure(PAGE, 2.7)
    some, sizes, arrest = figure.subplots(1, 3, width_ratios=(1.2, 1.0, 0.9))
    _sequences(some, data)
    _sizes(sizes, data)
    _arrest(arrest, data)
    for axes, letter in zip((some, sizes, arrest), "abc", strict=True):
        panel(axes, letter)
    return figure


def _sequences(axes: Axes, data: Data) -> None:
    study, setting = data["sequence"].isel(case=0), data.setting
    most = np.argsort(-study["arrested_events"].values, kind="stable")[:8]
    for row, sample in enumerate(most):
        stress = data.relative(study["event_stress"].values[sample])
        length = study["event_length"].values[sample] / setting.problem.nucleation_length
        last = float(data.relative(study["critical_stress"].values[sample]))
        axes.plot([np.nanmin(stress), last], [row, row], color=QUIET, linewidth=0.5, zorder=0)
        axes.scatter(
            stress, np.full(stress.size, row), s=10.0 * length, facecolors="none",
            edgecolors=color(1), linewidths=0.8,
        )  # fmt: skip
        axes.plot([last], [row], "o", color=ACCENT, markersize=4)
    axes.set_yticks([])
    axes.set_ylabel("eight samples")
    axes.set_xlabel(r"load $\tau_0/\langle\tau_\mathrm{p}\rangle$")


def _sizes(axes: Axes, data: Data) -> None:
    study = data["sequence"]
    for i, case in enumerate(study["case"].values):
        moment = study["event_moment"].sel(case=case).values
        moment = np.sort(moment[np.isfinite(moment)])
        axes.plot(
            moment, 1.0 - np.arange(moment.size) / max(moment.size, 1), label=str(case),
            **series(i),
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("moment of an event (N)")
    axes.set_ylabel("share of larger ones")
    axes.legend(loc="lower left")


def _arrest(axes: Axes, data: Data) -> None:
    events = data["interaction"]["arrested_events"]
    found = [share(events.sel(correlation_ratio=ratio).values > 0) for ratio in data.ratios]
    axes.errorbar(
        data.ratios, [100.0 * each.value for each in found],
        [100.0 * each.error for each in found], color=INK, marker="o", markersize=3.5, capsize=2,
    )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xticks(list(data.ratios), [f"{ratio:g}" for ratio in data.ratios])
    axes.minorticks_off()
    axes.set_ylim(bottom=0)
    axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    axes.set_ylabel("samples with an arrest (%)")
