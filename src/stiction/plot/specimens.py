"""Figures of specimens: the blocks and their drive, and the curve that a machine records."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import check
from stiction.base.units import unit_for
from stiction.inference.curves import Curves
from stiction.plot.axes import (
    FigureAxes,
    named,
    need,
    new_figure,
    on_axes,
    problem_of,
    with_unit,
)
from stiction.plot.fields import chosen_row, strength_of
from stiction.plot.slider import draw as draw_slider
from stiction.plot.style import ACCENT, COLUMN, INK, PAGE, PALE, QUIET, paper_style, series
from stiction.problem.problem import Problem
from stiction.problem.specimen import Pusher, Slider


def specimen(
    problem: Problem, strength: Any = None, result: xr.Dataset | None = None, *, sample: int = 0
) -> NDArray[Any]:
    """Draw a specimen and its drive, and the shear and pressure on the interface.

    Parameters
    ----------
    problem : Problem
        A problem with a specimen.
    strength : array, optional
        tau_p, Pa, with shape (nodes,) or (samples, nodes), or with
        labels and units.
    result : Dataset, optional
        From `stiction.onset` with this strength. The critical patch
        between blocks is marked.
    sample : int
        Number of the sample, counted from 0.

    Returns
    -------
    (2,) or (3,) array of matplotlib.axes.Axes
        The specimen, and below it the profiles along the interface. For
        blocks, the profiles are the shear and the pressure of the drive.
        A slider is drawn to scale, with its shear, pressure and slip at
        the first instability. It needs a strength (friction coefficients).

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
    ...     interface=st.Interface(length=0.1, nodes=128),
    ...     friction=st.LinearWeakening(weakening_rate=0.2e12),
    ...     specimen=st.Blocks(height=0.05, drive=st.Pusher(height=0.01, width=0.005)),
    ... )
    >>> len(st.plot.specimen(problem))
    2
    """
    check("problem", problem, Problem)
    if isinstance(problem.specimen, Slider):
        if strength is None:
            raise InputError(
                "strength: give it, because the pressure of a slider depends on it"
            )
        given = problem.sample(strength)
        chosen_row(given.strength, {} if result is None else {"onset": result}, sample)
        return draw_slider(problem, given.part(slice(int(sample), int(sample) + 1)))
    blocks, interface = problem.blocks, problem.interface
    rows = None if strength is None else strength_of(problem, strength)
    if result is not None:
        need(result, "critical_position", "critical_patch_length")
    onset = chosen_row(rows, {} if result is None else {"onset": result}, sample).get("onset")
    figure = new_figure(1.35 * COLUMN, 1.5 * COLUMN)
    with paper_style():
        top, below = figure.subplots(2, sharex=True, height_ratios=(1.0, 1.2))
    scale, unit = unit_for("m", interface.lengths)
    _draw_blocks(top, problem, scale)
    top.set_ylabel(f"height ({unit})")
    x = interface.x * scale
    if rows is not None:
        tau_p = rows[int(sample)]
        below.plot(x, tau_p / np.nanmean(tau_p), color=QUIET, linewidth=0.7, label="strength")
    below.plot(x, blocks.shear, label="shear of the drive $q$", **series(0))
    below.plot(x, blocks.pressure, label="pressure $p$", **series(1))
    if onset is not None:
        middle = float(onset["critical_position"].item()) * scale
        half = 0.5 * float(onset["critical_patch_length"].item()) * scale
        for axes in (top, below):
            axes.axvspan(middle - half, middle + half, color=ACCENT, alpha=0.3, linewidth=0.0)
        below.plot([], [], color=ACCENT, alpha=0.3, linewidth=6.0, label="critical patch")
    below.set(xlabel=f"position $x$ ({unit})", ylabel="over the mean", ylim=(0.0, None))
    with paper_style():
        figure.legend(loc="outside lower center", ncols=2)
    return np.array([top, below])


def _draw_blocks(axes: Axes, problem: Problem, scale: float) -> None:
    """Draw two blocks, and arrows for the drive. Heights have a separate scale."""
    blocks, length = problem.specimen, problem.interface.measure * scale
    assert blocks is not None  # `problem.blocks` has refused it
    height, drive = blocks.height * scale, blocks.drive
    for low in (-height, 0.0):
        axes.add_patch(Rectangle((0.0, low), length, height, facecolor=PALE, edgecolor=QUIET))
    axes.plot([0.0, length], [0.0, 0.0], color="black", linewidth=1.2)
    arrow = {"color": ACCENT, "width": 0.004 * length, "length_includes_head": True}
    reach, head = 0.14 * length, {"head_width": 0.03 * length}
    for up in (1.0, -1.0):
        if isinstance(drive, Pusher):
            at, half = up * drive.height * scale, 0.5 * drive.width * scale
            sides = ("left", "right") if drive.side == "both" else (drive.side,)
            for side in sides:
                end = 0.0 if side == "left" else length
                # Upper block: pushed at the left, or pulled if driven
                # to the left.
                pushed = up if side == "left" or drive.side == "both" else -up
                outside = -1.0 if side == "left" else 1.0
                start = end + outside * reach if pushed * outside < 0.0 else end
                axes.arrow(start, at, pushed * reach, 0.0, **arrow, **head)
                axes.plot([end, end], [at - half, at + half], color=ACCENT, linewidth=3.0)
        else:
            axes.plot([0.0, length], [up * height] * 2, color=ACCENT, linewidth=3.0)
            axes.arrow(
                0.5 * (length - up * 2.0 * reach), up * 1.15 * height, 2.0 * up * reach, 0.0,
                **arrow, **head,
            )  # fmt: skip
    axes.set(xlim=(-0.2 * length, 1.2 * length), ylim=(-1.3 * height, 1.3 * height))


def force_travel(
    result: xr.Dataset | Sequence[xr.Dataset],
    *,
    measured: Curves | None = None,
    ax: Axes | None = None,
) -> FigureAxes:
    """Draw the curve of a machine: force against travel of the drives, with drops.

    Parameters
    ----------
    result : Dataset, or sequence of Dataset
        From `stiction.equilibrium_path` for a specimen, at many loads.
        Several paths, for samples from the same field, are drawn as a
        median, with a band that contains 90 % of them at each travel.
    measured : Curves, optional
        From `stiction.read_curve`. The curves are drawn over the
        prediction, with their precursors.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        If the thickness of the blocks is unknown, mean stresses are drawn.

    Examples
    --------
    See `precursors`, which draws the events below this curve.
    """
    results = [*named(result).values()]
    measured = None if measured is None else check("measured", measured, Curves)
    paths = [curve_of(path) for path in results]
    _, _, name, event = paths[0]
    if any(path[2] != name for path in paths):
        raise InputError(
            "result: some paths contain forces and others stresses. Draw them in separate figures"
        )
    units = str(results[0][name].attrs["units"])
    if measured is not None and (measured.unit, measured[0].travel_unit) != (units, "m"):
        raise InputError(
            f"measured: curves are {measured.unit} over {measured[0].travel_unit}, the prediction"
            f" is {units} over m. Pass speed= to st.read_curve to turn time into travel"
        )
    length, length_unit = unit_for("m", np.concatenate([path[0] for path in paths]))
    factor, unit = unit_for(units, np.concatenate([path[1] for path in paths]))
    with on_axes(ax) as axes:
        if len(paths) > 1:
            _draw_band(axes, paths, length, factor)
        else:
            travel, force, _, _ = paths[0]
            axes.plot(travel * length, force * factor, **series(0), label="predicted")
            start, high = results[0]["event_travel"].values, results[0][event].values
            if start.size:
                places = start * length, high * factor
                axes.plot(*places, "o", color=ACCENT, markersize=3.5, label="arrested events")
        for number, test in enumerate(measured or ()):
            labels = [f"{len(measured or ())} tests", "measured precursors"]
            of_test, of_drops = labels if number == 0 else (None, None)
            thin = {"color": INK, "linewidth": 0.5, "alpha": 0.7, "label": of_test}
            axes.plot(test.travel * length, test.force * factor, **thin)
            places = test.drops.travel * length, test.drops.force * factor
            axes.plot(*places, "v", color=INK, markersize=3.0, label=of_drops)
        if axes.get_legend_handles_labels()[1][1:]:
            axes.legend()
        text = "force" if name == "force" else "mean stress"
        axes.set(xlabel=with_unit("travel", length_unit), ylabel=with_unit(text, unit))
    return axes


def _draw_band(axes: Axes, paths: Sequence[Any], length: float, factor: float) -> None:
    """Draw a band with 90 % of several curves, up to the travel at which half have slid."""
    known = [np.isfinite(travel) & np.isfinite(force) for travel, force, *_ in paths]
    ends = [travel[there].max() for (travel, *_), there in zip(paths, known, strict=True)]
    grid = np.linspace(0.0, float(np.median(ends)), 400)
    rows = np.stack([
        np.interp(grid, travel[there], force[there], right=np.nan)
        for (travel, force, *_), there in zip(paths, known, strict=True)
    ])  # fmt: skip
    low, middle, high = np.nanquantile(rows, [0.05, 0.5, 0.95], axis=0) * factor
    style = series(0)
    axes.fill_between(
        grid * length, low, high, color=style["color"], alpha=0.25, linewidth=0.0,
        label=f"90 % of {len(paths)} predicted",
    )  # fmt: skip
    axes.plot(grid * length, middle, **style, label="median of predicted")


def block(run: xr.Dataset, *, problem: Problem | None = None) -> NDArray[Any]:
    """Draw the velocity of both blocks at some times during an event.

    Parameters
    ----------
    run : Dataset
        From `stiction.simulate_rupture` with a specimen.
    problem : Problem, optional
        Needed only if the run does not hold it.

    Returns
    -------
    (rows, columns) array of matplotlib.axes.Axes
        Velocity along the interface, at times when 2 to 95 % of the
        slip has occurred. All panels share a colour scale, and 1 % of
        the values lie beyond its ends. Time counts from the first
        arrival of the front.
    """
    need(run, "block_velocity", hint=". It is kept for specimens")
    interface = problem_of(run, problem).interface
    scale, unit = unit_for("m", interface.lengths)
    velocity = run["block_velocity"].values
    largest = max(float(np.quantile(np.abs(velocity), 0.99)), 1e-12)
    since = run["snapshot"].values - float(run["onset_time"].fillna(0.0))
    factor, time_unit = unit_for("s", since)
    x, height = interface.x * scale, run["height"].values * scale
    both = np.concatenate([-height[:0:-1], height])
    columns = 4 if 2.0 * height[-1] > 0.6 * x[-1] else 2
    rows = -(-len(since) // columns)
    high = PAGE / columns * 2.0 * height[-1] / x[-1]
    figure = new_figure(PAGE * 1.1, rows * (high + 0.3) + 0.3)
    with paper_style():
        panels: NDArray[Any] = figure.subplots(
            rows, columns, sharex=True, sharey=True, squeeze=False
        )
        for axes, time, upper in zip(panels.flat, since, velocity, strict=False):
            field = np.concatenate([-upper[:0:-1], upper])
            mesh = axes.pcolormesh(
                x, both, field, cmap="RdBu_r", vmin=-largest, vmax=largest,
                shading="gouraud", rasterized=True,
            )  # fmt: skip
            axes.axhline(0.0, color="black", linewidth=0.6)
            axes.set_title(f"{factor * time:.3g} {time_unit}")
            axes.set_aspect("equal")
            axes.label_outer()
        figure.supxlabel(f"position $x$ ({unit}); times count from the onset")
        figure.supylabel(f"height ({unit})")
        figure.colorbar(mesh, ax=panels, extend="both", label="velocity along $x$ (m/s)")
    return panels


def curve_of(result: xr.Dataset) -> tuple[Array, Array, str, str]:
    """Return travel (m), force (N), the name of the force, and the name of the force at events.

    If the thickness is unknown, the force is the mean stress (Pa).
    """
    need(result, "travel", "event_start", hint=". Give the path of a specimen")
    name = "force" if "force" in result else "mean_stress"
    event = "event_force" if name == "force" else "event_stress"
    high, drop = result[event].values, result[f"{event}_drop"].values
    start, step = result["event_travel"].values, result["event_travel_step"].values
    load, before = result["load"].values, result["event_load"].values
    order = np.argsort(np.concatenate([load, before, before]), kind="stable")
    travel = np.concatenate([result["travel"].values, start, start + step])[order]
    force = np.concatenate([result[name].values, high, high - drop])[order]
    return travel, force, name, event


def precursors(
    result: xr.Dataset | Sequence[xr.Dataset],
    *,
    problem: Problem | None = None,
    measured: Curves | None = None,
) -> NDArray[Any]:
    """Draw the curve of a machine, and the places that slip in arrested events.

    Parameters
    ----------
    result : Dataset, or sequence of Dataset
        As in `force_travel`.
    problem : Problem, optional
        Needed only if the result does not hold it.
    measured : Curves, optional
        From `stiction.read_curve`. They are drawn over the prediction.
        Marks at the upper edge of the lower panel show the travel at
        which precursors of the tests begin.

    Returns
    -------
    (2,) array of matplotlib.axes.Axes
        The upper panel is the plot of `force_travel`. The lower panel
        shows the extent of each event at its travel.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
    ...     interface=st.Interface(length=0.1, nodes=128),
    ...     friction=st.LinearWeakening(weakening_rate=0.2e12, residual_ratio=0.5),
    ...     specimen=st.Blocks(height=0.05, drive=st.Pusher(height=0.008, width=0.005)),
    ... )
    >>> strength = 1e6 + 3e8 * (problem.interface.x - 0.02) ** 2
    >>> path = st.equilibrium_path(problem, strength, np.linspace(0.0, 1.3e6, 50))
    >>> st.plot.precursors(path)[1].get_ylabel()
    'position $x$ (mm)'
    """
    results = [*named(result).values()]
    interface = problem_of(results[0], problem).interface
    length, _ = unit_for("m", np.concatenate([curve_of(path)[0] for path in results]))
    scale, unit = unit_for("m", interface.lengths)
    figure = new_figure(1.35 * COLUMN, 1.35 * COLUMN)
    with paper_style():
        above, below = figure.subplots(2, sharex=True, height_ratios=(1.3, 1.0))
        force_travel(results, measured=measured, ax=above)
        for path in results:
            start = path["event_start"].values * scale
            end = start + path["event_length"].values * scale
            at = path["event_travel"].values * length
            below.vlines(at, start, end, color=ACCENT, linewidth=2.0 / len(results) ** 0.5)
        for test in measured or ():
            edge = np.full(test.drops.travel.size, interface.measure * scale)
            below.plot(
                test.drops.travel * length, edge, "|", color=INK, markersize=5.0, clip_on=False
            )
    below.set(xlabel=above.get_xlabel(), ylabel=f"position $x$ ({unit})")
    below.set_ylim(0.0, interface.measure * scale)
    above.set_xlabel("")
    return np.array([above, below])
