"""The style of all figures: column widths of a journal, and lines that differ also in grey."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib.colors
import matplotlib.style
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.text import Text

COLUMN = 3.375
PAGE = 6.75
"""Widths of a column and of a page, inches."""

MIN_CONTRAST = 4.5
MID_LUMINANCE = 0.18
"""Luminance at which black and white have the same contrast."""

INK = "#1a1a1a"
QUIET = "#7a7a7a"
PALE = "#d9d9d9"
BAND = "#cfe0ea"
ACCENT = "#b5322a"

SLIP_RATE = "inferno_r"
"""Colours of slip rates."""

# Each colour also has its own dashes and marker. To readers with
# deuteranopia, protanopia or tritanopia, two colours differ by at least
# 19 units of CAM02-UCS.
_SERIES: tuple[tuple[str, Any, str], ...] = (
    ("#14213d", "-", "o"),
    ("#2a6f97", (0, (5.0, 1.4)), "s"),
    ("#c8553d", (0, (3.5, 1.2, 1.0, 1.2)), "^"),
    ("#e0a030", (0, (1.2, 1.0)), "D"),
    ("#62b4a4", (0, (7.0, 1.5, 1.0, 1.5, 1.0, 1.5)), "v"),
    ("#b391e3", (0, (2.5, 2.5)), "P"),
)

_RC: dict[str, Any] = {
    "font.family": ["STIXGeneral", "DejaVu Serif"],  # by name: "serif" is looked up when drawn
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=[color for color, _, _ in _SERIES]),
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
    """
    with matplotlib.style.context(["default", _RC]):
        yield


def readable(color: Any, background: Any) -> Any:
    """Return a colour with the same hue, and a contrast of at least 4.5 to 1 with a background.

    The contrast is defined in the Web Content
    Accessibility Guidelines 2.1, 1.4.3.
    """

    def luminance(colour: Any) -> float:
        rgb = np.array(matplotlib.colors.to_rgb(colour))
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(linear @ (0.2126, 0.7152, 0.0722))

    behind = luminance(background)
    target = 1.0 if behind < MID_LUMINANCE else 0.0
    for share in np.linspace(0.0, 1.0, 21):  # towards white or black
        rgb = (1.0 - share) * np.array(matplotlib.colors.to_rgb(color)) + share * target
        high, low = sorted((luminance(rgb), behind), reverse=True)
        if (high + 0.05) / (low + 0.05) >= MIN_CONTRAST:
            break
    return tuple(rgb)


def keep_contrast(axes: Axes, given: set[Any]) -> None:
    """Make new lines and texts on a user's axes readable. The `given` artists stay unchanged."""
    background = axes.get_facecolor()
    if background[3] == 0.0:
        background = axes.figure.get_facecolor()
    for artist in set(axes.get_children()) - given:
        if isinstance(artist, Line2D | Text) and artist.get_alpha() in (None, 1.0):
            artist.set_color(readable(artist.get_color(), background))


def series(index: int, *, marker: bool = False) -> dict[str, Any]:
    """Return plot keywords for series `index`: colour, dashes and (on request) marker."""
    color, dashes, symbol = _SERIES[index % len(_SERIES)]
    style: dict[str, Any] = {"color": color, "linestyle": dashes}
    if marker:
        style["marker"] = symbol
    return style


def color(index: int) -> str:
    """Return the colour of series number `index`."""
    return str(series(index)["color"])


def panel(axes: Axes, letter: str) -> None:
    """Write the letter of a panel above its upper left corner."""
    axes.text(
        0.0, 1.02, f"({letter})", transform=axes.transAxes, fontweight="bold", va="bottom"
    )
