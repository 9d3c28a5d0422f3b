"""Figures 1 to 4 of the paper: problem, random field, one rupture, theory against simulation."""

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from scipy.stats import norm

from reproduction import setting
from reproduction.claims import Data
from reproduction.figures.style import (
    COLOURS,
    GREY,
    INK,
    MEAN_P,
    OVER_MEAN,
    PALE,
    RED,
    TAU_CR,
    XI,
    dots,
    letter,
    new,
)
from reproduction.setting import HIGH, LOW, MEAN, PROBLEM, SIMULATED, H, L
from reproduction.statements_onset import offsets


def figure_1(d: Data):
    """Draw the system, the load, the friction law, and one field with its statistics."""
    figure = new(6.2)
    grid = figure.add_gridspec(3, 4, height_ratios=(1.0, 1.0, 1.15))
    _system(figure.add_subplot(grid[0, :]))
    _load(figure.add_subplot(grid[1, :2]))
    _law(figure.add_subplot(grid[1, 2:]))
    bottom = grid[2, :].subgridspec(1, 2, width_ratios=(3.2, 1.0), wspace=0.0)
    field, density = (figure.add_subplot(bottom[i]) for i in (0, 1))
    tau_p, x = d["representative"]["strength"].values / MEAN, PROBLEM.interface.x / L
    field.plot(x, tau_p, color=COLOURS[0], lw=0.9)
    field.set(xlabel=r"$x/L$", ylabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", xlim=(0, 1),
              ylim=(0.6, 2.9))  # fmt: skip
    letter(field, "d", x=-0.1)
    inset = field.inset_axes((0.3, 0.68, 0.66, 0.32))
    lag = PROBLEM.interface.x / H
    for name, style in (("correlation", "-"), ("gaussian_correlation", ":")):
        inset.plot(lag, d["theory"][name].sel(correlation_ratio=0.25), style, color=INK, lw=0.9)
    inset.set(xlim=(0, 0.6), ylabel=r"$C$", yticks=(0, 1))
    inset.text(0.3, 0.3, r"$\xi/h_\mathrm{n}$", ha="center")
    inset.legend([r"$\tau_\mathrm{p}$", "$z$"], loc="upper right", handlelength=1.2)
    s = np.linspace(LOW, HIGH, 300)
    density.plot(setting.MARGINAL.distribution.pdf(s) * MEAN, s / MEAN, color=COLOURS[0])
    density.set(ylim=field.get_ylim(), xlabel=rf"$f(\tau_\mathrm{{p}})\,${MEAN_P}")
    density.tick_params(labelleft=False)
    return figure


def _system(axes) -> None:
    x = np.linspace(0, 1, 200)
    axes.fill_between(x, 0, 0.9, color="#e8edf2", lw=0)
    axes.fill_between(x, -0.9, 0, color="#f2ece8", lw=0)
    axes.plot(x, 0 * x, color=COLOURS[1], lw=3)
    for y, sign in ((0.72, 1), (-0.72, -1)):
        for start in (0.15, 0.45, 0.75):
            axes.annotate("", (start + sign * 0.06, y), (start - sign * 0.06, y),
                          arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 0.9})  # fmt: skip
    axes.text(0.5, 0.36, r"elastic half-space: $G,\ \nu,\ \rho$", ha="center", va="center")
    axes.text(0.5, -0.38, r"the same, periodic with $L$", ha="center", va="center")
    axes.text(0.02, 0.13, r"$\tau_\mathrm{f}(\delta, x)$", color=COLOURS[1])
    axes.text(0.93, 0.72, r"$\tau_0(t)$", va="center")
    axes.set(xlim=(0, 1), ylim=(-0.9, 0.9))
    axes.axis("off")
    letter(axes, "a")


def _load(axes) -> None:
    axes.plot([0, 1, 1.03, 1.35], [0, 1, 0.3, 0.3], color=COLOURS[0])
    axes.plot(1, 1, "o", color=INK, ms=4)
    axes.set(xlabel="time", ylabel=r"$\tau_0$", xticks=(), ylim=(0, 1.15), xlim=(0, 1.4))
    axes.set_yticks((0.3, 1.0), (r"$\tau_\mathrm{kin}$", TAU_CR))
    letter(axes, "b", x=-0.2)


def _law(axes) -> None:
    for peak, style, colour in ((1.0, "-", COLOURS[0]), (0.8, "--", GREY), (1.2, "--", GREY)):
        end = peak - 0.2
        axes.plot([0, end, 1.4], [peak, 0.2, 0.2], style, color=colour, lw=1.1)
    axes.plot([0.8, 0.8], [0, 0.2], ":", color=INK, lw=0.8)
    axes.annotate("$W$", (0.42, 0.6), (0.62, 0.75))
    axes.set_xticks((0.8,), (r"$d_\mathrm{c}$",))
    axes.set_yticks((0.2, 1.0), (r"$\tau_\mathrm{r}$", r"$\tau_\mathrm{p}(x)$"))
    axes.set(xlabel=r"slip $\delta$", xlim=(0, 1.4), ylim=(0, 1.3))
    letter(axes, "c", x=-0.2)


