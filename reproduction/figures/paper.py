"""Figures 1 to 7, those of the paper."""

import numpy as np
from matplotlib.colors import LogNorm
from scipy.stats import norm

import stiction as st
from reproduction import setting
from reproduction.figures import common
from reproduction.figures.common import XI
from reproduction.measures import is_misplaced, offsets, paired, stress_density
from reproduction.numbers_with_errors import Number, mean, quantile
from reproduction.runner import Data
from reproduction.setting import FIRST, HIGH, LAST, LOW, MEAN, PROBLEM, RATIOS, SIMULATED, H, L
from stiction.statistics import density as smooth_density

LAW = setting.MARGINAL.distribution
X = PROBLEM.interface.x / L


def figure_1(d: Data):
    """Draw the system, the load, the friction law, and one field with its statistics."""
    rows = (8 * ["a"], 4 * ["b"] + 4 * ["c"], 6 * ["d"] + 2 * ["density"])
    figure, system, load, law, field, density = common.mosaic(6.9, rows, (0.9, 1.0, 1.7))
    _system(system)
    load.plot([0, 1, 1.03, 1.35], [0, 1, 0.3, 0.3], color="C0")
    load.plot(1, 1, "o", color="black", ms=4)
    for peak, style, colour in ((1.0, "-", "C0"), (0.8, "--", "grey"), (1.2, "--", "grey")):
        law.plot([0, peak - 0.2, 1.4], [peak, 0.2, 0.2], style, color=colour, lw=1.1)
    law.plot([0.8, 0.8], [0, 0.2], ":", color="black", lw=0.8)
    law.annotate("$W$", (0.42, 0.6), (0.62, 0.75))
    tau_p = d["representative"]["strength"].values / MEAN
    field.plot(X, tau_p, color="C0", lw=0.9)
    low, high = common.span(tau_p, common.STRENGTH_RANGE)
    # The upper half is for the inset.
    field.set(xlim=(0, 1), ylim=(low, 2.1 * high - 1.1 * low))
    inset = field.inset_axes((0.3, 0.68, 0.66, 0.32))
    curves = (("correlation", "-", r"$\tau_\mathrm{p}$"), ("gaussian_correlation", ":", "$z$"))
    for name, style, label in curves:
        correlation = d.at("theory", name, FIRST)
        inset.plot(X * L / H, correlation, style, color="black", lw=0.9, label=label)
    inset.set(xlim=(0, 2.4 * FIRST), ylabel=r"$C$", yticks=(0, 1))
    inset.text(1.2 * FIRST, 0.3, r"$\xi/h_\mathrm{n}$", ha="center")
    inset.legend(loc="upper right", handlelength=1.2)
    s = np.linspace(LOW, HIGH, 300)
    density.plot(LAW.pdf(s) * MEAN, s / MEAN, color="C0")
    density.set(ylim=field.get_ylim())
    density.tick_params(labelleft=False)
    return figure


def _system(axes) -> None:
    axes.axhspan(0, 0.9, color="aliceblue", lw=0)
    axes.axhspan(-0.9, 0, color="linen", lw=0)
    axes.axhline(0, color="C1", lw=3)
    for y, arrow in ((0.72, r"$\longrightarrow$"), (-0.72, r"$\longleftarrow$")):
        for x in (0.15, 0.45, 0.75):
            axes.text(x, y, arrow, ha="center", va="center", fontsize=14)
    axes.text(0.5, 0.36, r"elastic half-space: $G,\ \nu,\ \rho$", ha="center", va="center")
    axes.text(0.5, -0.38, r"the same, periodic with $L$", ha="center", va="center")
    axes.text(0.02, 0.13, r"$\tau_\mathrm{f}(\delta, x)$", color="C1")
    axes.text(0.93, 0.72, r"$\tau_0(t)$", va="center")
    axes.axis("off")


