"""A posterior on one page: each parameter against its prior, pairs, predicted peaks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction._typing import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stiction.inference.posterior import Posterior

INK, QUIET, PALE, ACCENT = "#14213d", "#7a7a7a", "#d9d9d9", "#b5322a"
_SCALES = ((1e-6, "{} (MPa)", ("low", "high", "loc", "scale", "mean", "strength", "stress")),
           (1e3, "{} (mm)", ("length", "slip")))  # fmt: skip


def shown(name: str, values: Array) -> tuple[float, str]:
    """Scale and label of a parameter for an axis."""
    last = name.split(".")[-1]
    for scale, text, ends in _SCALES:
        big = scale > 1.0 or np.abs(values).max() > 1e3
        if big and any(last.endswith(end) for end in ends):
            return scale, text.format(name)
    return 1.0, name


def posterior_figure(posterior: Posterior) -> Figure:
    """Marginals on the diagonal, pairs below, peaks in the upper corner."""
    from matplotlib.figure import Figure

    names = posterior.names
    count = len(names)
    size = max(2.0 * count, 4.0)
    figure = Figure(figsize=(size + 3.2, size), layout="constrained", dpi=110)
    parts: Any = figure.subfigures(1, 2, width_ratios=[size, 3.2])
    left, right = parts
    axes = left.subplots(count, count, squeeze=False)
    prior = posterior.likelihood.model.prior
    rng = np.random.default_rng(0)
    before = prior.theta(rng.random((20_000, prior.dimension)))
    scaled = []
    for i, name in enumerate(names):
        scale, label = shown(name, before[:, i])
        scaled.append((scale * posterior.draws[name].ravel(), scale * before[:, i], label))
    for i in range(count):
        for j in range(count):
            own = axes[i, j]
            if j > i:
                own.set_axis_off()
                continue
            (_marginal if i == j else _pair)(own, scaled[j], scaled[i])
            own.tick_params(labelsize=7)
            own.spines[["top", "right"]].set_visible(False)
            if i == count - 1:
                own.set_xlabel(scaled[j][2], fontsize=8)
            else:
                own.tick_params(labelbottom=False)
            if j == 0 and i > 0:
                own.set_ylabel(scaled[i][2], fontsize=8)
            elif j > 0 or i == 0:
                own.tick_params(labelleft=False)
            if i == j:
                own.set_yticks([])
                own.set_title(f"{posterior.information[names[i]]:.2f} nats", fontsize=8, loc="left")
    if count > 1:  # where there are no pairs
        left.legend(*axes[0, 0].get_legend_handles_labels(), fontsize=8, frameon=False)
    else:
        axes[0, 0].legend(fontsize=7, frameon=False)
    _peaks(right, posterior)
    return figure


def _marginal(axes: Any, pair: Any, _: Any) -> None:
    after, before, _label = pair
    low, high = map(float, np.quantile(before, [0.002, 0.998]))
    log = low > 0.0 and high > 6.0 * low
    bins = np.geomspace(low, high, 46) if log else np.linspace(low, high, 46)
    for values, style in (
        (before, {"color": PALE, "histtype": "stepfilled", "label": "prior"}),
        (after, {"color": INK, "histtype": "step", "label": "posterior", "linewidth": 1.2}),
    ):
        axes.hist(values, bins=bins, weights=np.full(values.size, 1.0 / values.size), **style)
    if log:
        _logarithmic(axes, "x")


def _pair(axes: Any, along: Any, up: Any) -> None:
    step = max(1, along[0].size // 1500)
    axes.plot(along[0][::step], up[0][::step], ".", color=INK, markersize=1.5, alpha=0.35)
    for values, axis in ((along[1], "x"), (up[1], "y")):
        ends = np.quantile(values, [0.002, 0.998])
        getattr(axes, f"set_{axis}lim")(*ends)
        if ends[0] > 0.0 and ends[1] > 6.0 * ends[0]:
            _logarithmic(axes, axis)


def _logarithmic(axes: Any, name: str) -> None:
    """A logarithmic axis with plain numbers at 1, 2, 5, 10, ..."""
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    getattr(axes, f"set_{name}scale")("log")
    axis = getattr(axes, f"{name}axis")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ScalarFormatter())
    axis.set_minor_formatter(NullFormatter())


def _peaks(figure: Any, posterior: Posterior) -> None:
    """Distribution functions of the measured and predicted peaks."""
    peaks = posterior.peaks
    axes = figure.subplots(len(peaks.values), 1, squeeze=False)[:, 0]
    coefficients = peaks.coefficients
    scale = 1.0 if coefficients else 1e-6
    for own, length, values, more in zip(
        axes, peaks.lengths, peaks.values, posterior.predicted, strict=True
    ):
        ordered = np.sort(values) * scale
        steps = (np.arange(ordered.size) + 0.5) / ordered.size
        quantiles = np.linspace(0.002, 0.998, 250)
        own.plot(np.quantile(more, quantiles) * scale, quantiles, color=INK, label="predicted")
        own.plot(ordered, steps, "o", color=ACCENT, markersize=3.5, label="measured")
        if posterior.likelihood.model.error > 0.0:
            own.errorbar(
                ordered, steps, xerr=posterior.likelihood.model.error * scale,
                fmt="none", ecolor=ACCENT, elinewidth=0.6, alpha=0.6,
            )  # fmt: skip
        own.set_xlabel("coefficient of friction" if coefficients else "peak (MPa)", fontsize=8)
        own.set_ylabel("share of tests", fontsize=8)
        own.tick_params(labelsize=7)
        own.spines[["top", "right"]].set_visible(False)
        text = f"{values.size} tests" + ("" if length is None else f", length {length:g} m")
        own.set_title(text, fontsize=8, loc="left", color=QUIET)
        own.legend(fontsize=7, frameon=False)
