"""Beyond the paper: fronts arrested by a load that is not uniform, and Griffith's lengths."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.studies.driving import cases, curve, problem_of
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, color, new_figure, panel, series
from stiction.report.tables import Table

name = "driving"
number = "12"
title = "Fronts arrested by non-uniform driving"
needs: tuple[str, ...] = ("driving",)


def caption(data: Data) -> str:
    """What is seen."""
    study = data["driving"]
    samples = study.sizes["sample"]
    return (
        "Not in the paper, which says that systematic non-uniformity of the driving force arrests"
        " fronts: (a) the load profiles, mean one. (b, c) Length of each arrested patch against the"
        f" load, {samples} samples at xi_0/h_n = {study.attrs['correlation_ratio']:g} with a"
        " residual strength of 0.6 of the weakest: by equilibrium (dots), the first one of each"
        " sample with inertia at 1.005 times that load (crosses), and where G falls to the mean"
        " fracture energy by Bueckner's weights (line). (d) Length with inertia, and by"
        " equilibrium, over Griffith's, first events under the edge load. A crack as long as the"
        " interface is one that was not arrested."
    )


def tables(data: Data) -> list[Table]:
    """Every arrested event that is kept."""
    study = data["driving"]
    rows = []
    for case in study["case"].values:
        at = study.sel(case=case)
        for sample, event in np.argwhere(np.isfinite(at["event_length"].values)):
            numbers = [
                float(at[key].values[sample, event])
                for key in ("event_stress", "event_length", "griffith_length", "event_moment")
            ]
            dynamic = float(at["dynamic_length"].values[sample]) if event == 0 else None
            rows.append((str(case), int(sample), int(event), *numbers, dynamic))
    return [
        Table.of(
            "figure-12-events",
            "Arrested events (Pa, m, m, N, m)",
            ("load", "sample", "event", "stress", "length", "Griffith", "moment", "with inertia"),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """Profiles, two clouds of events, and ratios."""
    figure = new_figure(PAGE, 4.4)
    (profile, edge), (gradient, ratio) = figure.subplots(2, 2)
    setting = data.setting
    for i, (case, load) in enumerate(cases(setting).items()):
        interface = problem_of(setting, load).interface
        x = interface.x / interface.extent
        values = np.broadcast_to(load.profile_on(interface), x.shape)
        profile.plot(x, values, label=case, **series(i))
    profile.set_xlim(0, 1)
    profile.set_ylim(bottom=0)
    profile.set_xlabel("position $x/L$")
    profile.set_ylabel(r"load $\tau_0(x)/\langle\tau_0\rangle$")
    profile.legend()
    for axes, case in ((edge, "edge"), (gradient, "gradient")):
        _events(axes, data, case)
    _ratios(ratio, data)
    for axes, letter in zip((profile, edge, gradient, ratio), "abcd", strict=True):
        panel(axes, letter)
    return figure


def _events(axes: Axes, data: Data, case: str) -> None:
    setting, at = data.setting, data["driving"].sel(case=case)
    unit = setting.problem.nucleation_length
    stress, length = at["event_stress"].values / setting.mean, at["event_length"].values / unit
    axes.plot(
        stress.ravel(), length.ravel(), "o", color=color(1), markersize=2.6, alpha=0.7,
        markeredgewidth=0, label="equilibrium",
    )  # fmt: skip
    axes.plot(
        1.005 * stress[:, 0], at["dynamic_length"].values / unit, "x", color=ACCENT, markersize=4.5,
        label="with inertia",
    )  # fmt: skip
    found = stress[np.isfinite(stress)]
    if found.size:
        loads = np.linspace(0.97 * found.min(), 1.03 * found.max(), 80)
        line = curve(setting, case, loads * setting.mean) / unit
        axes.plot(loads, np.where(np.isfinite(line), line, np.nan), color=INK, label="Griffith")
    axes.axhline(setting.problem.interface.extent / unit, color=PALE, linewidth=0.8, zorder=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(r"load $\tau_0/\langle\tau_\mathrm{p}\rangle$")
    axes.set_ylabel(r"arrested patch$\,/h_\mathrm{n}$")
    axes.legend(title=case, title_fontsize=7.5)


def _ratios(axes: Axes, data: Data) -> None:
    at = data["driving"].sel(case="edge")
    griffith = at["griffith_length"].values[:, 0]
    for values, label, symbol, shade in (
        (at["event_length"].values[:, 0], "equilibrium", "o", color(1)),
        (at["dynamic_length"].values, "with inertia", "x", ACCENT),
    ):
        ratio = np.sort((values / griffith)[np.isfinite(values / griffith)])
        rank = (np.arange(ratio.size) + 0.5) / max(ratio.size, 1)
        axes.plot(ratio, rank, symbol, color=shade, markersize=4, label=label)
    axes.axvline(1.0, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
    axes.set_xlim(left=0)
    axes.set_ylim(0, 1)
    axes.set_xlabel("first arrested length over Griffith's")
    axes.set_ylabel("share of samples below")
    axes.legend(loc="upper left")