def figure_2(d: Data):
    """Draw the mapping from z to the strength, and the spectrum."""
    rows = (["a", "strength"], ["b", "b"])
    figure, left, right, axes = common.mosaic(4.9, rows, (1.1, 1.0))
    z, s = np.linspace(-3.5, 3.5, 300), np.linspace(*common.span((LOW, HIGH)), 300)
    peak = max(LAW.pdf(s)) * MEAN
    left.plot(z, norm.cdf(z), color="C0", label=r"$\Phi$")
    left.plot(z, norm.pdf(z), "--", color="grey", label="density")
    right.plot(s / MEAN, LAW.cdf(s), color="C2", label="$F$")
    density = LAW.pdf(s) * MEAN / peak
    right.plot(s / MEAN, density, "--", color="grey", label=f"density / {peak:.2g}")
    for value, colour in ((-0.6, "C1"), (1.1, "firebrick")):
        level = norm.cdf(value)
        strength = LAW.ppf(level) / MEAN
        left.plot([value, 3.5], [level, level], ":o", color=colour, lw=0.9, markevery=[0])
        right.plot([strength, s[0] / MEAN], [level, level], ":o", color=colour, lw=0.9,
                   markevery=[0])  # fmt: skip
    right.set(ylim=(0, 1.02), xlim=(s[0] / MEAN, s[-1] / MEAN))
    right.tick_params(labelleft=False)
    for panel in (left, right):
        panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    spectrum = setting.FIELD.spectrum
    unit = 2.0 * np.pi / spectrum.correlation_length  # lambda
    cutoff = spectrum.cutoff() / unit
    k = np.geomspace(0.03, max(10.0, 1.5 * cutoff), 300)
    value = spectrum.density(unit * k) / spectrum.density(np.zeros(1))
    axes.loglog(k, value, color="C0")
    floor = max(float(value[k <= 1.2 * cutoff].min()) / 10.0, 1e-12)
    for place, text, y in ((1.0, r"cutoff $\lambda$", 0.04), (cutoff, "truncation", 0.65)):
        axes.axvline(place, color="grey", lw=0.8, ls=":")
        axes.text(place * 0.94, y, text, rotation=90, ha="right", va="bottom",
                  transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set(ylim=(floor, 3))
    return figure


PLACE = 0.75
"""x/L of the onset of the shown sample: the periodic interface is shifted, as in the paper."""


def _shifted(study, name: str) -> np.ndarray:
    """Return a variable of the shown sample with its onset at `PLACE`."""
    shift = round((PLACE - float(study["critical_position"]) / L) * study.sizes["x"])
    return np.roll(study[name].values, shift, axis=-1)


def figure_3(d: Data):
    """Draw one rupture: slip rate in space and time, load, strength."""
    study, solid = d["representative"], PROBLEM.solid
    rows = (4 * ["a"], ["b"] + 3 * ["wide"], 4 * ["c"])
    figure, zoom, load, wide, strength = common.mosaic(7.4, rows, (1.25, 1.25, 0.8))
    mean_stress = study["mean_stress"].values
    onset = float(study.time[mean_stress.argmax()])
    time = study["time"].values / onset
    slip_rate = _shifted(study, "slip_rate")[:-1, :-1] * setting.G_STAR
    slip_rate = np.maximum(slip_rate / (MEAN * solid.shear_wave_speed), 1e-12)
    top = float(slip_rate.max()) / 2.0  # colours over five decades below the fastest
    late = (time[-1] - 1.0) * 1e4
    style = {"cmap": "inferno_r", "rasterized": True}
    picture = zoom.pcolormesh(X, (time - 1.0) * 1e4, slip_rate, norm=LogNorm(1e-5 * top, 3.0 * top),
                              **style)  # fmt: skip
    zoom.set(ylim=(-0.2 * late, late))
    for name, speed in (("s", solid.shear_wave_speed), ("d", solid.dilatational_wave_speed)):
        way = 0.6 * late * 1e-4 * onset * speed / L
        shown = min(1.0, 0.5 / way)  # the line stays within the panel
        away = np.array([0.12, 0.12 + shown * way])
        zoom.plot(PLACE - away, (0.0, 0.6 * late * shown), color="black", lw=1.2, ls="--")
        zoom.text(PLACE - away[1], 0.62 * late * shown, rf"$c_\mathrm{{{name}}}$", ha="center",
                  va="bottom", bbox={"fc": "white", "ec": "none", "pad": 0.8})  # fmt: skip
    label = r"slip rate $\times\,G^*/(\langle\tau_\mathrm{p}\rangle c_\mathrm{s})$"
    figure.colorbar(picture, ax=zoom, label=label)
    stress = mean_stress / mean_stress.max()
    load.plot(stress, time, color="C0")
    wide.pcolormesh(X, time, slip_rate, norm=LogNorm(1e-8 * top, 1e-2 * top), **style)
    load.set_xlim(common.span(stress[time <= 1.0]))
    load.locator_params(axis="x", nbins=3)
    wide.tick_params(labelleft=False)
    for axes, place in ((load, 1), (wide, PLACE)):
        axes.plot(place, 1, "o", color="black", ms=4, clip_on=False)
        axes.set_ylim(common.span(time[[0, -1]]))
    tau_p = _shifted(study, "strength") / MEAN
    strength.plot(X, tau_p, color="C0", lw=0.9)
    above = tau_p.max() + 0.1 * np.ptp(tau_p)
    strength.errorbar(PLACE, above, xerr=0.5 * H / L, color="firebrick", capsize=3, lw=1.4)
    strength.text(PLACE + 0.7 * H / L, above, r"$h_\mathrm{n}$", va="center", color="firebrick")
    strength.set(xlim=(0, 1), ylim=common.span(tau_p, above))
    return figure


def figure_4(d: Data):
    """Draw the nucleation stress of one field, and theory against the ruptures."""
    figure, top, middle, bottom = common.mosaic(7.6, "a;b;c", (0.9, 1.0, 1.3))
    shown = d["representative"]
    tau_p, tau_n = (_shifted(shown, name) / MEAN for name in ("strength", "tau_n"))
    top.plot(X, tau_p, "--", color="grey", lw=0.8, label=r"$\tau_\mathrm{p}$")
    top.plot(X, tau_n, color="C1", label=r"$\tau_\mathrm{n}$")
    top.plot(X[tau_n.argmin()], tau_n.min(), "o", color="black", ms=5)
    top.legend(loc="upper right", ncols=2)
    bottom.plot([0, 1], [0, 1], color="grey", lw=0.8)
    for ratio in SIMULATED:
        stress, _ = paired(d, ratio, "local", "critical_stress")
        stress, style = stress / MEAN, common.dots(ratio)
        middle.plot(stress, 100 * offsets(d, ratio, "local"), **style, ms=4, label=f"{ratio:g}")
        place, predicted, off = is_misplaced(d, ratio)
        bottom.plot(predicted / L, place / L, **style, ms=4)
        bottom.plot(predicted[off] / L, place[off] / L, "o", mfc="none", mec="firebrick", ms=9)
        if "printed" in d:
            thin = {"mfc": "none", "mew": 0.7, "label": f"{ratio:g}, printed modulus"}
            middle.plot(stress, 100 * offsets(d, ratio, "printed"), **style | thin, ms=4)
            place, predicted, off = is_misplaced(d, ratio, "printed")
            bottom.plot(predicted[off] / L, place[off] / L, "x", color=style["color"], ms=7)
    middle.axhline(0, color="grey", lw=0.8)
    middle.locator_params(axis="x", nbins=6)
    middle.legend(title=XI, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.1))
    return figure


