"""What all figures share: panels and their texts, ticks and error bars."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from reproduction.setting import HIGH, LOW, MEAN, RATIOS

WIDTH = 4.5  # inches; type of 8.5 points is then 9 pixels high on a screen of 390 pixels
DASHES = ("-", "--", "-.", ":", (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5)), (0, (2.5, 2.5)))
STRENGTH_RANGE = (LOW / MEAN, HIGH / MEAN)  # the range of the strength over its mean
XI = r"$\xi_0/h_\mathrm{n}$"


def mosaic(height: float, rows, ratios=None, **shape):
    """Return a figure of one column and its panels, as `Figure.subplot_mosaic` places them.

    A panel whose name is a letter is printed with it.
    """
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, *figure.subplot_mosaic(rows, height_ratios=ratios, **shape).values()


def label(figure: Figure, stated: dict[str, dict]) -> None:
    """Letter the panels above their upper left corners, and add what `page.toml` states."""
    for axes in figure.axes:
        name = axes.get_label()
        axes.set(**stated.get(name, {}))
        if len(name) == 1:
            axes.set_title(f"({name})", loc="left", fontweight="bold")


def line(ratio: float) -> dict:
    """Return colour and dashes of a correlation length."""
    i = RATIOS.index(ratio)
    return {"color": f"C{i}", "linestyle": DASHES[i]}


def dots(ratio: float) -> dict:
    """Return colour and marker of a correlation length."""
    i = RATIOS.index(ratio)
    return {"color": f"C{i}", "marker": "os^DvP"[i], "linestyle": "none"}


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
    """Put ticks on an axis of log2(xi_0/h_n)."""
    plain_ticks(axes.xaxis, np.log2(RATIOS), [f"{ratio:g}" for ratio in RATIOS])