def figure_2(d: Data):
    """Draw the mapping from z to the strength, and the spectrum."""
    figure = new(4.9)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.1, 1.0))
    left, right = (figure.add_subplot(grid[0, i]) for i in (0, 1))
    z = np.linspace(-3.5, 3.5, 300)
    s = np.linspace(0.6e6, 1.75e6, 300)
    law = setting.MARGINAL.distribution
    left.plot(z, norm.cdf(z), color=COLOURS[0], label=r"$\Phi$")
    left.plot(z, norm.pdf(z), "--", color=GREY, label="density")
    right.plot(s / MEAN, law.cdf(s), color=COLOURS[2], label="$F$")
    right.plot(s / MEAN, law.pdf(s) * MEAN / 3, "--", color=GREY, label="density / 3")
    for value, colour in ((-0.6, COLOURS[1]), (1.1, RED)):
        level = norm.cdf(value)
        left.plot(value, level, "o", color=colour, ms=5)
        right.plot(law.ppf(level) / MEAN, level, "o", color=colour, ms=5)
        left.plot([value, 3.5], [level, level], ":", color=colour, lw=0.9)
        right.plot([0.6, law.ppf(level) / MEAN], [level, level], ":", color=colour, lw=0.9)
    left.set(xlabel="$z$", ylabel="cumulative probability", ylim=(0, 1.02), xlim=(-3.5, 3.5))
    right.set(xlabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", ylim=(0, 1.02), xlim=(0.6, 1.75))
    right.tick_params(labelleft=False)
    left.legend(loc="upper left")
    right.legend(loc="center right")
    letter(left, "a", x=-0.2)
    axes = figure.add_subplot(grid[1, :])
    k = np.geomspace(0.03, 10, 300)
    axes.loglog(k, (1.0 + k**2) ** -4.0, color=COLOURS[0], label=r"$g(k)/g(0)$")
    axes.loglog(k[k > 1.4], k[k > 1.4] ** -8.0, "--", color=RED, label=r"$(k/\lambda)^{-8}$")
    for place, text in ((1.0, r"$\lambda=2\pi/\xi_0$"), (2.5, r"$\bar k=2.5\,\lambda$")):
        axes.axvline(place, color=GREY, lw=0.8, ls=":")
        axes.text(place * 0.94, 3e-8, text, rotation=90, ha="right", va="bottom")
    axes.set(xlabel=r"$k/\lambda$", ylabel=r"$g(k)/g(0)$", ylim=(1e-8, 3))
    axes.legend(loc="lower left")
    letter(axes, "b", x=-0.09)
    return figure


SLOW_TO_FAST = LinearSegmentedColormap.from_list(
    "slip rate", ["white", "#b5d3e6", "#2a6f97", "#c8553d", "#5a1a12"]
)


def figure_3(d: Data):
    """Draw one rupture: slip rate in space and time, load, strength."""
    study, solid = d["representative"], PROBLEM.solid
    figure = new(7.4)
    grid = figure.add_gridspec(3, 4, height_ratios=(1.25, 1.25, 0.8))
    time, x = study["time"].values, study["x"].values / L
    mean_stress = study["mean_stress"].values
    onset, end = time[mean_stress.argmax()], time[-1]
    # The interface is periodic: it is shifted so that the onset lies at x/L = 0.75.
    centre = 0.75
    shift = round((centre - float(study["critical_position"]) / L) * x.size)
    rate = np.roll(study["slip_rate"].values, shift, axis=1) * setting.G_STAR
    rate = np.maximum(rate / (MEAN * solid.shear_wave_speed), 1e-12)
    zoom = figure.add_subplot(grid[0, :])
    late = (end / onset - 1.0) * 1e4
    picture = zoom.pcolormesh(x, (time / onset - 1.0) * 1e4, rate[:-1, :-1], rasterized=True,
                              norm=LogNorm(1e-5, 3.0), cmap=SLOW_TO_FAST)  # fmt: skip
    zoom.set(ylim=(-0.2 * late, late), ylabel=r"$(t/T-1)\times10^{4}$", xlim=(0, 1))
    for speed, text in (
        (solid.shear_wave_speed, r"$c_\mathrm{s}$"),
        (solid.dilatational_wave_speed, r"$c_\mathrm{d}$"),
    ):
        away = np.array([0.12, 0.12 + 0.6 * late * 1e-4 * onset * speed / L])
        zoom.plot(centre - away, (0.0, 0.6 * late), color=INK, lw=1.2, ls="--")
        zoom.text(centre - away[1], 0.62 * late, text, ha="center", va="bottom")
    letter(zoom, "a", x=-0.1)
    figure.colorbar(picture, ax=zoom, label=r"slip rate $\times\,G^*/(\langle\tau_\mathrm{p}\rangle"
                    r" c_\mathrm{s})$", ticks=(1e-4, 1e-2, 1))  # fmt: skip
    load, wide = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1:])
    load.plot(mean_stress / mean_stress.max(), time / onset, color=COLOURS[0])
    wide.pcolormesh(x, time / onset, rate[:-1, :-1], norm=LogNorm(1e-8, 1e-2), cmap=SLOW_TO_FAST,
                    rasterized=True)  # fmt: skip
    first = time[0] / onset
    load.set(xlim=(0.8, 1.03), ylabel="$t/T$", xlabel=r"$\tau_0/\tau_\mathrm{cr}$")
    wide.set(xlim=(0, 1), xlabel="$x/L$")
    wide.tick_params(labelleft=False)
    for axes, place in ((load, 1), (wide, centre)):
        axes.plot(place, 1, "o", color=INK, ms=4, clip_on=False)
        axes.set_ylim(first - 0.01, 1.005)
    letter(load, "b", x=-0.5)
    strength = figure.add_subplot(grid[2, :])
    tau_p = np.roll(study["strength"].values, shift) / MEAN
    strength.plot(x, tau_p, color=COLOURS[0], lw=0.9)
    top = tau_p.max() + 0.08
    strength.errorbar(centre, top, xerr=0.5 * H / L, color=RED, capsize=3, lw=1.4)
    strength.text(centre + 0.7 * H / L, top, r"$h_\mathrm{n}$", va="center", color=RED)
    strength.set(xlabel="$x/L$", ylabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", xlim=(0, 1),
                 ylim=(None, top + 0.08))  # fmt: skip
    letter(strength, "c", x=-0.1)
    return figure


