"""Figures 1 to 7, those of the paper."""

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from scipy.stats import norm

import stiction as st
from reproduction import setting
from reproduction.claims import Data
from reproduction.figures import common
from reproduction.figures.common import COLOURS, DARK, GREY, MEAN_P, OVER_MEAN, RED, TAU_CR, XI
from reproduction.numbers_with_errors import mean, quantile
from reproduction.setting import HIGH, LOW, MEAN, PROBLEM, RATIOS, SIMULATED, H, L
from reproduction.statements_onset import dynamic_mean, offsets, stress_density


def figure_1(d: Data):
    """Draw the system, the load, the friction law, and one field with its statistics."""
    figure = common.new(6.9)
    grid = figure.add_gridspec(3, 4, height_ratios=(0.9, 1.0, 1.7))
    _system(figure.add_subplot(grid[0, :]))
    _load(figure.add_subplot(grid[1, :2]))
    _law(figure.add_subplot(grid[1, 2:]))
    bottom = grid[2, :].subgridspec(1, 2, width_ratios=(3.2, 1.0), wspace=0.0)
    field, density = (figure.add_subplot(bottom[i]) for i in (0, 1))
    tau_p, x = d["representative"]["strength"].values / MEAN, PROBLEM.interface.x / L
    field.plot(x, tau_p, color=COLOURS[0], lw=0.9)
    low, high = common.span(tau_p, common.STRENGTHS)
    field.set(xlabel=r"$x/L$", ylabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", xlim=(0, 1),
              ylim=(low, high + 1.1 * (high - low)))  # room for the inset  # fmt: skip
    common.letter(field, "d", x=-0.1)
    inset = field.inset_axes((0.3, 0.68, 0.66, 0.32))
    lag = PROBLEM.interface.x / H
    for name, style in (("correlation", "-"), ("gaussian_correlation", ":")):
        inset.plot(lag, d.at("theory", name, setting.FIRST), style, color=DARK, lw=0.9)
    inset.set(xlim=(0, 2.4 * setting.FIRST), ylabel=r"$C$", yticks=(0, 1))
    inset.text(1.2 * setting.FIRST, 0.3, r"$\xi/h_\mathrm{n}$", ha="center")
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
                          arrowprops={"arrowstyle": "-|>", "color": DARK, "lw": 0.9})  # fmt: skip
    axes.text(0.5, 0.36, r"elastic half-space: $G,\ \nu,\ \rho$", ha="center", va="center")
    axes.text(0.5, -0.38, r"the same, periodic with $L$", ha="center", va="center")
    axes.text(0.02, 0.13, r"$\tau_\mathrm{f}(\delta, x)$", color=COLOURS[1])
    axes.text(0.93, 0.72, r"$\tau_0(t)$", va="center")
    axes.set(xlim=(0, 1), ylim=(-0.9, 0.9))
    axes.axis("off")
    common.letter(axes, "a")


def _load(axes) -> None:
    axes.plot([0, 1, 1.03, 1.35], [0, 1, 0.3, 0.3], color=COLOURS[0])
    axes.plot(1, 1, "o", color=DARK, ms=4)
    axes.set(xlabel="time", ylabel=r"$\tau_0$", xticks=(), ylim=(0, 1.15), xlim=(0, 1.4))
    axes.set_yticks((0.3, 1.0), (r"$\tau_\mathrm{kin}$", TAU_CR))
    common.letter(axes, "b", x=-0.2)


def _law(axes) -> None:
    for peak, style, colour in ((1.0, "-", COLOURS[0]), (0.8, "--", GREY), (1.2, "--", GREY)):
        end = peak - 0.2
        axes.plot([0, end, 1.4], [peak, 0.2, 0.2], style, color=colour, lw=1.1)
    axes.plot([0.8, 0.8], [0, 0.2], ":", color=DARK, lw=0.8)
    axes.annotate("$W$", (0.42, 0.6), (0.62, 0.75))
    axes.set_xticks((0.8,), (r"$d_\mathrm{c}$",))
    axes.set_yticks((0.2, 1.0), (r"$\tau_\mathrm{r}$", r"$\tau_\mathrm{p}(x)$"))
    axes.set(xlabel=r"slip $\delta$", xlim=(0, 1.4), ylim=(0, 1.3))
    common.letter(axes, "c", x=-0.2)