def figure_5(d: Data):
    """Draw strength, nucleation stress and onset at all correlation lengths."""
    names = ("a", *(f"field {ratio}" for ratio in RATIOS[1:]))
    rows = [[name, "strengths", "minima"] for name in names]
    rows += [["b", "densities", "."], 3 * ["c"], 3 * ["d"]]
    heights = (*len(RATIOS) * (1.5 / len(RATIOS),), 0.9, 0.9, 0.6)
    figure, *panels = common.mosaic(8.4, rows, heights, width_ratios=(4, 1, 1.2))
    first, strengths, minima, *fields, nucleation, densities, stress, place = panels
    fields = [first, *fields]
    s = np.linspace(LOW, HIGH, 300)
    strengths.plot(LAW.pdf(s) * MEAN, s / MEAN, color="black")
    low, high = common.span(common.STRENGTH_RANGE)
    strengths.set(ylim=(low, high))
    shown = {minima: [], nucleation: [], stress: []}
    for ratio, strip in zip(RATIOS, fields, strict=True):
        look = common.line(ratio)
        colour = look["color"]
        tau_p = setting.strength(ratio).sample(PROBLEM.interface)  # of the same draws for each
        strip.plot(X, tau_p[0] / MEAN, color=colour, lw=0.9)
        strip.text(0.99, 0.97, f"{XI} = {ratio:g}", color=colour, ha="right", va="top",
                   transform=strip.transAxes)  # fmt: skip
        strip.set(xlim=(0, 1), ylim=(low, high + 0.8 * (high - low)))
        strip.locator_params(axis="y", nbins=3)
        strip.tick_params(labelbottom=strip is fields[-1])
        tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)[0] / MEAN
        nucleation.plot(X, tau_n, **look, lw=0.9)
        shown[nucleation].append(tau_n)
        counts = d.at("moments", "counts", ratio).reshape(-1, 32).sum(axis=1)
        edges = np.linspace(LOW, HIGH, counts.size + 1) / MEAN
        density = counts / counts.sum() / (edges[1] - edges[0])
        densities.plot(density, 0.5 * (edges[1:] + edges[:-1]), **look)
        weakest = d.at("moments", "weakest_strength", ratio)
        least = smooth_density(weakest, bounds=setting.DENSITY_BOUNDS)
        minima.plot(least.value / least.value.max(), least.x / MEAN, **look)
        x, value, error = stress_density(d, ratio)
        stress.plot(x / MEAN, value * MEAN, **look, label=f"{ratio:g}")
        band = [(value + sign * 2 * error) * MEAN for sign in (-1, 1)]
        stress.fill_between(x / MEAN, *band, color=colour, alpha=0.25, lw=0)
        shown[minima].append(least.x[least.value > 1e-3 * least.value.max()] / MEAN)
        shown[stress].append(x[value > 1e-3 * value.max()] / MEAN)
        share, edges = np.histogram(d.at("local", "critical_position", ratio) / L, 20, (0, 1))
        place.stairs(share / d.size.samples * 20, edges, baseline=None, color=colour, lw=0.9)
    stress.legend(title=XI)
    for axes in (strengths, minima, densities):  # narrow
        axes.set_xticks([])
        axes.tick_params(labelleft=axes is strengths)
    for axes in (nucleation, densities):
        axes.set_ylim(common.span(*shown[nucleation]))
    fields[1].set_ylabel(r"$\tau_\mathrm{p}/\langle\tau_\mathrm{p}\rangle$", y=0.0)
    minima.yaxis.tick_right()
    minima.tick_params(labelright=True)
    minima.locator_params(axis="y", nbins=5)
    minima.set(ylim=common.span(*shown[minima], margin=0.0))
    error = 2 * np.sqrt(20.0 / d.size.samples)
    place.axhspan(1 - error, 1 + error, color="0.93", lw=0, zorder=0)
    if setting.SUPPORT[0] > 0.0:
        stress.axvline(LOW / MEAN, color="grey", lw=0.8, ls=":")
        shown[stress].append(LOW / MEAN)
    stress.set(xlim=common.span(*shown[stress], margin=0.02), ylim=(0, None))
    place.set(xlim=(0, 1), ylim=(0, None))
    return figure


