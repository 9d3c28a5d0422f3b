"""What all figures share: width, letters of panels, ticks and error bars."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from reproduction.setting import HIGH, LOW, MEAN, RATIOS

WIDTH = 4.5
"""Inches; type of 8.5 points is then 9 pixels high on a screen of 390 pixels."""
DASHES = ("-", "--", "-.", ":", (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5)), (0, (2.5, 2.5)))
STRENGTHS = (LOW / MEAN, HIGH / MEAN)
"""The range of the strength over its mean."""
XI = r"$\xi_0/h_\mathrm{n}$"
TAU_CR = r"$\tau_\mathrm{cr}$"
MEAN_P = r"$\langle\tau_\mathrm{p}\rangle$"
OVER_MEAN = r"/\langle\tau_\mathrm{p}\rangle$"


def new(height: float) -> Figure:
    return Figure(figsize=(WIDTH, height), layout="constrained")


def stacked(height: float, count: int, ratios=None, **shape):
    """Return a figure of one column, and its panels below each other."""
    figure = new(height)
    return figure, *np.ravel(figure.subplots(count, height_ratios=ratios, **shape))


def mosaic(height: float, rows, height_ratios, **shape):
    """Return a figure of one column and its panels, as `Figure.subplot_mosaic` places them."""
    figure = new(height)
    return figure, *figure.subplot_mosaic(rows, height_ratios=height_ratios, **shape).values()


def line(ratio: float) -> dict:
    """Return colour and dashes of a correlation length."""
    i = RATIOS.index(ratio)
    return {"color": f"C{i}", "linestyle": DASHES[i]}


def dots(ratio: float) -> dict:
    """Return colour and marker of a correlation length."""
    i = RATIOS.index(ratio)
    return {"color": f"C{i}", "marker": "os^DvP"[i], "linestyle": "none"}


def letters(*panels) -> None:
    """Letter panels in their order, above their upper left corners."""
    for text, axes in zip("abcd", panels, strict=False):
        axes.set_title(f"({text})", loc="left", fontweight="bold")


def span(*rows, margin: float = 0.06) -> tuple[float, float]:
    """Return limits that hold all finite values, with a margin."""
    values = np.concatenate([np.ravel(row) for row in rows])
    values = values[np.isfinite(values)]
    gap = margin * (np.ptp(values) or abs(values[0]) or 1.0)
    return float(values.min() - gap), float(values.max() + gap)


def numbers(axes, x, rows, **style) -> None:
    """Draw numbers with two standard errors."""
    values, errors = [n.value for n in rows], [2 * n.error for n in rows]
    axes.errorbar(x, values, errors, **{"ms": 4} | style)


def plain_ticks(axis, places, labels=None) -> None:
    """Put ticks at these places only, with plain labels."""
    axis.set_ticks(places, labels or [f"{place:g}" for place in places])
    axis.set_ticks([], minor=True)


def log_ticks(axis) -> None:
    """Put plain labels at 1, 2 and 5 of each decade."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def ratio_axis(axes) -> None:
    """Label an axis of log2(xi_0/h_n)."""
    plain_ticks(axes.xaxis, np.log2(RATIOS), [f"{ratio:g}" for ratio in RATIOS])
    axes.set_xlabel(XI)
