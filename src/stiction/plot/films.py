"""Films of ruptures."""

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
    finite_strength,
    masked,
    rate_scale,
    since_onset,
)
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, new_figure, paper_style
from stiction.progress import Meter, Show

KEEP = "; keep them with simulate_rupture(save=st.Save(['slip_rate', 'shear_stress']))"
Moving = list[tuple[Any, str, Any]]
"""What moves in a figure: an artist, the name of its data, and these for each frame of the run."""


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
        figure, moving = (_plane_film if "y" in run.dims else _line_film)(run)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        figure.set_layout_engine("none")  # the panels must not move between frames
        for artist, _, _ in moving:  # only these are drawn for each frame: 40 times as fast
            artist.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
        for i in shown:
            canvas.restore_region(background)
            for artist, name, values in moving:
                artist.set(**{name: values[i]})
                figure.draw_artist(artist)
            frame = Image.fromarray(np.asarray(canvas.buffer_rgba()).copy()).convert("RGB")
            images.append(frame.quantize(128, Image.Quantize.FASTOCTREE, dither=still))
            meter.advance()
        images[0].save(
            target, save_all=True, append_images=images[1:], duration=round(1000 / fps), loop=0
        )
    return target


def _clock(axes: Axes, run: xr.Dataset) -> tuple[Any, str, list[str]]:
    """Return a line of text above axes, with time and mean stress."""
    since, _ = since_onset(run)
    late = since[since > 0.0]
    factor, unit = unit_for("s", late if late.size else since)
    stress, stress_unit = unit_for("Pa", run["mean_stress"].values)
    mean = (run["mean_stress"].values * stress).round(3) + 0.0  # no minus before a zero
    texts = [
        f"{time:,.1f} {unit} since the onset,  mean stress {one:.3f} {stress_unit}"
        for time, one in zip(factor * since, mean, strict=True)
    ]
    return axes.text(0.0, 1.04, " ", transform=axes.transAxes, color=QUIET), "text", texts


def _line_film(run: xr.Dataset) -> tuple[Figure, Moving]:
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
    (slip,) = below.semilogy(x, rate[0], color=ACCENT)
    below.set_ylim(10.0**-DECADES * top, 3.0 * top)
    below.set_xlim(0.0, x[-1] + x[1] - x[0])
    below.set_xlabel(f"position $x$ ({unit})")
    below.set_ylabel("slip rate (m/s)")
    return figure, [(line, "ydata", stress), (slip, "ydata", rate), _clock(above, run)]


def _plane_film(run: xr.Dataset) -> tuple[Figure, Moving]:
    interface = problem_of(run).interface
    rate, factor, unit = run["slip_rate"].values, *unit_for("Pa", run["shear_stress"].values)
    stress = run["shear_stress"].values * factor
    norm = rate_scale(rate, 4.0)
    rate = masked(rate, norm)
    low, high = np.quantile(stress, [0.001, 0.999])
    figure = new_figure(PAGE * 1.15, 3.4)
    left, right = figure.subplots(1, 2, sharey=True)
    slip = maps.image(left, interface, rate[0], "slip rate (m/s)", norm=norm, cmap=COLORS)
    text, ends = f"shear stress ({unit})", {"vmin": low, "vmax": high}
    load = maps.image(right, interface, stress[0], text, cmap="cividis", **ends)
    right.label_outer()
    moving = [(slip, "data", rate.swapaxes(1, 2)), (load, "data", stress.swapaxes(1, 2))]
    return figure, [*moving, _clock(left, run)]