def figure_2(d: Data):
    """Draw the mapping from z to the strength, and the spectrum."""
    figure = common.new(4.9)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.1, 1.0))
    left, right = (figure.add_subplot(grid[0, i]) for i in (0, 1))
    z = np.linspace(-3.5, 3.5, 300)
    s = np.linspace(*common.span((LOW, HIGH)), 300)
    law = setting.MARGINAL.distribution
    peak = max(law.pdf(s)) * MEAN
    left.plot(z, norm.cdf(z), color=COLOURS[0], label=r"$\Phi$")
    left.plot(z, norm.pdf(z), "--", color=GREY, label="density")
    right.plot(s / MEAN, law.cdf(s), color=COLOURS[2], label="$F$")
    right.plot(
        s / MEAN, law.pdf(s) * MEAN / peak, "--", color=GREY, label=f"density / {peak:.2g}"
    )
    for value, colour in ((-0.6, COLOURS[1]), (1.1, RED)):
        level = norm.cdf(value)
        left.plot(value, level, "o", color=colour, ms=5)
        right.plot(law.ppf(level) / MEAN, level, "o", color=colour, ms=5)
        left.plot([value, 3.5], [level, level], ":", color=colour, lw=0.9)
        right.plot(np.array([s[0], law.ppf(level)]) / MEAN, [level, level], ":", color=colour,
                   lw=0.9)  # fmt: skip
    left.set(xlabel="$z$", ylabel="cumulative probability", ylim=(0, 1.02), xlim=(-3.5, 3.5))
    right.set(xlabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", ylim=(0, 1.02),
              xlim=(s[0] / MEAN, s[-1] / MEAN))  # fmt: skip
    right.tick_params(labelleft=False)
    left.legend(loc="upper left")
    right.legend(loc="center right")
    common.letter(left, "a", x=-0.2)
    axes = figure.add_subplot(grid[1, :])
    spectrum = setting.FIELD.spectrum
    unit = 2.0 * np.pi / spectrum.correlation_length  # lambda
    cutoff = spectrum.cutoff() / unit
    k = np.geomspace(0.03, max(10.0, 1.5 * cutoff), 300)
    value = spectrum.density(unit * k) / spectrum.density(np.zeros(1))
    axes.loglog(k, value, color=COLOURS[0])
    floor = max(float(value[k <= 1.2 * cutoff].min()) / 10.0, 1e-12)
    for place, text in ((1.0, r"$\lambda=2\pi/\xi_0$"), (cutoff, "cut-off")):
        axes.axvline(place, color=GREY, lw=0.8, ls=":")
        axes.text(place * 0.94, 2.0 * floor, text, rotation=90, ha="right", va="bottom")
    axes.set(xlabel=r"$k/\lambda$", ylabel=r"$g(k)/g(0)$", ylim=(floor, 3))
    common.letter(axes, "b", x=-0.09)
    return figure


SLOW_TO_FAST = LinearSegmentedColormap.from_list(
    "slip rate", ["white", "#b5d3e6", "#2a6f97", "#c8553d", "#5a1a12"]
)


def _shift(study) -> int:
    """Return the nodes by which the periodic interface is shifted: its onset is at 0.75 L then."""
    return round((0.75 - float(study["critical_position"]) / L) * study.sizes["x"])