def figure_4(d: Data):
    """Draw the nucleation stress of one field, and theory against 60 ruptures."""
    figure = new(7.6)
    grid = figure.add_gridspec(3, 1, height_ratios=(0.9, 1.0, 1.3))
    top, middle, bottom = (figure.add_subplot(grid[i]) for i in range(3))
    study = d["representative"]
    x = study["x"].values / L
    top.plot(x, study["strength"] / MEAN, "--", color=GREY, lw=0.8, label=r"$\tau_\mathrm{p}$")
    top.plot(x, study["tau_n"] / MEAN, color=COLOURS[1], label=r"$\tau_\mathrm{n}$")
    least = int(study["tau_n"].argmin())
    top.plot(x[least], study["tau_n"].values[least] / MEAN, "o", color=INK, ms=5)
    top.set(xlabel="$x/L$", ylabel=rf"stress ${OVER_MEAN}", xlim=(0, 1), ylim=(0.6, 1.75))
    top.legend(loc="upper right", ncols=2)
    letter(top, "a", x=-0.1)
    for ratio in SIMULATED:
        stress = d.stress(ratio, "ruptures") / MEAN
        style = dots(ratio)
        middle.plot(stress, 100 * offsets(d, ratio, "local"), **style, ms=4, label=f"{ratio:g}")
        middle.plot(stress, 100 * offsets(d, ratio, "printed"), **{**style, "color": PALE},
                    ms=3, mfc="none", zorder=1)  # fmt: skip
    middle.axhline(0, color=GREY, lw=0.8)
    middle.set(xlabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN} of the rupture",
               ylabel="theory above rupture (%)")  # fmt: skip
    middle.legend(title=XI, loc="upper left", ncols=3)
    letter(middle, "b", x=-0.1)
    bottom.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    for ratio in SIMULATED:
        place = d.at("ruptures", "critical_position", ratio)
        predicted = d.at("local", "critical_position", ratio)[: place.size]
        bottom.plot(predicted / L, place / L, **dots(ratio), ms=4)
        off = setting.distance(place, predicted) > 0.5 * H
        bottom.plot(predicted[off] / L, place[off] / L, "o", mfc="none", mec=RED, ms=9)
        other = d.at("printed", "critical_position", ratio)[: place.size]
        off = setting.distance(place, other) > 0.5 * setting.PRINTED_H
        bottom.plot(other[off] / L, place[off] / L, "x", color=RED, ms=6)
    bottom.set(xlabel=r"predicted $x_\mathrm{cr}/L$", ylabel=r"simulated $x_\mathrm{cr}/L$",
               xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")  # fmt: skip
    letter(bottom, "c", x=-0.15)
    return figure
