"""Figures of one rupture with several panels: space and time, and the front."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stiction.plot.axes import MICRO, MILLI
from stiction.plot.ruptures import (
    COLORS,
    FASTEST,
    SLOWEST,
    draw_mesh,
    front,
    mark_onset,
    near_onset,
    need,
    shown_strength,
)
from stiction.plot.style import (
    ACCENT,
    COLUMN,
    INK,
    PAGE,
    new_figure,
    panel,
    paper_style,
)
from stiction.problem import Problem
from stiction.report.plane_rupture_figures import plane_front_figure, plane_rupture_figure


def _nucleation_arrow(axes: Axes, problem: Problem, run: xr.Dataset, height: float) -> None:
    """h_n as a double arrow centred on the critical position."""
    if problem.friction.weakening_rate is None:
        return
    steepest = float(np.max(problem.friction.weakening_rate))
    half = 0.5 * problem.nucleation_length_of(steepest) * MILLI
    centre = float(run["critical_position"]) * MILLI
    axes.annotate(
        "",
        (centre - half, height),
        (centre + half, height),
        arrowprops={"arrowstyle": "<->", "color": ACCENT, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    # Beside the arrow, on the side where there is room.
    right = centre + half < 0.9 * problem.interface.extent * MILLI
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
    need(run, "slip_rate", "step_time", "peak_strength", plane=True)
    if problem.interface.is_plane:
        return plane_rupture_figure(run, problem)
    x, times = run["x"].values, run["time"].values
    rate = run["slip_rate"].values
    onset = float(run["onset_time"])
    end = times[-1]
    with paper_style():
        figure = new_figure(PAGE, 6.3)
        grid = figure.add_gridspec(3, 3, height_ratios=[1, 2, 2], width_ratios=[1.1, 4, 0.1])
        top = figure.add_subplot(grid[0, 1])
        zoom = figure.add_subplot(grid[1, 1], sharex=top)
        whole = figure.add_subplot(grid[2, 1], sharex=top)
        beside = figure.add_subplot(grid[2, 0], sharey=whole)
        bar = figure.add_subplot(grid[1:, 2])

        strength = shown_strength(run)
        top.plot(x * MILLI, strength, color=INK, linewidth=0.9)
        lowest, highest = np.nanmin(strength), np.nanmax(strength)
        height = highest + 0.04 * (highest - lowest)
        _nucleation_arrow(top, problem, run, height)
        top.set_ylabel(r"$\tau_\mathrm{p}$ (MPa)")
        top.set_ylim(lowest - 0.05, height + 0.25 * (highest - lowest))

        near = near_onset(problem, times, onset)
        draw_mesh(zoom, x, (times[near] - onset) * MICRO, rate[near])
        zoom.set_ylabel(r"$t - T$ (µs)")
        draw_mesh(whole, x, times / onset, rate)
        for axes, moment in ((zoom, 0.0), (whole, 1.0)):
            mark_onset(axes, run, moment)
        # Long enough after the onset for the fall to show at this scale.
        low = times[0] / onset
        whole.set_ylim(low, max(end / onset, 1.0 + 0.03 * (1.0 - low)))
        whole.set_xlabel("$x$ (mm)")
        whole.set_xlim(0.0, problem.interface.extent * MILLI)
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
            ScalarMappable(LogNorm(SLOWEST, FASTEST), COLORS), cax=bar, extend="both",
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
    need(run, "arrival_time", "front_speed", "onset_time", plane=True)
    if problem.interface.is_plane:
        return plane_front_figure(run, problem)
    x = run["x"].values * MILLI
    arrival = (run["arrival_time"].values - float(run["onset_time"])) * MICRO
    with paper_style():
        figure = new_figure(COLUMN * 1.15, 4.2)
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(x, arrival, color=INK)
        above.set_ylabel("$t - T$ (µs)")
        place = float(run["critical_position"]) * MILLI
        above.axvline(place, color=ACCENT, linewidth=0.6, linestyle=":")
        front(run, problem=problem, ax=below)
        panel(above, "a")
        panel(below, "b")
    return figure
