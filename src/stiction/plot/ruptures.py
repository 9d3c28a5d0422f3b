"""One rupture: slip rate in space and time, and the advance of its front on a plane."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from numpy.typing import NDArray

from stiction.plot import maps
from stiction.plot.axes import need, on_axes, problem_of, unit_for, with_unit
from stiction.plot.fields import finish_line
from stiction.plot.style import ACCENT, INK, PAGE
from stiction.problem import Problem

Array = NDArray[np.float64]

COLORS = "inferno_r"
DECADES = 7.0
"""Of slip rate below the largest that are drawn."""
BEFORE = 0.11
"""Time before the onset that is drawn, in units of L/c_s."""
KEEP = "; keep it with simulate_rupture(save=st.Save(['slip_rate']))"


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
        _draw_space_time(axes, run, problem)
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


def _draw_space_time(axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Draw slip rate and the onset."""
    interface = problem.interface
    (since, name), rate = since_onset(run), run["slip_rate"].values
    norm = rate_scale(rate, DECADES)
    near = since >= -BEFORE * interface.extent / problem.solid.shear_wave_speed
    if near.sum() > 2:
        since, rate = since[near], rate[near]
    factor, unit = unit_for("s", since)
    length, _ = unit_for("m", interface.lengths)
    along = (np.arange(interface.size + 1) - 0.5) * interface.spacing
    edges = np.concatenate([since[:1], 0.5 * (since[1:] + since[:-1]), since[-1:]])
    mesh = axes.pcolormesh(
        along * length, edges * factor, masked(rate, norm), norm=norm,
        cmap=COLORS, rasterized=True,
    )  # fmt: skip
    if name != "time":
        place = float(run["critical_position"]) * length
        axes.plot([place], [0.0], "o", color=INK, markersize=3.5, clip_on=False, zorder=5)
    finish_line(axes, interface, with_unit(name, unit))
    axes.figure.colorbar(mesh, ax=axes, extend="min", label="slip rate (m/s)")


def masked(rate: Array, norm: LogNorm) -> Any:
    """Return slip rates with what is below the scale left out: it stays white."""
    return np.ma.masked_less(rate, norm.vmin or 0.0)


def finite_strength(run: xr.Dataset) -> Array:
    """Return the peak strength, Pa, NaN where it is infinite."""
    strength = run["peak_strength"].values
    return np.where(np.isfinite(strength), strength, np.nan)


def _draw_front(axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Draw the front at equal intervals of time on a map of the strength."""
    interface, strength = problem.interface, finite_strength(run)
    factor, unit = unit_for("Pa", strength)
    maps.image(axes, interface, strength * factor, rf"strength $\tau_p$ ({unit})", cmap="Greys")
    since = run["arrival_time"].values - float(run["onset_time"])
    scale, time_unit = unit_for("s", since)
    latest = scale * float(np.nanmax(since, initial=0.0))
    length, _ = unit_for("m", interface.lengths)
    if latest > 0.0:
        x, y = (length * place for place in interface.coordinates.values())
        levels = np.linspace(0.0, latest, 10)[1:-1]
        lines = axes.contour(
            x, y, scale * since.T, levels=levels, cmap="viridis", linewidths=0.9
        )
        bar = ScalarMappable(lines.norm, lines.cmap)
        text = f"front ({time_unit} since the onset)"
        axes.figure.colorbar(bar, ax=axes, label=text, shrink=0.8)
    place = [length * float(one) for one in run["critical_position"]]
    axes.plot(*place, "o", color=ACCENT, markersize=4.0, markeredgecolor="white")
