"""Fields of a plane as maps: x to the right, y upwards, a node the centre of its cell."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from stiction._typing import Array
from stiction.interface import Interface
from stiction.plot.axes import MILLI

GREYS = LinearSegmentedColormap.from_list("pale greys", ["#6e6e6e", "#fbfbfb"])
"""Light enough for outlines to be seen on it."""
BAR: dict[str, Any] = {"location": "bottom", "shrink": 0.8, "pad": 0.02, "aspect": 40}


def edges(interface: Interface) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of the map, mm."""
    (x, y), (dx, dy) = interface.lengths, interface.spacings
    left, right, bottom, top = -0.5 * dx, x - 0.5 * dx, -0.5 * dy, y - 0.5 * dy
    return left * MILLI, right * MILLI, bottom * MILLI, top * MILLI


def image(axes: Axes, interface: Interface, field: Array, **options: Any) -> Any:
    """A field (nx, ny) of a plane."""
    return axes.imshow(
        field.T, origin="lower", extent=edges(interface), interpolation="nearest", aspect="equal",
        **options,
    )  # fmt: skip


def outline(
    axes: Axes, interface: Interface, mask: NDArray[np.bool_], ink: str, width: float
) -> None:
    """The border of a set of nodes, closed across the borders of the map."""
    if not mask.any() or mask.all():
        return
    padded = np.pad(mask.astype(float), 1, mode="wrap")
    (dx, dy), (nx, ny) = interface.spacings, mask.shape
    x, y = np.arange(-1, nx + 1) * dx * MILLI, np.arange(-1, ny + 1) * dy * MILLI
    axes.contour(x, y, padded.T, levels=[0.5], colors=[ink], linewidths=[width])
    keep_edges(axes, interface)


def keep_edges(axes: Axes, interface: Interface) -> None:
    """Show the plane once, whatever was drawn beyond it."""
    left, right, bottom, top = edges(interface)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def label(axes: Axes) -> None:
    """Name the directions."""
    axes.set_xlabel("$x$ (mm), direction of slip")
    axes.set_ylabel("$y$ (mm)")


def relative_height(interface: Interface) -> float:
    """Of a map over its width, within what fits on a page."""
    x, y = interface.lengths
    return float(np.clip(y / x, 0.2, 2.0))
