"""One rupture in space and time, and the speed of its front."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from numpy.typing import NDArray

from stiction.errors import InputError
from stiction.plot.axes import MEGA, MICRO, MILLI, on_axes, problem_of
from stiction.plot.style import INK, PAGE, series
from stiction.problem import Problem

Floats = NDArray[np.float64]

COLORS = "inferno_r"
SLOWEST, FASTEST = 1e-6, 10.0
"""Ends of the scale of colours, m/s."""
BEFORE = 0.11
"""Creep before the onset that is shown, in units of L/c_s."""


def rupture(
    run: xr.Dataset,
    *,
    problem: Problem | None = None,
    whole: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw slip rate in space and time.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture` or `open_rupture`, with `slip_rate`.
    problem : Problem, optional
        Needed only where the run does not hold it.
    whole : bool
        From the first slip on, time over that of the onset, T; else from shortly before the onset.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes
        A dot marks the onset. What slips slower than 1 um/s is white.

    Raises
    ------
    InputError
        If the slip rate was not kept, or the run is of a plane.
    """
    need(run, "slip_rate", "onset_time", "critical_position")
    problem = problem_of(run, problem)
    x, times = run["x"].values, run["time"].values
    rate, onset = run["slip_rate"].values, float(run["onset_time"])
    with on_axes(ax, width=PAGE, height=3.4) as axes:
        if whole:
            mesh = draw_mesh(axes, x, times / onset, rate)
            axes.set_ylabel("$t/T$")
        else:
            near = near_onset(problem, times, onset)
            mesh = draw_mesh(axes, x, (times[near] - onset) * MICRO, rate[near])
            axes.set_ylabel(r"$t - T$ (µs)")
        mark_onset(axes, run, 1.0 if whole else 0.0)
        axes.set_xlim(0.0, problem.interface.extent * MILLI)
        axes.set_xlabel("position $x$ (mm)")
        axes.figure.colorbar(mesh, ax=axes, extend="both", label="slip rate (m/s)")
    return axes


def front(run: xr.Dataset, *, problem: Problem | None = None, ax: Axes | None = None) -> Axes:
    """Draw the apparent speed of the rupture front along the interface, against the wave speeds.

    Patches that grow ahead of the front can make it look faster than c_d.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture` or `open_rupture`.
    problem : Problem, optional
        Needed only where the run does not hold it.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the front was not recorded.
    """
    need(run, "front_speed")
    problem = problem_of(run, problem)
    solid = problem.solid
    with on_axes(ax) as axes:
        axes.plot(run["x"].values * MILLI, run["front_speed"].values, ".", color=INK, markersize=2)
        waves = [("$c_R$", solid.rayleigh_wave_speed), ("$c_s$", solid.shear_wave_speed)]
        if problem.mode == "II":
            waves.append(("$c_d$", solid.dilatational_wave_speed))
        sides = ("top", "bottom", "center")  # c_R and c_s lie close
        for i, (name, value) in enumerate(waves):
            axes.axhline(value, linewidth=0.9, **series(i + 1))
            place_of = axes.get_yaxis_transform()
            axes.text(1.01, value, name, transform=place_of, va=sides[i], color=INK)
        axes.set_ylim(0.0, 1.6 * waves[-1][1])
        axes.set_xlim(0.0, problem.interface.extent * MILLI)
        axes.set_xlabel("$x$ (mm)")
        axes.set_ylabel("front speed (m/s)")
    return axes


def need(run: xr.Dataset, *names: str, plane: bool = False) -> None:
    """Refuse a run without these variables, or of a plane where that cannot be drawn.

    Raises
    ------
    InputError
        That says how to keep them, or how to take a line out of a plane.
    """
    if not isinstance(run, xr.Dataset):
        raise InputError(f"run: must be an xarray.Dataset, got {type(run).__name__}")
    missing = [name for name in names if name not in run]
    if missing:
        raise InputError(
            f"run: has no {', '.join(missing)}; keep it with simulate_rupture(variables=...), or "
            "read a stored run with open_rupture"
        )
    if "y" in run.dims and not plane:
        raise InputError("run: is of a plane; choose one line of it with run.isel(y=...)")


def shown_strength(run: xr.Dataset) -> Floats:
    """Peak strength, MPa, with gaps where it is infinite."""
    strength = run["peak_strength"].values * MEGA
    return np.where(np.isfinite(strength), strength, np.nan)


def near_onset(problem: Problem, times: Floats, onset: float) -> NDArray[np.intp]:
    """Numbers of the frames from shortly before the onset on."""
    before = BEFORE * problem.interface.extent / problem.solid.shear_wave_speed
    near = np.flatnonzero(times >= onset - before)
    return near if near.size > 2 else np.arange(times.size)


def mark_onset(axes: Axes, run: xr.Dataset, moment: float) -> None:
    """A dot where and when the interface begins to slide."""
    place = float(run["critical_position"]) * MILLI
    axes.plot([place], [moment], "o", color=INK, markersize=3.5, clip_on=False, zorder=5)


def draw_mesh(axes: Axes, x: Floats, times: Floats, rate: Floats) -> Any:
    """Slip rate on a logarithmic scale; what sticks stays white."""
    shown = np.ma.masked_less(rate, SLOWEST)
    spacing = x[1] - x[0]
    along = np.append(x - 0.5 * spacing, x[-1] + 0.5 * spacing)
    return axes.pcolormesh(
        along * MILLI,
        _edges(times),
        shown,
        norm=LogNorm(SLOWEST, FASTEST),
        cmap=COLORS,
        rasterized=True,
    )


def _edges(centres: Floats) -> Floats:
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([centres[:1], middle, centres[-1:]])