_PLACES = np.array([np.log2(FIRST) - 1.2, *np.log2(RATIOS), np.log2(LAST) + 1.2])
"""Places on the axis: zero, the correlation lengths on a logarithm, and infinity."""


def _statistics(axes, table, end) -> None:
    """Draw mean, median and lower quartile; `end` has them at infinity, all are 1 at zero."""
    styles = (("mean", "-", "o", "C0"), ("median", "--", "s", "C1"),
              ("25 % quantile", ":", "^", "C2"))  # fmt: skip
    for i, (name, dashes, marker, colour) in enumerate(styles):
        rows = [numbers[i] for numbers in table]
        style = {"color": colour, "ls": dashes, "marker": marker, "label": name}
        common.numbers(axes, _PLACES[1:-1], rows, **style)
        values = np.array([1.0, *(number.value for number in rows), end[i]])
        for ends in (slice(2), slice(-2, None)):
            axes.plot(_PLACES[ends], values[ends], color=colour, ls=(0, (1, 2)), lw=0.9)
        axes.plot(_PLACES[[0, -1]], values[[0, -1]], marker, color=colour, ms=4, mfc="white")
    axes.set_xticks(_PLACES, ("0", *(f"{ratio:g}" for ratio in RATIOS), r"$\infty$"))
    for place in (_PLACES[0] + 0.6, _PLACES[-1] - 0.6):
        axes.text(place, 0, "//", transform=axes.get_xaxis_transform(), ha="center", va="center",
                  fontsize=9)  # fmt: skip
    axes.set(xlim=common.span(_PLACES))  # also without a limit at infinity


