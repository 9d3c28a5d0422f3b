"""Beyond the paper: the local criterion against exact equilibrium on the same samples."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import misplaced, overprediction
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, marker, new_figure, panel, series
from stiction.report.tables import Table
from stiction.statistics.densities import density
from stiction.statistics.estimates import mean, share, standard_deviation

name = "interaction"
number = "8"
title = "Local criterion against exact equilibrium"
needs: tuple[str, ...] = ("monte_carlo", "interaction")

DRAWN = 400
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


def caption(data: Data) -> str:
    """What is seen."""
    return (
        "Not in the paper: the onset of the same"
        f" {data.samples:,} samples at each correlation length by exact equilibrium, with every"
        " interaction between patches. (a) Density of the stress at the first instability by"
        " equilibrium (lines) and by the local criterion (thin grey lines). (b) By how much the"
        " local criterion is too high: median, quartiles, and 5 and 95 % points; the diamond is the"
        f" mean. (c) Position of onset by both, {min(DRAWN, data.samples)} samples at the shortest"
        " (filled) and the longest correlation length. (d) Share of samples that the local"
        " criterion puts more than half a nucleation length off. (e) Number of patches that slip at"
        " onset, mean and 5 to 95 % range. (f) Length of the critical patch, the same, in units of"
        " the nucleation length."
    )


def tables(data: Data) -> list[Table]:
    """Bias, scatter, misplaced onsets, patches, arrest."""
    rows = []
    for ratio in data.ratios:
        exact = data["interaction"].sel(correlation_ratio=ratio)
        gap = overprediction(data, ratio)
        bias, scatter = mean(gap), standard_deviation(gap)
        wrong = share(misplaced(data, ratio))
        arrested = share(exact["arrested_events"].values > 0)
        rows.append(
            (
                ratio,
                float(data.at(ratio)["first_instability"].mean()),
                float(exact["first_instability"].mean()),
                bias.value,
                bias.error,
                scatter.value,
                wrong.value,
                wrong.error,
                float(exact["slip_patches"].mean()),
                float(exact["critical_patch_length"].mean())
                / data.setting.problem.nucleation_length,
                arrested.value,
                float(exact["certificate_gap"].max()),
            )
        )
    return [
        Table.of(
            "figure-8-interaction",
            "Local criterion less exact equilibrium (stresses in Pa)",
            (
                "xi_0/h_n",
                "mean, local",
                "mean, exact",
                "bias",
                "its error",
                "scatter",
                "misplaced",
                "its error",
                "patches",
                "critical patch/h_n",
                "arrested",
                "largest gap of the certificates",
            ),
            rows,
        )
    ]


def draw(data: Data) -> Figure:
    """Stress above, places and patches below."""
    figure = new_figure(PAGE, 4.7)
    grid = figure.subplots(2, 3, width_ratios=(1.25, 1.0, 1.0))
    (stress, bias, place), (wrong, patches, length) = grid
    _densities(stress, data)
    _bias(bias, data)
    _positions(place, data)
    ratios = np.array(data.ratios)
    shares = [share(misplaced(data, ratio)) for ratio in ratios]
    wrong.errorbar(
        ratios,
        [100.0 * each.value for each in shares],
        [100.0 * each.error for each in shares],
        color=INK,
        marker="o",
        markersize=3.5,
    )
    wrong.set_ylim(bottom=0)
    wrong.set_ylabel("misplaced onsets (%)")
    exact = data["interaction"]
    _range(patches, ratios, [exact["slip_patches"].sel(correlation_ratio=r).values for r in ratios])
    patches.set_yscale("log")
    patches.set_yticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
    patches.set_ylabel("patches at onset")
    unit = data.setting.problem.nucleation_length
    _range(
        length,
        ratios,
        [exact["critical_patch_length"].sel(correlation_ratio=r).values / unit for r in ratios],
    )
    length.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    length.set_ylabel(r"critical patch$\,/h_\mathrm{n}$")
    for axes in (wrong, patches, length, bias):
        axes.set_xscale("log")
        axes.set_xlim(ratios[0] / 1.4, ratios[-1] * 1.4)
        axes.set_xticks(list(ratios), [f"{ratio:g}" for ratio in ratios])
        axes.minorticks_off()
        axes.set_xlabel(r"correlation length $\xi_0/h_\mathrm{n}$")
    for axes, letter in zip(grid.ravel(), "abcdef", strict=True):
        panel(axes, letter)
    return figure


def _densities(axes: Axes, data: Data) -> None:
    low, high = (bound / data.setting.mean for bound in data.setting.bounds)
    bounds = (low if np.isfinite(low) else None, high if np.isfinite(high) else None)
    for i, ratio in enumerate(data.ratios):
        local = data.at(ratio)["first_instability"].values
        exact = data["interaction"].sel(correlation_ratio=ratio)["first_instability"].values
        for values, style in (
            (local, {"color": QUIET, "linewidth": 0.7}),
            (exact, {**series(i), "label": f"{ratio:g}"}),
        ):
            estimate = density(data.relative(values), bounds=bounds)
            keep = estimate.value > 4e-3 * estimate.value.max()
            axes.plot(estimate.x[keep], estimate.value[keep], **style)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(r"first instability $\tau_\mathrm{cr}/\langle\tau_\mathrm{p}\rangle$")
    axes.set_ylabel(r"density $f(\tau_\mathrm{cr})$")
    axes.legend(title=r"$\xi_0/h_\mathrm{n}$", title_fontsize=7.5, handlelength=2.2)


def _bias(axes: Axes, data: Data) -> None:
    for i, ratio in enumerate(data.ratios):
        relative = 100.0 * overprediction(data, ratio) / data.setting.mean
        q = np.quantile(relative, LEVELS)
        shade = color(i)
        axes.plot([ratio, ratio], [q[0], q[4]], color=shade, linewidth=0.9)
        axes.plot([ratio, ratio], [q[1], q[3]], color=shade, linewidth=5.0, alpha=0.45)
        axes.plot([ratio], [q[2]], marker="_", color=shade, markersize=9)
        axes.plot([ratio], [relative.mean()], "D", color=shade, markersize=3.2)
    axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    axes.set_ylabel(
        r"$(\tau_\mathrm{cr}^\mathrm{local}-\tau_\mathrm{cr})/\langle\tau_\mathrm{p}\rangle$ (%)"
    )


def _positions(axes: Axes, data: Data) -> None:
    length = data.setting.problem.interface.extent
    axes.plot([0, 1], [0, 1], color=PALE, linewidth=0.8, zorder=0)
    for i in (0, len(data.ratios) - 1):
        ratio = data.ratios[i]
        local = data.at(ratio)["critical_position"].values[:DRAWN] / length
        exact = data["interaction"]["critical_position"].sel(correlation_ratio=ratio)
        axes.plot(
            exact.values[:DRAWN] / length,
            local,
            linestyle="none",
            marker=marker(i),
            color=color(i),
            markersize=2.4,
            markerfacecolor="none" if i else color(i),
            markeredgewidth=0.6,
            alpha=0.8,
            label=f"{ratio:g}",
        )
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.legend(title=r"$\xi_0/h_\mathrm{n}$", title_fontsize=7.5, handlelength=1.0)
    axes.set_xlabel(r"$x_\mathrm{cr}/L$, exact")
    axes.set_ylabel(r"$x_\mathrm{cr}/L$, local")


def _range(axes: Axes, ratios: np.ndarray, samples: list[np.ndarray]) -> None:
    means = np.array([each.mean() for each in samples])
    low, high = (np.array([np.quantile(each, q) for each in samples]) for q in (0.05, 0.95))
    axes.fill_between(ratios, low, high, color=color(1), alpha=0.18, linewidth=0)
    axes.plot(ratios, means, color=color(1), marker="o", markersize=3.5)
