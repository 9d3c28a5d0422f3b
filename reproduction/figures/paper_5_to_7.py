"""Figures 5 to 7 of the paper: the Monte Carlo study, and the variance of tau_n."""

import numpy as np

import stiction as st
from reproduction import setting
from reproduction.claims import Data
from reproduction.figures.style import (
    COLOURS,
    GREY,
    INK,
    MEAN_P,
    OVER_MEAN,
    RED,
    XI,
    letter,
    letters,
    line,
    new,
    numbers,
    ratio_axis,
    thin,
)
from reproduction.numbers_with_errors import mean, quantile
from reproduction.setting import (
    DEVIATION,
    HIGH,
    LOW,
    MEAN,
    PROBLEM,
    RATIOS,
    SIMULATED,
    L,
    strength,
)
from reproduction.statements_onset import dynamic_mean


def figure_5(d: Data):
    """Draw strength, nucleation stress and onset at four correlation lengths."""
    figure = new(8.4)
    grid = figure.add_gridspec(4, 1, height_ratios=(1.1, 1.0, 1.0, 0.7))
    rows = [grid[i].subgridspec(1, 3, width_ratios=(4, 1, 1.2), wspace=0.04) for i in (0, 1)]
    upper = [figure.add_subplot(rows[0][i]) for i in range(3)]
    lower = [figure.add_subplot(rows[1][i]) for i in range(3)]
    x = PROBLEM.interface.x / L
    s = np.linspace(LOW, HIGH, 300)
    law = setting.MARGINAL.distribution.pdf(s) * MEAN
    upper[1].plot(law, s / MEAN, color=INK)
    for ratio in RATIOS:
        field = strength(ratio)
        draws = field.draws(PROBLEM.interface, 1, 0)  # one draw, as in the paper's (a) and (b)
        tau_p = field.profiles(PROBLEM.interface, draws)
        upper[0].plot(x, tau_p[0] / MEAN, **line(ratio), lw=0.9, label=f"{ratio:g}")
        lower[0].plot(
            x, st.theory.nucleation_stress(PROBLEM, tau_p)[0] / MEAN, **line(ratio), lw=0.9
        )
        least = st.statistics.density(
            d.at("moments", "weakest_strength", ratio), bounds=(LOW, HIGH)
        )
        upper[2].plot(least.value / least.value.max(), least.x / MEAN, **line(ratio))
        counts = d.at("moments", "counts", ratio).reshape(-1, 32).sum(axis=1)
        edges = np.linspace(LOW, HIGH, counts.size + 1)
        centre = 0.5 * (edges[1:] + edges[:-1])
        density = counts / counts.sum() / (edges[1] - edges[0]) * MEAN
        lower[1].plot(density, centre / MEAN, **line(ratio))
    for axes, (low, high) in ((upper, (0.62, 1.72)), (lower, (0.62, 1.42))):
        for one in axes:
            one.set_ylim(low, high)
        thin(axes[1])
        thin(axes[2])
    upper[0].set(ylabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", xlim=(0, 1))
    upper[0].legend(title=XI, loc="upper center", ncols=4, columnspacing=0.9)
    upper[0].set_ylim(0.62, 2.1)
    upper[1].set_ylim(0.62, 2.1)
    upper[2].set_ylim(LOW / MEAN, 0.74)
    upper[2].yaxis.tick_right()
    upper[2].tick_params(labelright=True)
    upper[2].set_yticks((0.68, 0.70, 0.72))
    upper[1].set_title(r"$f(\tau_\mathrm{p})$")
    upper[2].set_title(r"$f(\min\tau_\mathrm{p})$")
    lower[0].set(ylabel=rf"$\tau_\mathrm{{n}}{OVER_MEAN}", xlabel="$x/L$", xlim=(0, 1))
    lower[1].set_title(r"$f(\tau_\mathrm{n})$")
    lower[2].axis("off")
    letter(upper[0], "a", x=-0.12)
    letter(lower[0], "b", x=-0.12)
    stress, place = figure.add_subplot(grid[2]), figure.add_subplot(grid[3])
    for ratio in RATIOS:
        found = st.statistics.density(d.stress(ratio), bounds=(LOW, HIGH))
        stress.plot(found.x / MEAN, found.value * MEAN, **line(ratio))
        share, edges = np.histogram(d.at("local", "critical_position", ratio) / L, 20, (0, 1))
        share = share / d.size.samples * 20
        place.stairs(share, edges, baseline=None, color=line(ratio)["color"],
                     lw=0.9)  # fmt: skip
    error = np.sqrt(20.0 / d.size.samples)
    place.axhspan(1 - 2 * error, 1 + 2 * error, color="#eeeeee", lw=0, zorder=0)
    stress.axvline(LOW / MEAN, color=GREY, lw=0.8, ls=":")
    stress.set(xlim=(0.655, 0.88), ylim=(0, None), xlabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN}",
               ylabel=rf"$f(\tau_\mathrm{{cr}})\,${MEAN_P}")  # fmt: skip
    place.set(xlim=(0, 1), ylim=(0, 1.5), xlabel=r"$x_\mathrm{cr}/L$",
              ylabel=r"$f(x_\mathrm{cr})\,L$")  # fmt: skip
    letter(stress, "c", x=-0.12)
    letter(place, "d", x=-0.12)
    return figure