def figure_3(d: Data):
    """Draw one rupture: slip rate in space and time, load, strength."""
    study, solid = d["representative"], PROBLEM.solid
    figure = common.new(7.4)
    grid = figure.add_gridspec(3, 4, height_ratios=(1.25, 1.25, 0.8))
    time, x = study["time"].values, study["x"].values / L
    mean_stress = study["mean_stress"].values
    onset, end = time[mean_stress.argmax()], time[-1]
    centre, shift = 0.75, _shift(study)
    rate = np.roll(study["slip_rate"].values, shift, axis=1) * setting.G_STAR
    rate = np.maximum(rate / (MEAN * solid.shear_wave_speed), 1e-12)
    top = float(rate.max()) / 2.0  # colours over five decades below the fastest
    zoom = figure.add_subplot(grid[0, :])
    late = (end / onset - 1.0) * 1e4
    picture = zoom.pcolormesh(x, (time / onset - 1.0) * 1e4, rate[:-1, :-1], rasterized=True,
                              norm=LogNorm(1e-5 * top, 3.0 * top), cmap=SLOW_TO_FAST)  # fmt: skip
    zoom.set(ylim=(-0.2 * late, late), ylabel=r"$(t/T-1)\times10^{4}$", xlim=(0, 1))
    for speed, text in (
        (solid.shear_wave_speed, r"$c_\mathrm{s}$"),
        (solid.dilatational_wave_speed, r"$c_\mathrm{d}$"),
    ):
        way = 0.6 * late * 1e-4 * onset * speed / L
        shown = min(1.0, 0.5 / way)  # the line stays within the panel
        away = np.array([0.12, 0.12 + shown * way])
        zoom.plot(centre - away, (0.0, 0.6 * late * shown), color=DARK, lw=1.2, ls="--")
        zoom.text(centre - away[1], 0.62 * late * shown, text, ha="center", va="bottom")
    common.letter(zoom, "a", x=-0.1)
    figure.colorbar(picture, ax=zoom, label=r"slip rate $\times\,G^*/(\langle\tau_\mathrm{p}\rangle"
                    r" c_\mathrm{s})$")  # fmt: skip
    load, wide = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1:])
    load.plot(mean_stress / mean_stress.max(), time / onset, color=COLOURS[0])
    wide.pcolormesh(x, time / onset, rate[:-1, :-1], norm=LogNorm(1e-8 * top, 1e-2 * top),
                    cmap=SLOW_TO_FAST, rasterized=True)  # fmt: skip
    first = time[0] / onset
    shown = mean_stress[time <= onset] / mean_stress.max()
    load.set(xlim=(min(0.8, shown.min()), 1.03), ylabel="$t/T$",
             xlabel=r"$\tau_0/\tau_\mathrm{cr}$")  # fmt: skip
    wide.set(xlim=(0, 1), xlabel="$x/L$")
    wide.tick_params(labelleft=False)
    for axes, place in ((load, 1), (wide, centre)):
        axes.plot(place, 1, "o", color=DARK, ms=4, clip_on=False)
        axes.set_ylim(first - 0.01, 1.005)
    common.letter(load, "b", x=-0.5)
    strength = figure.add_subplot(grid[2, :])
    tau_p = np.roll(study["strength"].values, shift) / MEAN
    strength.plot(x, tau_p, color=COLOURS[0], lw=0.9)
    top = tau_p.max() + 0.08
    strength.errorbar(centre, top, xerr=0.5 * H / L, color=RED, capsize=3, lw=1.4)
    strength.text(centre + 0.7 * H / L, top, r"$h_\mathrm{n}$", va="center", color=RED)
    strength.set(xlabel="$x/L$", ylabel=rf"$\tau_\mathrm{{p}}{OVER_MEAN}", xlim=(0, 1),
                 ylim=(None, top + 0.08))  # fmt: skip
    common.letter(strength, "c", x=-0.1)
    return figure


