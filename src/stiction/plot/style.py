"""The style of all figures: column widths of a journal, and lines that differ also in grey."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib.style
from cycler import cycler

COLUMN = 3.375
PAGE = 6.75
"""Widths of a column and of a page, inches."""

INK = "#1a1a1a"
QUIET = "#7a7a7a"
PALE = "#d9d9d9"
BAND = "#cfe0ea"
ACCENT = "#b5322a"

SLIP_RATE = "inferno_r"
"""Colours of slip rates."""

# Each colour also has its own dashes. To readers with deuteranopia,
# protanopia or tritanopia, two colours differ by at least 19 units of
# CAM02-UCS.
_SERIES: tuple[tuple[str, Any], ...] = (
    ("#14213d", "-"),
    ("#2a6f97", (0, (5.0, 1.4))),
    ("#c8553d", (0, (3.5, 1.2, 1.0, 1.2))),
    ("#e0a030", (0, (1.2, 1.0))),
    ("#62b4a4", (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5))),
    ("#b391e3", (0, (2.5, 2.5))),
)
MARKERS = "os^DvP"
"""Markers of the same series."""

_RC: dict[str, Any] = {
    "font.family": ["STIXGeneral", "DejaVu Serif"],  # by name: "serif" is looked up when drawn
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=[color for color, _ in _SERIES]),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "figure.dpi": 110,
    "savefig.dpi": 220,
    "pdf.fonttype": 42,
    "figure.constrained_layout.use": True,
}


@contextmanager
def paper_style() -> Iterator[None]:
    """Set the fonts, widths, colours and ticks of a printed page for figures drawn inside.

    Inside, a user's style, such as a dark style, has no effect.

    >>> with matplotlib.style.context({"font.size": 30.0, "lines.marker": "x"}):
    ...     with paper_style():
    ...         matplotlib.rcParams["font.size"], matplotlib.rcParams["lines.marker"] == "x"
    ...     matplotlib.rcParams["font.size"]
    (8.5, False)
    30.0
    """
    with matplotlib.style.context(["default", _RC]):
        yield


def series(index: int) -> dict[str, Any]:
    """Return plot keywords for series number `index`: colour and dashes.

    Six series differ, and the seventh is as the first:

    >>> series(6) == series(0), len({str(series(index)) for index in range(6)})
    (True, 6)
    >>> series(0)
    {'color': '#14213d', 'linestyle': '-'}
    """
    color, dashes = _SERIES[index % len(_SERIES)]
    return {"color": color, "linestyle": dashes}


def color(index: int) -> str:
    """Return the colour of series number `index`.

    >>> color(1), color(8)
    ('#2a6f97', '#c8553d')
    """
    return str(series(index)["color"])
