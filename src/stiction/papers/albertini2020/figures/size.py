"""Beyond the paper: size of the interface, of the scatter, normal pressure and failure."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.claims.measures import pairs
from stiction.papers.albertini2020.claims.size import QUOTED_VARIATION
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import required_width
from stiction.papers.albertini2020.studies.summary import estimates
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, new_figure, panel, series
from stiction.report.tables import Table

name = "size"
number = "14"
title = "Size of the interface and of the scatter"
needs: tuple[str, ...] = ("monte_carlo", "size", "pressure", "failure")

WIDTHS = (1.0, 1.5, 2.0, 2.9)


def caption(data: Data) -> str:
    """What is seen."""
    study = data["size"]
    return (
        "Not in the paper: (a) coefficient of variation of the critical stress, which is that of"
        " the static friction coefficient at any pressure, against the length of the interface at"
        f" xi_0/h_n = {study.attrs['correlation_ratio']:g}, for strengths whose deviations from the"
        f" mean are {', '.join(f'{w:g}' for w in WIDTHS)} times the paper's; dashed: that of the"
        " experiments it quotes, 0.32 to 0.80, if this spans four standard deviations. (b)"
        " Coefficient of variation of the strength that it takes to get there; the paper's is the"
        " dotted line, and above 0.6 some places would have no strength. (c) Friction coefficient"
        " against normal pressure with a residual strength and Coulomb's law at every point, mean"
        " and quartiles (left), and length of the critical patch over that at the usual pressure"
        " (right, triangles; line: h_n). (d) Failure probability against stress, with 95 %"
        " intervals; dots: counted."
    )


def tables(data: Data) -> list[Table]:
    """What is drawn."""
    study, failure = data["size"], data["failure"]
    lengths = zip(
        study["length_factor"].values.tolist(),
        *(study[key].values.tolist() for key in ("mean", "standard_deviation", "lower_spread",
                                                 "joined_distance")),
        strict=True,
    )  # fmt: skip
    pressure = data["pressure"]
    rows = zip(
        pressure["pressure"].values.tolist(),
        *(pressure[key].values.tolist() for key in ("mean", "standard_deviation", "patch_length",
                                                    "nucleation_length")),
        strict=True,
    )  # fmt: skip
    curve = zip(
        *(failure[key].values.tolist() for key in ("stress", "probability", "probability_low",
                                                   "probability_high", "plain_probability")),
        strict=True,
    )  # fmt: skip
    return [
        Table.of(
            "figure-14-length",
            "Critical stress against the length of the interface (Pa)",
            ("L over the usual", "mean", "st. dev.", "median less lower quartile",
             "KS distance from the weakest of independent pieces"),
            lengths,
        ),
        Table.of(
            "figure-14-pressure",
            "Friction coefficient against pressure, and critical patch (m)",
            ("pressure over the usual", "mean", "st. dev.", "critical patch", "h_n"),
            rows,
        ),
        Table.of(
            "figure-14-failure",
            "Failure probability",
            ("stress (Pa)", "probability", "lower", "upper", "counted"),
            curve,
        ),
    ]  # fmt: skip


def draw(data: Data) -> Figure:
    """Scatter, what it takes, pressure, failure."""
    figure = new_figure(PAGE, 4.6)
    (variation, needed), (pressure, failure) = figure.subplots(2, 2)
    _variation(variation, data)
    _needed(needed, data)
    _pressure(pressure, data)
    _failure(failure, data)
    for axes, letter in zip((variation, needed, pressure, failure), "abcd", strict=True):
        panel(axes, letter)
    return figure


def _lengths(data: Data) -> np.ndarray:
    problem = data.setting.problem
    unit = problem.interface.extent / problem.nucleation_length
    found: np.ndarray = data["size"]["length_factor"].values * unit
    return found


def _variation(axes: Axes, data: Data) -> None:
    study = data["size"]
    mean = np.array([each.value for each in estimates(study, "mean")]) / data.setting.mean
    spread = study["standard_deviation"].values / data.setting.mean
    for i, width in enumerate(WIDTHS):
        axes.plot(
            _lengths(data), width * spread / (1.0 + width * (mean - 1.0)), label=f"{width:g}",
            **series(i, marker=True), markersize=3.2,
        )  # fmt: skip
    axes.axhline(QUOTED_VARIATION, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(r"length of the interface $L/h_\mathrm{n}$")
    axes.set_ylabel(r"coefficient of variation of $\mu_\mathrm{s}$")
    axes.set_ylim(bottom=6e-3)
    axes.legend(title="width of the strength", title_fontsize=7.5, ncols=4, handlelength=1.6,
                loc="lower left", columnspacing=0.8)  # fmt: skip


def _needed(axes: Axes, data: Data) -> None:
    factors = data["size"]["length_factor"].values
    found = [required_width(data, float(f), QUOTED_VARIATION) for f in factors]
    axes.plot(_lengths(data), [each[0] for each in found], "o-", color=color(1), markersize=3.2)
    axes.axhline(found[0][1], color=QUIET, linewidth=0.9, linestyle=(0, (1, 2)))
    axes.axhspan(0.6, 10.0, color=PALE, alpha=0.5, linewidth=0)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.15 * max(each[0] for each in found))
    axes.set_xlabel(r"length of the interface $L/h_\mathrm{n}$")
    axes.set_ylabel("variation of the strength needed")


def _pressure(axes: Axes, data: Data) -> None:
    study = data["pressure"]
    pressure = study["pressure"].values
    q = study["quantile_value"].values
    axes.fill_between(pressure, q[:, 1], q[:, 3], color=color(1), alpha=0.2, linewidth=0)
    axes.plot(pressure, study["mean"].values, "o-", color=color(1), markersize=3.2)
    axes.set_xscale("log")
    axes.set_xticks(list(pressure), [f"{p:g}" for p in pressure])
    axes.minorticks_off()
    axes.set_xlabel("normal pressure over the usual")
    axes.set_ylabel(r"friction coefficient $\mu_\mathrm{s}$")
    right = axes.twinx()
    right.spines["right"].set_visible(True)
    unit = data.setting.problem.nucleation_length
    length = [each.value / unit for each in pairs(study, "patch_length")]
    right.plot(pressure, length, "^", color=color(2), markersize=4)
    right.plot(pressure, study["nucleation_length"].values / unit, color=color(2), linewidth=0.9)
    right.set_yscale("log")
    right.set_yticks([0.3, 0.5, 1.0, 2.0], ["0.3", "0.5", "1", "2"])
    right.minorticks_off()
    right.set_ylabel(r"critical patch$\,/h_\mathrm{n}$", color=color(2))


def _failure(axes: Axes, data: Data) -> None:
    study = data["failure"]
    stress = data.relative(study["stress"].values)
    axes.fill_between(
        stress, study["probability_low"].values, study["probability_high"].values,
        color=color(1), alpha=0.2, linewidth=0,
    )  # fmt: skip
    axes.plot(stress, study["probability"].values, color=color(1))
    axes.plot(stress, study["plain_probability"].values, "o", color=INK, markersize=3)
    axes.set_yscale("log")
    axes.set_xlabel(r"stress$\,/\langle\tau_\mathrm{p}\rangle$")
    axes.set_ylabel(r"$P(\tau_\mathrm{cr} < \tau)$")