def figure_4(d: Data):
    """Draw the nucleation stress of one field, and theory against 60 ruptures."""
    figure = common.new(7.6)
    grid = figure.add_gridspec(3, 1, height_ratios=(0.9, 1.0, 1.3))
    top, middle, bottom = (figure.add_subplot(grid[i]) for i in range(3))
    study = d["representative"]
    x = study["x"].values / L
    tau_p, tau_n = (
        np.roll(study[name], _shift(study)) / MEAN for name in ("strength", "tau_n")
    )
    top.plot(x, tau_p, "--", color=GREY, lw=0.8, label=r"$\tau_\mathrm{p}$")
    top.plot(x, tau_n, color=COLOURS[1], label=r"$\tau_\mathrm{n}$")
    top.plot(x[tau_n.argmin()], tau_n.min(), "o", color=DARK, ms=5)
    top.set(xlabel="$x/L$", ylabel=rf"stress ${OVER_MEAN}", xlim=(0, 1))
    top.legend(loc="upper right", ncols=2)
    common.letter(top, "a", x=-0.1)
    for ratio in SIMULATED:
        stress = d.stress(ratio, "ruptures") / MEAN
        style = common.dots(ratio)
        middle.plot(stress, 100 * offsets(d, ratio, "local"), **style, ms=4, label=f"{ratio:g}")
        if "printed" in d:
            middle.plot(stress, 100 * offsets(d, ratio, "printed"), ms=3, mfc="none", zorder=1,
                        **{**style, "color": common.LIGHT})  # fmt: skip
    middle.axhline(0, color=GREY, lw=0.8)
    middle.set(xlabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN} of the rupture",
               ylabel="theory above rupture (%)")  # fmt: skip
    middle.legend(title=XI, ncols=3)
    common.letter(middle, "b", x=-0.1)
    bottom.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    for ratio in SIMULATED:
        place = d.at("ruptures", "critical_position", ratio)
        predicted = d.at("local", "critical_position", ratio)[: place.size]
        bottom.plot(predicted / L, place / L, **common.dots(ratio), ms=4)
        off = setting.distance(place, predicted) > 0.5 * H
        bottom.plot(predicted[off] / L, place[off] / L, "o", mfc="none", mec=RED, ms=9)
        if "printed" in d:
            printed = d.at("printed", "critical_position", ratio)[: place.size]
            off = setting.distance(place, printed) > 0.5 * setting.PRINTED_H
            bottom.plot(printed[off] / L, place[off] / L, "x", color=RED, ms=6)
    bottom.set(xlabel=r"predicted $x_\mathrm{cr}/L$", ylabel=r"simulated $x_\mathrm{cr}/L$",
               xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")  # fmt: skip
    common.letter(bottom, "c", x=-0.15)
    return figure


def figure_5(d: Data):
    """Draw strength, nucleation stress and onset at four correlation lengths."""
    figure = common.new(8.4)
    grid = figure.add_gridspec(4, 1, height_ratios=(1.5, 0.9, 0.9, 0.6))
    count = len(RATIOS)
    rows = [grid[i].subgridspec((count, 1)[i], 3, width_ratios=(4, 1, 1.2), wspace=0.04,
                                hspace=0.06) for i in (0, 1)]  # fmt: skip
    fields = [figure.add_subplot(rows[0][i, 0]) for i in range(count)]
    low, high = common.span(common.STRENGTHS)
    upper = [figure.add_subplot(rows[0][:, i]) for i in (1, 2)]
    lower = [figure.add_subplot(rows[1][i]) for i in range(3)]
    x = PROBLEM.interface.x / L
    s = np.linspace(LOW, HIGH, 300)
    minima, averages, ranges = [], [], []
    upper[0].plot(setting.MARGINAL.distribution.pdf(s) * MEAN, s / MEAN, color=DARK)
    for ratio, strip in zip(RATIOS, fields, strict=True):
        tau_p = setting.strength(ratio).sample(PROBLEM.interface)  # of the same draws for each
        strip.plot(x, tau_p[0] / MEAN, color=common.line(ratio)["color"], lw=0.9)
        strip.plot([], [], **common.line(ratio), label=f"{XI} = {ratio:g}")
        strip.legend(loc="upper right", borderpad=0.1)
        strip.set(xlim=(0, 1), ylim=(low, high + 0.8 * (high - low)))
        strip.locator_params(axis="y", nbins=3)
        strip.tick_params(labelbottom=strip is fields[-1])
        tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)[0]
        lower[0].plot(x, tau_n / MEAN, **common.line(ratio), lw=0.9)
        weakest = d.at("moments", "weakest_strength", ratio)
        least = st.statistics.density(weakest, bounds=setting.DENSITY_BOUNDS)
        minima.append(least.x[least.value > 1e-3 * least.value.max()] / MEAN)
        averages.append(tau_n / MEAN)
        upper[1].plot(least.value / least.value.max(), least.x / MEAN, **common.line(ratio))
        counts = d.at("moments", "counts", ratio).reshape(-1, 32).sum(axis=1)
        edges = np.linspace(LOW, HIGH, counts.size + 1)
        centre = 0.5 * (edges[1:] + edges[:-1])
        density = counts / counts.sum() / (edges[1] - edges[0]) * MEAN
        lower[1].plot(density, centre / MEAN, **common.line(ratio))
    for panel in (*upper, *lower[1:]):  # narrow panels of densities
        panel.set_xticks([])
        panel.tick_params(labelleft=panel is upper[0])
    for panel in lower:
        panel.set_ylim(common.span(*averages))
    fields[1].set_ylabel(rf"$\tau_\mathrm{{p}}{OVER_MEAN}", y=0.0)
    upper[0].set_ylim(low, high)
    upper[1].set_ylim(common.span(*minima, margin=0.0))
    upper[1].yaxis.tick_right()
    upper[1].tick_params(labelright=True)
    upper[1].locator_params(axis="y", nbins=5)
    upper[0].set_title(r"$f(\tau_\mathrm{p})$")
    upper[1].set_title(r"$f(\min\tau_\mathrm{p})$")
    lower[0].set(ylabel=rf"$\tau_\mathrm{{n}}{OVER_MEAN}", xlabel="$x/L$", xlim=(0, 1))
    lower[1].set_title(r"$f(\tau_\mathrm{n})$")
    lower[2].axis("off")
    common.letter(fields[0], "a", x=-0.12)
    common.letter(lower[0], "b", x=-0.12)
    stress, place = figure.add_subplot(grid[2]), figure.add_subplot(grid[3])
    for ratio in RATIOS:
        density, look = stress_density(d, ratio), common.line(ratio)
        stress.plot(density.x / MEAN, density.value * MEAN, **look)
        ranges.append(density.x[density.value > 1e-3 * density.value.max()] / MEAN)
        band = [(density.value + sign * 2 * density.error) * MEAN for sign in (-1, 1)]
        stress.fill_between(density.x / MEAN, *band, color=look["color"], alpha=0.25, lw=0)
        share, edges = np.histogram(d.at("local", "critical_position", ratio) / L, 20, (0, 1))
        share = share / d.size.samples * 20
        place.stairs(share, edges, baseline=None, color=common.line(ratio)["color"],
                     lw=0.9)  # fmt: skip
    error = np.sqrt(20.0 / d.size.samples)
    place.axhspan(1 - 2 * error, 1 + 2 * error, color="#eeeeee", lw=0, zorder=0)
    if setting.SUPPORT[0] > 0.0:
        stress.axvline(LOW / MEAN, color=GREY, lw=0.8, ls=":")
        ranges.append(LOW / MEAN)
    stress.set(xlim=common.span(*ranges, margin=0.02), ylim=(0, None),
               xlabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN}",
               ylabel=rf"$f(\tau_\mathrm{{cr}})\,${MEAN_P}")  # fmt: skip
    place.set(xlim=(0, 1), ylim=(0, None), xlabel=r"$x_\mathrm{cr}/L$",
              ylabel=r"$f(x_\mathrm{cr})\,L$")  # fmt: skip
    common.letter(stress, "c", x=-0.12)
    common.letter(place, "d", x=-0.12)
    return figure


