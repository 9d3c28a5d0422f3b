"""How slip patches grow as the load rises."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm

from stiction._typing import Array
from stiction.errors import InputError
from stiction.plot import maps
from stiction.plot.axes import MEGA, MICRO, MILLI, need, on_axes, problem_of
from stiction.plot.fields import finish_line
from stiction.plot.style import PAGE
from stiction.problem import Problem


def equilibrium_path(
    path: xr.Dataset,
    *,
    load: int | None = None,
    problem: Problem | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw slip along the interface at each load of a path; on a plane a map at one load.

    Parameters
    ----------
    path : Dataset
        From `stiction.equilibrium_path`; loads at which the interface slides are left out.
    load : int, optional
        Number of the load on a plane; the highest in equilibrium if left out.
    problem : Problem, optional
        Needed only where the result does not hold it.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If no load of the path is in equilibrium.
    """
    need(path, "slip", "sliding")
    interface = problem_of(path, problem).interface
    loads = path["load"].values * MEGA
    balanced = np.flatnonzero(~path["sliding"].values)
    if balanced.size == 0:
        raise InputError("path: the interface slides at every load of it; give lower ones")
    if interface.is_plane:
        number = int(balanced[-1]) if load is None else load
        if number not in balanced:
            raise InputError(
                f"load: {number} is not in equilibrium; of this path loads {balanced.min()} to"
                f" {balanced.max()} are"
            )
        slip = path["slip"].values[number]
        with on_axes(ax, height=1.2 + 4.0 * maps.relative_height(interface)) as axes:
            drawn = draw_slip(axes, interface, slip, loads[number], float(slip.max()))
            axes.figure.colorbar(drawn, ax=axes, label=r"slip ($\mu$m)", **maps.BAR)
        return axes
    with on_axes(ax, width=PAGE, height=2.6) as axes:
        import matplotlib

        shades = matplotlib.colormaps["viridis_r"](np.linspace(0.12, 1.0, balanced.size))
        for shade, number in zip(shades, balanced.tolist(), strict=True):
            slip = path["slip"].values[number] * MICRO
            axes.plot(
                interface.x * MILLI, slip, color=shade, linewidth=0.9,
                label=f"{loads[number]:.4f} MPa",
            )  # fmt: skip
        finish_line(axes, interface, r"slip ($\mu$m)")
        axes.set_ylim(bottom=0.0)
        if balanced.size <= 8:
            axes.legend(title=r"load $\tau_0$")
    return axes


def draw_slip(axes: Axes, interface: Any, slip: Array, load: float, most: float) -> Any:
    """Slip (m) of a plane at a load (MPa) with the border of what slips; the image is returned."""
    # Slip grows steeply with the load: a root shows small patches beside the last ones.
    norm = PowerNorm(0.4, vmin=0.0, vmax=max(most * MICRO, 1e-300))
    drawn = maps.image(axes, interface, slip * MICRO, cmap="viridis", norm=norm)
    moving = slip > 0.0
    maps.outline(axes, interface, moving, "white", 0.4)
    share = 100.0 * moving.mean()
    axes.set_title(rf"$\tau_0$ = {load:.4f} MPa, {share:.2g} % slips", fontsize=7.5)
    maps.label(axes)
    return drawn