_PLACES = np.array([-3.2, *np.log2(RATIOS), 2.2])
"""Places on the axis: zero, the correlation lengths on a logarithm, and infinity."""


def _statistics(axes, found, ends) -> None:
    """Draw mean, median and lower quartile; `ends` are those at zero and at infinity."""
    x = _PLACES[1:-1]
    styles = (("mean", "-", "o", COLOURS[0]), ("median", "--", "s", COLOURS[1]),
              ("25 % quantile", ":", "^", COLOURS[2]))  # fmt: skip
    for i, (name, dashes, marker, colour) in enumerate(styles):
        row = [each[i].value for each in found]
        style = {"color": colour, "ls": dashes, "marker": marker, "label": name}
        numbers(axes, x, [each[i] for each in found], **style)
        axes.plot(_PLACES[:2], [ends[0][i], row[0]], color=colour, ls=(0, (1, 2)), lw=0.9)
        axes.plot(_PLACES[-2:], [row[-1], ends[1][i]], color=colour, ls=(0, (1, 2)), lw=0.9)
        axes.plot(_PLACES[[0, -1]], [ends[0][i], ends[1][i]], marker, color=colour, ms=4,
                  mfc="white", ls="none")  # fmt: skip
    labels = ("0", *(f"{ratio:g}" for ratio in RATIOS), r"$\infty$")
    axes.set_xticks(_PLACES, labels)
    for place in (-2.6, 1.6):
        axes.text(place, 0, "//", transform=axes.get_xaxis_transform(), ha="center", va="center",
                  fontsize=9)  # fmt: skip
    axes.set_xlabel(XI)


