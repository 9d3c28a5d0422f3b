"""Films of ruptures."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from stiction.errors import InputError
from stiction.model import FilePath, at_least, check
from stiction.plot import maps
from stiction.plot.axes import need, problem_of, unit_for
from stiction.plot.ruptures import (
    COLORS,
    DECADES,
    KEEP,
    finite_strength,
    masked,
    rate_scale,
    since_onset,
)
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, new_figure, paper_style
from stiction.progress import Meter, Show

Frames = tuple[Figure, list[Any], Callable[[int], None]]
"""A figure, the artists that move in it, and a function that shows a frame."""


def film(
    run: xr.Dataset,
    path: str | Path,
    *,
    frames: int = 160,
    fps: int = 20,
    progress: Show = True,
) -> Path:
    """Write a film of a rupture: stress and slip rate.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture`, with `slip_rate` and `shear_stress`.
    path : path
        Ends in .gif.
    frames : int
        Maximum number of frames, evenly spaced over those of the run, which lie closer in time
        as the interface accelerates.
    fps : int
        Frames per second.
    progress : bool or callable
        As in `stiction.monte_carlo`.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If a variable was not kept, or the path does not end in .gif.
    """
    need(run, "slip_rate", "shear_stress", "peak_strength", hint=KEEP)
    check("frames", frames, at_least(1))
    check("fps", fps, at_least(1))
    target = check("path", path, FilePath)
    if target.suffix != ".gif":
        raise InputError(f"path: must end in .gif, got {target.name!r}")
    shown = np.unique(np.linspace(0, run.sizes["time"] - 1, frames).round().astype(int))
    images, still = [], Image.Dither.NONE  # with dithering, parts at rest would flicker
    with paper_style(), Meter("film", shown.size, progress, unit="frames") as meter:
        figure, moving, show = (_plane_film if "y" in run.dims else _line_film)(run)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        figure.set_layout_engine("none")  # the panels must not move between frames
        for part in moving:  # only these are drawn for each frame: 40 times as fast
            part.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
        for i in shown:
            show(i)
            canvas.restore_region(background)
            for part in moving:
                figure.draw_artist(part)
            frame = Image.fromarray(np.asarray(canvas.buffer_rgba()).copy()).convert("RGB")
            images.append(frame.quantize(128, Image.Quantize.FASTOCTREE, dither=still))
            meter.advance()
        images[0].save(
            target, save_all=True, append_images=images[1:], duration=round(1000 / fps), loop=0
        )
    return target


def _clock(axes: Axes, run: xr.Dataset) -> tuple[Any, Callable[[int], None]]:
    """Return a line of text above axes with time and mean stress, and how to set it."""
    since, _ = since_onset(run)
    late = since[since > 0.0]
    factor, unit = unit_for("s", late if late.size else since)
    stress, stress_unit = unit_for("Pa", run["mean_stress"].values)
    mean = (run["mean_stress"].values * stress).round(3) + 0.0  # no minus before a zero
    text = axes.text(0.0, 1.04, " ", transform=axes.transAxes, color=QUIET)

    def show(i: int) -> None:
        text.set_text(
            f"{factor * since[i]:,.1f} {unit} since the onset,"
            f"  mean stress {mean[i]:.3f} {stress_unit}"
        )

    return text, show


def _line_film(run: xr.Dataset) -> Frames:
    length, unit = unit_for("m", run["x"].values)
    x = run["x"].values * length
    factor, stress_unit = unit_for("Pa", finite_strength(run))
    stress, strength = run["shear_stress"].values * factor, finite_strength(run) * factor
    top = max(float(run["slip_rate"].max()), 1e-12)
    rate = np.maximum(run["slip_rate"].values, 1e-10 * top)
    figure = new_figure(PAGE * 0.9, 3.8)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(x, strength, color=PALE, linewidth=1.0, label=r"$\tau_p$")
    (line,) = above.plot(x, stress[0], color=INK, label=r"$\tau$")
    above.set_ylabel(f"stress ({stress_unit})")
    highest = np.nanmax(strength)
    margin = 0.06 * (highest - min(np.nanmin(strength), stress.min()))
    above.set_ylim(min(0.0, stress.min()) - margin, max(highest, stress.max()) + margin)
    above.legend(loc="upper right", ncols=2)
    (moving,) = below.semilogy(x, rate[0], color=ACCENT)
    below.set_ylim(10.0**-DECADES * top, 3.0 * top)
    below.set_xlim(0.0, x[-1] + x[1] - x[0])
    below.set_xlabel(f"position $x$ ({unit})")
    below.set_ylabel("slip rate (m/s)")
    clock, tick = _clock(above, run)

    def show(i: int) -> None:
        line.set_ydata(stress[i])
        moving.set_ydata(rate[i])
        tick(i)

    return figure, [line, moving, clock], show


def _plane_film(run: xr.Dataset) -> Frames:
    interface = problem_of(run).interface
    rate = run["slip_rate"].values
    factor, unit = unit_for("Pa", run["shear_stress"].values)
    stress = run["shear_stress"].values * factor
    norm = rate_scale(rate, 4.0)
    low, high = np.quantile(stress, [0.001, 0.999])
    figure = new_figure(PAGE * 1.15, 3.4)
    left, right = figure.subplots(1, 2, sharey=True)
    slow = masked(rate[0], norm)
    slip = maps.image(left, interface, slow, "slip rate (m/s)", norm=norm, cmap=COLORS)
    text, ends = f"shear stress ({unit})", {"vmin": low, "vmax": high}
    load = maps.image(right, interface, stress[0], text, cmap="cividis", **ends)
    right.label_outer()
    clock, tick = _clock(left, run)

    def show(i: int) -> None:
        slip.set_data(masked(rate[i], norm).T)
        load.set_data(stress[i].T)
        tick(i)

    return figure, [slip, load, clock], show