_PLACES = np.array([np.log2(setting.FIRST) - 1.2, *np.log2(RATIOS), np.log2(RATIOS[-1]) + 1.2])
"""Places on the axis: zero, the correlation lengths on a logarithm, and infinity."""


def _statistics(axes, table, ends) -> None:
    """Draw mean, median and lower quartile; `ends` are those at zero and at infinity."""
    x = _PLACES[1:-1]
    styles = (("mean", "-", "o", COLOURS[0]), ("median", "--", "s", COLOURS[1]),
              ("25 % quantile", ":", "^", COLOURS[2]))  # fmt: skip
    for i, (name, dashes, marker, colour) in enumerate(styles):
        row = [numbers[i].value for numbers in table]
        style = {"color": colour, "ls": dashes, "marker": marker, "label": name}
        common.numbers(axes, x, [numbers[i] for numbers in table], **style)
        axes.plot(_PLACES[:2], [ends[0][i], row[0]], color=colour, ls=(0, (1, 2)), lw=0.9)
        axes.plot(_PLACES[-2:], [row[-1], ends[1][i]], color=colour, ls=(0, (1, 2)), lw=0.9)
        axes.plot(_PLACES[[0, -1]], [ends[0][i], ends[1][i]], marker, color=colour, ms=4,
                  mfc="white", ls="none")  # fmt: skip
    labels = ("0", *(f"{ratio:g}" for ratio in RATIOS), r"$\infty$")
    axes.set_xticks(_PLACES, labels)
    for place in (_PLACES[0] + 0.6, _PLACES[-1] - 0.6):
        axes.text(place, 0, "//", transform=axes.get_xaxis_transform(), ha="center", va="center",
                  fontsize=9)  # fmt: skip
    axes.set_xlabel(XI)