def figure_6(d: Data):
    """Draw mean, median and lower quartile of tau_n and of tau_cr."""
    figure = new(6.4)
    grid = figure.add_gridspec(2, 1, height_ratios=(0.85, 1.3))
    top, bottom = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    law = setting.MARGINAL.distribution
    edges = np.linspace(LOW, HIGH, d["moments"].sizes["cell"] + 1)
    found = []
    for ratio in RATIOS:
        counts = (
            np.cumsum(d.at("moments", "counts", ratio)) / d.at("moments", "counts", ratio).sum()
        )
        shift = d.at("moments", "powers", ratio)[:, 0]
        quantiles = [np.interp(p, counts, edges[1:]) / MEAN for p in (0.5, 0.25)]
        found.append((mean(1.0 + shift), *(mean(np.array([q, q])) for q in quantiles)))
    own = [1.0, law.ppf(0.5) / MEAN, law.ppf(0.25) / MEAN]
    _statistics(top, found, ([1.0, 1.0, 1.0], own))
    top.set(ylabel=rf"$\tau_\mathrm{{n}}{OVER_MEAN}")
    top.legend(loc="lower left")
    letter(top, "a", x=-0.12)
    found = [
        tuple(number * (1 / MEAN) for number in (mean(v), quantile(v, 0.5), quantile(v, 0.25)))
        for v in (d.stress(ratio) for ratio in RATIOS)
    ]
    low = LOW / MEAN
    _statistics(bottom, found, ([1.0, 1.0, 1.0], [low, low, low]))
    bottom.set(ylabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN}", ylim=(0.63, 1.03))
    bottom.axhline(low, color=GREY, lw=0.8, ls=":")
    places = np.log2(SIMULATED)
    raw = [mean(d.stress(ratio, "ruptures") / MEAN) for ratio in SIMULATED]
    inset = bottom.inset_axes((0.42, 0.46, 0.56, 0.52))
    for axes in (bottom, inset):
        axes.errorbar(places, [n.value for n in raw],
                      [2 * d.stress(r, "exact").std() / MEAN / np.sqrt(d.size.ruptures)
                       for r in SIMULATED], fmt="D", color=RED, mfc="none", ms=6, lw=0.8,
                      label=f"{d.size.ruptures} ruptures each")  # fmt: skip
    best = [dynamic_mean(d, ratio) * (1 / MEAN) for ratio in SIMULATED]
    inset.plot(np.log2(RATIOS), [n[0].value for n in found], "-o", color=COLOURS[0], ms=4)
    inset.plot(places, [n.value for n in best], "x", color=RED, ms=7)
    ratio_axis(inset)
    inset.set(xlabel="", ylabel="mean", xlim=(-2.4, 1.4))
    bottom.legend(*_chosen(bottom, 1), loc="lower left")
    letter(bottom, "b", x=-0.12)
    return figure


def _chosen(axes, count: int):
    handles, labels = axes.get_legend_handles_labels()
    return handles[-count:], labels[-count:]


def figure_7(d: Data):
    """Draw correlation, eigenfunction and the variance of tau_n."""
    figure = new(5.4)
    axes = figure.subplots(2, 2)
    theory = d["theory"]
    lag = theory["x"].values / L
    for ratio in RATIOS:
        axes[0, 0].plot(lag, theory["correlation"].sel(correlation_ratio=ratio), **line(ratio),
                        label=f"{ratio:g}")  # fmt: skip
    axes[0, 0].set(xlim=(0, 0.12), xlabel=r"$\xi/L$", ylabel=r"$C(\xi)$")
    axes[0, 0].legend(title=XI)
    s = np.linspace(-1, 1, 200)
    axes[0, 1].plot(s, (0.925 - 0.308 * s**2) * np.sqrt(1 - s**2), color=COLOURS[0])
    axes[0, 1].set(xlabel="$s$", ylabel="$v_0(s)$", ylim=(0, None))
    ratio, value = theory["ratio"].values, theory["infinite"].values
    slope = value[0] / ratio[0]
    for panel, (low, high) in ((axes[1, 0], (0, 8)), (axes[1, 1], (0, 1))):
        near = (ratio <= high * 1.3) & (ratio >= low)
        panel.plot(ratio[near], value[near], color=COLOURS[0], label="infinite interface")
        shown = theory["usable"].values
        panel.plot(shown[shown <= high], theory["periodic"].values[shown <= high], "--",
                   color=COLOURS[1], label="this interface")  # fmt: skip
        panel.plot([0, 1.0 / slope], [0, 1.0], ":", color=RED, label=rf"{slope:.2f} {XI}")
        for one in RATIOS:
            if one <= high:
                spread = d.at("moments", "powers", one)
                sampled = spread[:, 1].mean() - spread[:, 0].mean() ** 2
                panel.plot(one, sampled * (MEAN / DEVIATION) ** 2, "o", color=INK, ms=4)
        panel.set(xlim=(0, high), xlabel=XI, ylim=(0, 1.02))
    axes[1, 0].set_ylabel(r"Var[$\tau_\mathrm{n}$]/Var[$\tau_\mathrm{p}$]")
    axes[1, 0].axhline(1.0, color=GREY, lw=0.8, ls="--")
    axes[1, 0].legend(loc="lower right")
    letters(axes.flat, x=-0.25)
    return figure
