"""One rupture in pictures: space and time, the front's speed, and a film."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from stiction.errors import InputError
from stiction.problem import Problem
from stiction.report.film import check_film_name, write_film
from stiction.report.plane_rupture_figures import (
    plane_front_figure,
    plane_rupture_figure,
    plane_rupture_film,
)
from stiction.report.style import (
    ACCENT,
    COLUMN,
    INK,
    PAGE,
    PALE,
    QUIET,
    new_figure,
    panel,
    paper_style,
    series,
)

Floats = NDArray[np.float64]

_COLORS = "inferno_r"
_SLOWEST, _FASTEST = 1e-6, 10.0  # m/s, ends of the colour scale
_BEFORE = 0.11  # creep before the peak that the zoom shows, in units of L/c_s
_MEGA, _MILLI, _MICRO = 1e6, 1e3, 1e6


def _need(run: xr.Dataset, *names: str) -> None:
    missing = [name for name in names if name not in run]
    if missing:
        raise InputError(
            f"run: has no {', '.join(missing)}; keep it with simulate_rupture(variables=...), or "
            "read a stored run with open_rupture"
        )


def _shown_strength(run: xr.Dataset) -> Floats:
    """Peak strength, MPa, with gaps where it is infinite."""
    strength = run["peak_strength"].values / _MEGA
    return np.where(np.isfinite(strength), strength, np.nan)


def _edges(centres: Floats) -> Floats:
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([centres[:1], middle, centres[-1:]])


def _mesh(axes: Axes, x: Floats, times: Floats, rate: Floats) -> Any:
    """Slip rate on a logarithmic scale; what sticks stays white."""
    shown = np.ma.masked_less(rate, _SLOWEST)
    spacing = x[1] - x[0]
    along = np.append(x - 0.5 * spacing, x[-1] + 0.5 * spacing)
    return axes.pcolormesh(
        along * _MILLI,
        _edges(times),
        shown,
        norm=LogNorm(_SLOWEST, _FASTEST),
        cmap=_COLORS,
        rasterized=True,
    )


def _nucleation_arrow(axes: Axes, problem: Problem, run: xr.Dataset, height: float) -> None:
    """h_n as a double arrow centred on the critical position."""
    if problem.friction.weakening_rate is None:
        return
    steepest = float(np.max(problem.friction.weakening_rate))
    half = 0.5 * problem.nucleation_length_of(steepest) * _MILLI
    centre = float(run["critical_position"]) * _MILLI
    axes.annotate(
        "",
        (centre - half, height),
        (centre + half, height),
        arrowprops={"arrowstyle": "<->", "color": ACCENT, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    # Beside the arrow, on the side where there is room.
    right = centre + half < 0.9 * problem.interface.extent * _MILLI
    at, align = (centre + 1.3 * half, "left") if right else (centre - 1.3 * half, "right")
    axes.text(at, height, r"$h_\mathrm{n}$", color=ACCENT, ha=align, va="center")


def rupture_figure(run: xr.Dataset, problem: Problem) -> Figure:
    """Slip rate in space and time, load beside it, strength above (Albertini et al. 2020, Fig. 3).

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`, with `slip_rate` and the record of every step.
    problem : Problem
        The one that was simulated.

    Returns
    -------
    matplotlib.figure.Figure
        (a) peak strength with the nucleation length; (b) slip rate around the onset; (c) over the
        whole run, with (d) the mean stress beside it. Of a plane: (a) peak strength with the front
        at equal intervals of time, (b) the mean stress, and below the slip rate at six moments.

    Raises
    ------
    InputError
        If a variable was not kept.
    """
    _need(run, "slip_rate", "step_time", "peak_strength")
    if problem.interface.is_plane:
        return plane_rupture_figure(run, problem)
    x, times = run["x"].values, run["time"].values
    rate = run["slip_rate"].values
    onset = float(run["onset_time"])
    place = float(run["critical_position"]) * _MILLI
    end = times[-1]
    with paper_style():
        figure = new_figure(PAGE, 6.3)
        grid = figure.add_gridspec(3, 3, height_ratios=[1, 2, 2], width_ratios=[1.1, 4, 0.1])
        top = figure.add_subplot(grid[0, 1])
        zoom = figure.add_subplot(grid[1, 1], sharex=top)
        whole = figure.add_subplot(grid[2, 1], sharex=top)
        beside = figure.add_subplot(grid[2, 0], sharey=whole)
        bar = figure.add_subplot(grid[1:, 2])

        strength = _shown_strength(run)
        top.plot(x * _MILLI, strength, color=INK, linewidth=0.9)
        lowest, highest = np.nanmin(strength), np.nanmax(strength)
        height = highest + 0.04 * (highest - lowest)
        _nucleation_arrow(top, problem, run, height)
        top.set_ylabel(r"$\tau_\mathrm{p}$ (MPa)")
        top.set_ylim(lowest - 0.05, height + 0.25 * (highest - lowest))

        before = _BEFORE * problem.interface.extent / problem.solid.shear_wave_speed
        near = np.flatnonzero(times >= onset - before)
        near = near if near.size > 2 else np.arange(times.size)
        _mesh(zoom, x, (times[near] - onset) * _MICRO, rate[near])
        zoom.set_ylabel(r"$t - T$ (µs)")
        _mesh(whole, x, times / onset, rate)
        for axes, moment in ((zoom, 0.0), (whole, 1.0)):
            axes.plot([place], [moment], "o", color=INK, markersize=3.5, clip_on=False, zorder=5)
        # Long enough after the onset for the fall to show at this scale.
        low = times[0] / onset
        whole.set_ylim(low, max(end / onset, 1.0 + 0.03 * (1.0 - low)))
        whole.set_xlabel("$x$ (mm)")
        whole.set_xlim(0.0, problem.interface.extent * _MILLI)
        for axes in (top, zoom):
            axes.tick_params(labelbottom=False)
        whole.tick_params(labelleft=False)

        peak = float(run["critical_stress"])
        record = run["step_mean_stress"].values / peak
        beside.plot(
            np.append(1.0 * record, record[-1]), np.append(run["step_time"], end) / onset, color=INK
        )
        beside.plot([1.0], [1.0], "o", color=INK, markersize=3.5, clip_on=False)
        beside.set_xlabel(r"$\langle\tau\rangle/\tau_{\mathrm{cr}}$")
        beside.set_ylabel("$t/T$")
        beside.yaxis.set_major_locator(MaxNLocator(5))
        beside.set_xlim(min(record.min(), 0.0) - 0.02, 1.08)
        figure.colorbar(
            ScalarMappable(LogNorm(_SLOWEST, _FASTEST), _COLORS), cax=bar, extend="both",
            label="slip rate (m/s)",
        )  # fmt: skip
        for letter, axes in zip("abcd", (top, zoom, whole, beside), strict=True):
            panel(axes, letter)
    return figure


def front_figure(run: xr.Dataset, problem: Problem) -> Figure:
    """Where the rupture front is, and how fast, against the wave speeds.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`.
    problem : Problem

    Returns
    -------
    matplotlib.figure.Figure
        (a) time at which each node had half of its critical slip; (b) apparent speed of the
        front. Patches that grow ahead of it can make it look faster than c_d. Of a plane: both
        along x and along y through the critical position.
    """
    _need(run, "arrival_time", "front_speed", "onset_time")
    if problem.interface.is_plane:
        return plane_front_figure(run, problem)
    x = run["x"].values * _MILLI
    arrival = (run["arrival_time"].values - float(run["onset_time"])) * _MICRO
    speed = run["front_speed"].values
    solid = problem.solid
    with paper_style():
        figure = new_figure(COLUMN * 1.15, 4.2)
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(x, arrival, color=INK)
        above.set_ylabel("$t - T$ (µs)")
        place = float(run["critical_position"]) * _MILLI
        above.axvline(place, color=ACCENT, linewidth=0.6, linestyle=":")
        below.plot(x, speed, ".", color=INK, markersize=2.0)
        waves = [("$c_R$", solid.rayleigh_wave_speed), ("$c_s$", solid.shear_wave_speed)]
        if problem.mode == "II":
            waves.append(("$c_d$", solid.dilatational_wave_speed))
        sides = ("top", "bottom", "center")  # c_R and c_s lie close
        for i, (name, value) in enumerate(waves):
            below.axhline(value, linewidth=0.9, **series(i + 1))
            place_of = below.get_yaxis_transform()
            below.text(1.01, value, name, transform=place_of, va=sides[i], color=INK)
        below.set_ylim(0.0, 1.6 * waves[-1][1])
        below.set_xlim(0.0, problem.interface.extent * _MILLI)
        below.set_xlabel("$x$ (mm)")
        below.set_ylabel("front speed (m/s)")
        panel(above, "a")
        panel(below, "b")
    return figure


def rupture_film(
    run: xr.Dataset,
    problem: Problem,
    path: str | Path,
    *,
    pictures: int = 160,
    rate: int = 20,
) -> Path:
    """Write a film of a rupture: stress and slip rate, of a line above each other with strength.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`, with `slip_rate`, `shear_stress`.
    problem : Problem
    path : path
        Ends in .gif, or in .mp4 where ffmpeg is installed (matplotlib's writer finds it).
    pictures : int
        At most so many; they are spread evenly over the frames of the run, which lie closer in
        time as the interface accelerates.
    rate : int
        Pictures a second.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If a variable was not kept, or the file type is not known.
    """
    _need(run, "slip_rate", "shear_stress", "peak_strength")
    target = Path(path)
    check_film_name(target)
    if problem.interface.is_plane:
        return plane_rupture_film(run, problem, target, pictures=pictures, rate=rate)
    x = run["x"].values * _MILLI
    times, onset = run["time"].values, float(run["onset_time"])
    stress = run["shear_stress"].values / _MEGA
    slip_rate = np.maximum(run["slip_rate"].values, 1e-9)
    strength = _shown_strength(run)
    mean = run["mean_stress"].values / _MEGA
    with paper_style():
        figure = new_figure(PAGE * 0.9, 3.8)
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(x, strength, color=PALE, linewidth=1.0, label=r"$\tau_p$")
        (line,) = above.plot(x, stress[0], color=INK, label=r"$\tau$")
        above.set_ylabel("stress (MPa)")
        highest = np.nanmax(strength)
        margin = 0.06 * (highest - np.nanmin(strength))
        above.set_ylim(min(0.0, stress.min()) - margin, max(highest, stress.max()) + margin)
        above.legend(loc="upper right", ncols=2)
        (moving,) = below.semilogy(x, slip_rate[0], color=ACCENT)
        below.set_ylim(1e-7, 100.0)
        below.set_xlim(0.0, problem.interface.extent * _MILLI)
        below.set_xlabel("$x$ (mm)")
        below.set_ylabel("slip rate (m/s)")
        clock = above.text(0.0, 1.04, " ", transform=above.transAxes, color=QUIET)

        def show(i: int) -> None:
            line.set_ydata(stress[i])
            moving.set_ydata(slip_rate[i])
            clock.set_text(
                f"$t - T$ = {(times[i] - onset) * _MICRO:,.1f} µs,  "
                rf"$\langle\tau\rangle$ = {mean[i]:.3f} MPa"
            )

        return write_film(
            target, figure, [line, moving, clock], show, times.size, pictures=pictures, rate=rate
        )