def figure_6(d: Data):
    """Draw mean, median and lower quartile of tau_n and of tau_cr."""
    figure = common.new(6.4)
    grid = figure.add_gridspec(2, 1, height_ratios=(0.85, 1.3))
    top, bottom = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    law = setting.MARGINAL.distribution
    edges = np.linspace(LOW, HIGH, d["moments"].sizes["cell"] + 1)
    table = []
    for ratio in RATIOS:
        counts = np.cumsum(d.at("moments", "counts", ratio))
        counts = counts / counts[-1]
        shift = d.at("moments", "powers", ratio)[:, 0]
        quantiles = [np.interp(p, counts, edges[1:]) / MEAN for p in (0.5, 0.25)]
        table.append((mean(1.0 + shift), *(mean(np.array([q, q])) for q in quantiles)))
    uniform = [1.0, law.ppf(0.5) / MEAN, law.ppf(0.25) / MEAN]
    _statistics(top, table, ([1.0, 1.0, 1.0], uniform))
    top.set(ylabel=rf"$\tau_\mathrm{{n}}{OVER_MEAN}")
    top.legend(loc="lower left")
    common.letter(top, "a", x=-0.12)
    table = [
        tuple(number * (1 / MEAN) for number in (mean(v), quantile(v, 0.5), quantile(v, 0.25)))
        for v in (d.stress(ratio) for ratio in RATIOS)
    ]
    low = LOW / MEAN if setting.SUPPORT[0] > 0.0 else np.nan  # no limit without a bound
    _statistics(bottom, table, ([1.0, 1.0, 1.0], [low, low, low]))
    bottom.set(ylabel=rf"$\tau_\mathrm{{cr}}{OVER_MEAN}")
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
    inset.plot(np.log2(RATIOS), [n[0].value for n in table], "-o", color=COLOURS[0], ms=4)
    inset.plot(places, [n.value for n in best], "x", color=RED, ms=7)
    common.ratio_axis(inset)
    inset.set(xlabel="", ylabel="mean", xlim=(_PLACES[1] - 0.4, _PLACES[-2] + 0.4))
    bottom.legend(*_chosen(bottom, 1), loc="lower left")
    common.letter(bottom, "b", x=-0.12)
    return figure


def _chosen(axes, count: int):
    handles, labels = axes.get_legend_handles_labels()
    return handles[-count:], labels[-count:]


def figure_7(d: Data):
    """Draw correlation, eigenfunction and the variance of tau_n."""
    figure = common.new(5.4)
    axes = figure.subplots(2, 2)
    theory = d["theory"]
    lag = theory["x"].values / L
    for ratio in RATIOS:
        values = theory["correlation"].sel(correlation_ratio=ratio)
        axes[0, 0].plot(lag, values, **common.line(ratio), label=f"{ratio:g}")
    axes[0, 0].set(xlim=(0, min(1.9 * RATIOS[-1] * H / L, 0.5)), xlabel=r"$\xi/L$",
                   ylabel=r"$C(\xi)$")  # fmt: skip
    axes[0, 0].legend(title=XI)
    s = np.linspace(-1, 1, 200)
    axes[0, 1].plot(s, (0.925 - 0.308 * s**2) * np.sqrt(1 - s**2), color=COLOURS[0])
    axes[0, 1].set(xlabel="$s$", ylabel="$v_0(s)$", ylim=(0, None))
    ratio, value = theory["ratio"].values, theory["infinite"].values
    slope = value[0] / ratio[0]
    for panel, high in ((axes[1, 0], 8), (axes[1, 1], 1)):
        near = ratio <= high * 1.3
        panel.plot(ratio[near], value[near], color=COLOURS[0], label="infinite interface")
        shown = theory["usable"].values
        panel.plot(shown[shown <= high], theory["periodic"].values[shown <= high], "--",
                   color=COLOURS[1], label="this interface")  # fmt: skip
        panel.plot([0, 1.0 / slope], [0, 1.0], ":", color=RED, label=rf"{slope:.2f} {XI}")
        for sampled_ratio in RATIOS:
            if sampled_ratio <= high:
                spread = d.at("moments", "powers", sampled_ratio)
                sampled = spread[:, 1].mean() - spread[:, 0].mean() ** 2
                share = sampled * (MEAN / setting.DEVIATION) ** 2
                panel.plot(sampled_ratio, share, "o", color=DARK, ms=4)
        panel.set(xlim=(0, high), xlabel=XI, ylim=(0, 1.02))
    axes[1, 0].set_ylabel(r"Var[$\tau_\mathrm{n}$]/Var[$\tau_\mathrm{p}$]")
    axes[1, 0].axhline(1.0, color=GREY, lw=0.8, ls="--")
    axes[1, 0].legend(loc="lower right")
    common.letters(axes.flat, x=-0.25)
    return figure
