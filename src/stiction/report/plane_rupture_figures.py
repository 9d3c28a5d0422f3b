"""A rupture on a plane in pictures: its front, slip rates at some moments, and a film."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure, FigureBase

from stiction._typing import Array
from stiction.plot.plane_films import RATES, edges, fast, length_unit, rate_scale, unit_of
from stiction.plot.style import ACCENT, INK, PAGE, new_figure, panel, paper_style, series
from stiction.problem import Problem

_STRENGTH = "Greys"
_MEGA = 1e6
_SNAPSHOTS = 6
_CONTOURS = 10


def _finite(strength: Array) -> Array:
    return np.where(np.isfinite(strength), strength, np.nan)


def _contours(figure: FigureBase, axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Strength in grey, and where the front is at equal intervals of time after the onset."""
    factor, unit = length_unit(run)
    strength = _finite(run["peak_strength"].values) / _MEGA
    drawn = axes.imshow(
        strength.T, origin="lower", extent=edges(run, factor), cmap=_STRENGTH, aspect="equal"
    )
    figure.colorbar(drawn, ax=axes, label=r"$\tau_p$ (MPa)", shrink=0.8)
    since = run["arrival_time"].values - float(run["onset_time"])
    scale, name = unit_of(since, ("s", "ms", "µs"))
    x, y = (factor * place for place in problem.interface.coordinates.values())
    later = since[np.isfinite(since) & (since > 0.0)]
    if later.size and np.ptp(later) > 0.0:
        levels = np.linspace(0.0, scale * float(later.max()), _CONTOURS + 1)[1:-1]
        lines = axes.contour(x, y, scale * since.T, levels=levels, cmap="viridis", linewidths=0.9)
        figure.colorbar(
            ScalarMappable(lines.norm, lines.cmap), ax=axes, label=f"front, $t - T$ ({name})",
            shrink=0.8,
        )  # fmt: skip
    place = [factor * float(one) for one in run["critical_position"]]
    axes.plot(*place, "o", color=ACCENT, markersize=4.0, markeredgecolor="white")
    axes.set_xlabel(f"$x$, along the slip ({unit})")
    axes.set_ylabel(f"$y$ ({unit})")


def _moments(run: xr.Dataset) -> list[int]:
    """Frames from the onset to the end of the front, spread evenly in time."""
    times, onset = run["time"].values, float(run["onset_time"])
    arrival = run["arrival_time"].values
    passed = arrival[np.isfinite(arrival)]
    end = max(float(passed.max()), onset) if passed.size else float(times[-1])
    wanted = onset + np.linspace(0.0, 1.0, _SNAPSHOTS) * (end - onset)
    return [int(np.argmin(np.abs(times - moment))) for moment in wanted]


def plane_rupture_figure(run: xr.Dataset, problem: Problem) -> Figure:
    """The front on the strength, the mean stress, and the slip rate at six moments."""
    factor, unit = length_unit(run)
    times, onset = run["time"].values, float(run["onset_time"])
    shown = _moments(run)
    rate = run["slip_rate"].values[shown]
    norm = rate_scale(rate)
    scale, name = unit_of(times[shown] - onset, ("s", "ms", "µs"))
    with paper_style():
        figure = new_figure(PAGE, 5.6)
        parts: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.15])
        upper, lower = parts
        front, load = upper.subplots(1, 2, width_ratios=[2.1, 1.0])
        _contours(upper, front, run, problem)
        load.plot(
            (run["step_time"].values - onset) * scale,
            run["step_mean_stress"].values / _MEGA,
            color=INK,
        )
        first, last = times[shown[0]] - onset, times[-1] - onset
        load.set_xlim(scale * (first - 0.15 * (last - first)), scale * last)
        load.set_xlabel(f"$t - T$ ({name})")
        load.set_ylabel(r"$\langle\tau\rangle$ (MPa)")
        below = list(lower.subplots(2, 3, sharex=True, sharey=True).ravel())
        for i, (axes, frame, values) in enumerate(zip(below, shown, rate, strict=True)):
            axes.imshow(
                fast(values, norm), origin="lower", norm=norm, cmap=RATES,
                extent=edges(run, factor), aspect="equal",
            )  # fmt: skip
            axes.set_title(f"{scale * (times[frame] - onset):.3g} {name}", fontsize="medium")
            axes.set_xlabel(f"$x$ ({unit})" if i >= 3 else "")
            axes.set_ylabel(f"$y$ ({unit})" if i % 3 == 0 else "")
        lower.colorbar(
            ScalarMappable(norm, RATES), ax=below, label="slip rate (m/s)", extend="min",
            shrink=0.8,
        )  # fmt: skip
        for letter, axes in zip("abc", (front, load, below[0]), strict=True):
            panel(axes, letter, y=1.06)
    return figure


def plane_front_figure(run: xr.Dataset, problem: Problem) -> Figure:
    """Arrival and apparent speed of the front along x and y through the critical position."""
    factor, unit = length_unit(run)
    interface, solid = problem.interface, problem.solid
    since = run["arrival_time"].values - float(run["onset_time"])
    scale, name = unit_of(since, ("s", "ms", "µs"))
    node = [
        round(float(at) / h) % n
        for at, h, n in zip(
            run["critical_position"].values, interface.spacings, interface.shape, strict=True
        )
    ]
    waves = [
        ("$c_R$", solid.rayleigh_wave_speed),
        ("$c_s$", solid.shear_wave_speed),
        ("$c_d$", solid.dilatational_wave_speed),
    ]
    lines: list[Any] = [(slice(None), node[1]), (node[0], slice(None))]
    with paper_style():
        figure = new_figure(PAGE, 4.2)
        panels = figure.subplots(2, 2, sharex="col", sharey="row")
        for column, (dim, through) in enumerate(zip(interface.dims, lines, strict=True)):
            above, below = panels[:, column]
            place = factor * interface.coordinates[dim]
            above.plot(place, scale * since[through], color=INK)
            below.plot(place, run["front_speed"].values[through], ".", color=INK, markersize=2.5)
            for axes in (above, below):
                at = factor * float(run["critical_position"][column])
                axes.axvline(at, color=ACCENT, linewidth=0.6, linestyle=":")
            for i, (label, value) in enumerate(waves):
                below.axhline(value, linewidth=0.9, **series(i + 1))
                if column == 1:
                    below.text(
                        1.01, value, label, transform=below.get_yaxis_transform(),
                        va=("top", "bottom", "center")[i], color=INK,
                    )  # fmt: skip
            below.set_xlabel(f"${dim}$ ({unit})")
            below.set_ylim(0.0, 1.6 * waves[-1][1])
            panel(above, "ab"[column])
        panels[0, 0].set_ylabel(f"$t - T$ ({name})")
        panels[1, 0].set_ylabel("front speed (m/s)")
    return figure
