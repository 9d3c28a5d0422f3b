"""Fields of a plane as maps: x to the right, y upwards, a node at the centre of its cell."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from stiction.interface import Interface
from stiction.plot.axes import unit_for

GREYS = LinearSegmentedColormap.from_list("pale greys", ["#6e6e6e", "#fbfbfb"])
"""Light enough for visible outlines on it."""


def edges(interface: Interface) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of the map in the unit of its axes."""
    factor, _ = unit_for("m", interface.lengths)
    (x, y), (dx, dy) = interface.lengths, interface.spacings
    ends = -0.5 * dx, x - 0.5 * dx, -0.5 * dy, y - 0.5 * dy
    left, right, bottom, top = (end * factor for end in ends)
    return left, right, bottom, top


def image(
    axes: Axes, interface: Interface, field: NDArray[Any], text: str, **options: Any
) -> Any:
    """Draw a field (nx, ny) of a plane with its scale and names of the directions."""
    drawn = axes.imshow(
        field.T, origin="lower", extent=edges(interface), interpolation="nearest", aspect="equal",
        **options,
    )  # fmt: skip
    axes.figure.colorbar(
        drawn, ax=axes, label=text, location="bottom", shrink=0.8, pad=0.02, aspect=40
    )
    _, unit = unit_for("m", interface.lengths)
    axes.set_xlabel(f"$x$ ({unit}), direction of slip")
    axes.set_ylabel(f"$y$ ({unit})")
    return drawn


def outline(
    axes: Axes, interface: Interface, mask: NDArray[np.bool_], ink: str, width: float
) -> None:
    """Draw the border of a set of nodes, closed across the borders of the map."""
    if not mask.any() or mask.all():
        return
    padded = np.pad(mask.astype(float), 1, mode="wrap")
    factor, _ = unit_for("m", interface.lengths)
    x, y = (
        np.arange(-1, n + 1) * h * factor
        for h, n in zip(interface.spacings, mask.shape, strict=True)
    )
    axes.contour(x, y, padded.T, levels=[0.5], colors=[ink], linewidths=[width])
    keep_edges(axes, interface)


def keep_edges(axes: Axes, interface: Interface) -> None:
    """Show the plane once, whatever was drawn beyond it."""
    left, right, bottom, top = edges(interface)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def height(interface: Interface, more: float = 1.0) -> float:
    """Return the height of a figure, inches, with one map and `more` for the rest."""
    x, y = interface.lengths
    return more + 4.0 * float(np.clip(y / x, 0.2, 2.0))
