"""One rupture: slip rate in space and time, and the speed of its front."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from numpy.typing import NDArray

from stiction.plot import maps
from stiction.plot.axes import need, node_of, on_axes, problem_of, unit_for, with_unit
from stiction.plot.fields import finish_line, places
from stiction.plot.style import ACCENT, INK, PAGE, series
from stiction.problem import Problem

Array = NDArray[np.float64]

COLORS = "inferno_r"
DECADES = 7.0
"""Of slip rate below the largest that are drawn."""
BEFORE = 0.11
"""Time before the onset that is drawn, in units of L/c_s."""
KEEP = "; keep it with simulate_rupture(save=st.Save(...))"


def rupture(run: xr.Dataset, *, problem: Problem | None = None, ax: Axes | None = None) -> Axes:
    """Draw slip rate in space and time; on a plane the advance of the front.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture`, on a line with `slip_rate`.
    problem : Problem, optional
        Needed only if the run does not hold it.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        A dot marks the onset, where time is zero. On a line, time begins shortly before it,
        and points that slip seven decades slower than the fastest one are white. On a
        plane, the front is drawn at equal intervals of time on a map of the strength.

    Raises
    ------
    InputError
        If a variable was not kept.
    """
    need(run, "onset_time", "critical_position")
    problem = problem_of(run, problem)
    if problem.interface.is_plane:
        need(run, "peak_strength", "arrival_time")
        with on_axes(ax, height=maps.height(problem.interface, 1.6)) as axes:
            _draw_front(axes, run, problem)
        return axes
    need(run, "slip_rate", hint=KEEP)
    with on_axes(ax, width=PAGE, height=3.4) as axes:
        mesh, text = _draw_space_time(axes, run, problem)
        finish_line(axes, problem.interface, text)
        axes.figure.colorbar(mesh, ax=axes, extend="min", label="slip rate (m/s)")
    return axes


def front(run: xr.Dataset, *, problem: Problem | None = None, ax: Axes | None = None) -> Axes:
    """Draw the apparent speed of the rupture front against the wave speeds.

    Patches that grow ahead of the front can make it look faster than c_d.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture`.
    problem : Problem, optional
        Needed only if the run does not hold it.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        On a plane along x and along y through the critical position.

    Raises
    ------
    InputError
        If the front was not recorded.
    """
    need(run, "front_speed", "critical_position")
    problem = problem_of(run, problem)
    interface, solid = problem.interface, problem.solid
    factor, unit = unit_for("m", interface.lengths)
    speed = run["front_speed"].values
    with on_axes(ax) as axes:
        if interface.is_plane:
            i, j = node_of(run["critical_position"], interface)
            lines = {"x": speed[:, j], "y": speed[i, :]}
            for number, (dim, values) in enumerate(lines.items()):
                place = interface.coordinates[dim] * factor
                style: dict[str, Any] = {"markersize": 2.5, "color": (INK, ACCENT)[number]}
                axes.plot(place, values, ".", label=f"along ${dim}$", **style)
            axes.legend()
        else:
            axes.plot(places(interface), speed, ".", color=INK, markersize=2)
        waves = [("$c_R$", solid.rayleigh_wave_speed), ("$c_s$", solid.shear_wave_speed)]
        if problem.mode == "II":
            waves.append(("$c_d$", solid.dilatational_wave_speed))
        sides = ("top", "bottom", "center")  # c_R and c_s lie close together
        for i, (name, value) in enumerate(waves):
            axes.axhline(value, linewidth=0.9, **series(i + 1))
            transform = axes.get_yaxis_transform()
            axes.text(1.01, value, name, transform=transform, va=sides[i], color=INK)
        axes.set_ylim(0.0, 1.6 * waves[-1][1])
        axes.set_xlim(0.0, max(interface.lengths) * factor)
        axes.set_xlabel(f"position ({unit})")
        axes.set_ylabel("front speed (m/s)")
    return axes


def since_onset(run: xr.Dataset) -> tuple[Array, str]:
    """Return the times of the frames, s, and their name: from the onset, if there is one."""
    onset = float(run["onset_time"])
    if np.isfinite(onset):
        return run["time"].values - onset, "time since the onset"
    return run["time"].values, "time"


def rate_scale(rate: Array, decades: float) -> LogNorm:
    """Return the scale of colours: some decades below the largest slip rate."""
    top = max(float(rate.max()), 1e-12)
    return LogNorm(top * 10.0**-decades, top)


def _draw_space_time(axes: Axes, run: xr.Dataset, problem: Problem) -> tuple[Any, str]:
    """Draw slip rate and the onset; return the mesh and the label of the time."""
    since, name = since_onset(run)
    rate = run["slip_rate"].values
    norm = rate_scale(rate, DECADES)
    near = since >= -BEFORE * problem.interface.extent / problem.solid.shear_wave_speed
    if near.sum() > 2:
        since, rate = since[near], rate[near]
    factor, unit = unit_for("s", since)
    length, _ = unit_for("m", problem.interface.lengths)
    x, spacing = problem.interface.x, problem.interface.spacing
    along = np.append(x, x[-1] + spacing) - 0.5 * spacing
    edges = np.concatenate([since[:1], 0.5 * (since[1:] + since[:-1]), since[-1:]])
    mesh = axes.pcolormesh(
        along * length, edges * factor, masked(rate, norm), norm=norm,
        cmap=COLORS, rasterized=True,
    )  # fmt: skip
    if name != "time":
        place = float(run["critical_position"]) * length
        axes.plot([place], [0.0], "o", color=INK, markersize=3.5, clip_on=False, zorder=5)
    return mesh, with_unit(name, unit)


def masked(rate: Array, norm: LogNorm) -> Any:
    """Return slip rates with what is below the scale left out: it stays white."""
    return np.ma.masked_less(rate, norm.vmin or 0.0)


def finite_strength(run: xr.Dataset) -> Array:
    """Return the peak strength, Pa, NaN where it is infinite."""
    strength = run["peak_strength"].values
    return np.where(np.isfinite(strength), strength, np.nan)


def _draw_front(axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Draw the front at equal intervals of time on a map of the strength."""
    interface = problem.interface
    strength = finite_strength(run)
    factor, unit = unit_for("Pa", strength)
    maps.image(axes, interface, strength * factor, rf"strength $\tau_p$ ({unit})", cmap="Greys")
    since = run["arrival_time"].values - float(run["onset_time"])
    scale, time_unit = unit_for("s", since)
    later = since[np.isfinite(since) & (since > 0.0)]
    length, _ = unit_for("m", interface.lengths)
    if later.size and np.ptp(later) > 0.0:
        x, y = (length * place for place in interface.coordinates.values())
        levels = np.linspace(0.0, scale * float(later.max()), 10)[1:-1]
        lines = axes.contour(
            x, y, scale * since.T, levels=levels, cmap="viridis", linewidths=0.9
        )
        bar = ScalarMappable(lines.norm, lines.cmap)
        text = f"front ({time_unit} since the onset)"
        axes.figure.colorbar(bar, ax=axes, label=text, shrink=0.8)
    place = [length * float(one) for one in run["critical_position"]]
    axes.plot(*place, "o", color=ACCENT, markersize=4.0, markeredgecolor="white")