def figure_6(d: Data):
    """Draw mean, median and lower quartile of tau_n and of tau_cr."""
    figure, top, bottom = common.mosaic(6.4, "a;b", (0.85, 1.3))
    edges = np.linspace(LOW, HIGH, d["moments"].sizes["cell"] + 1) / MEAN
    table = []
    for ratio in RATIOS:
        counts = np.cumsum(d.at("moments", "counts", ratio))
        quartiles = np.interp([0.5, 0.25], counts / counts[-1], edges[1:])
        average = mean(1.0 + d.at("moments", "powers", ratio)[:, 0])
        table.append((average, *map(Number, quartiles)))
    _statistics(top, table, [1.0, *LAW.ppf([0.5, 0.25]) / MEAN])
    top.legend(loc="lower left")
    onsets = [d.stress(ratio) / MEAN for ratio in RATIOS]
    table = [(mean(row), quantile(row, 0.5), quantile(row, 0.25)) for row in onsets]
    low = LOW / MEAN if setting.SUPPORT[0] > 0.0 else np.nan  # no limit without a bound
    _statistics(bottom, table, [low, low, low])
    bottom.axhline(low, color="grey", lw=0.8, ls=":")
    places = np.log2(SIMULATED)
    look = {"color": "firebrick", "mfc": "none", "ms": 6, "lw": 0.8, "fmt": "D"}
    raw = [mean(d.stress(ratio, "ruptures") / MEAN) for ratio in SIMULATED]
    common.numbers(bottom, places, raw, **look, label=f"{d.size.ruptures} ruptures each")
    inset = bottom.inset_axes((0.5, 0.5, 0.48, 0.48))
    common.numbers(inset, np.log2(RATIOS), [mean(d.excess(r)) * 100 for r in RATIOS], color="C0",
                   fmt="-o", label="equilibrium")  # fmt: skip
    pairs = [mean(offsets(d, ratio, "local")) * 100 for ratio in SIMULATED]
    common.numbers(inset, places, pairs, **look, label="ruptures")
    inset.axhline(0, color="grey", lw=0.8)
    common.ratio_axis(inset)
    inset.set(ylabel="theory above (%)", xlim=(_PLACES[1] - 0.4, _PLACES[-2] + 0.4))
    inset.legend(handlelength=1.2)
    handles, labels = bottom.get_legend_handles_labels()
    bottom.legend(handles[-1:], labels[-1:], loc=(0.02, 0.12))
    return figure


def figure_7(d: Data):
    """Draw correlation, eigenfunction and the variance of tau_n."""
    figure, correlation, eigenfunction, *variances = common.mosaic(5.4, "ab;cd")
    theory = d["theory"]
    for ratio in RATIOS:
        values = theory["correlation"].sel(correlation_ratio=ratio)
        correlation.plot(theory.x / L, values, **common.line(ratio), label=f"{ratio:g}")
    correlation.set(xlim=(0, min(1.9 * LAST * H / L, 0.5)))
    correlation.legend(title=XI)
    s = np.linspace(-1, 1, 200)
    eigenfunction.plot(s, (0.925 - 0.308 * s**2) * np.sqrt(1 - s**2), color="C0")
    eigenfunction.set(ylim=(0, None))
    slope = float(theory["infinite"][0] / theory["ratio"][0])
    powers = d["moments"]["powers"].mean("sample")
    sampled = (powers[:, 1] - powers[:, 0] ** 2) * (MEAN / setting.DEVIATION) ** 2
    for axes, high in zip(variances, (8, 1), strict=True):
        axes.plot(theory.ratio, theory.infinite, color="C0", label="infinite interface")
        axes.plot(theory.usable, theory.periodic, "--", color="C1", label="this interface")
        short = rf"{slope:.2f} {XI}"
        axes.plot([0, 1.0 / slope], [0, 1.0], ":", color="firebrick", label=short)
        axes.plot(RATIOS, sampled, "o", color="black", ms=4)
        axes.set(xlim=(0, high), ylim=(0, 1.02))
        axes.axhline(1.0, color="grey", lw=0.8, ls="--")
    variances[0].legend(loc="lower right")
    return figure
