"""A film of a rupture: stress and strength above, slip rate below."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from stiction._checks import as_path, check_count
from stiction.errors import InputError
from stiction.plot.axes import MEGA, MICRO, MILLI
from stiction.plot.ruptures import Floats, need, shown_strength
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, new_figure, paper_style


def _pictures(times: Floats, count: int) -> NDArray[np.intp]:
    """Frames spread evenly over what was kept: steps are short where things happen fast."""
    return np.unique(np.linspace(0, times.size - 1, min(count, times.size)).round().astype(int))


def _write_gif(
    path: Path, figure: Figure, moving: list[Any], show: Any, shown: Any, rate: int
) -> None:
    """Draw the pictures one by one; only the moving parts are drawn again."""
    canvas = FigureCanvasAgg(figure)
    for part in moving:
        part.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)

    def pictures() -> Iterator[Image.Image]:
        for i in shown:
            show(i)
            canvas.restore_region(background)
            for part in moving:
                figure.draw_artist(part)
            yield Image.fromarray(np.asarray(canvas.buffer_rgba()).copy()).convert("RGB")

    # One palette for all pictures keeps the still parts still.
    images = [picture.quantize(64, dither=Image.Dither.NONE) for picture in pictures()]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=round(1000 / rate), loop=0
    )


def _write_mp4(path: Path, figure: Figure, show: Any, shown: Any, rate: int) -> None:
    writer = FFMpegWriter(fps=rate)
    with writer.saving(figure, str(path), figure.dpi):
        for i in shown:
            show(i)
            writer.grab_frame()


def can_write_mp4() -> bool:
    """Whether the program ffmpeg is there (or where matplotlib's `animation.ffmpeg_path` says)."""
    return bool(FFMpegWriter.isAvailable())


def _check_name(path: Path) -> None:
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(f"film: the name must end in .gif or .mp4, got {path.name!r}")
    if path.suffix == ".mp4" and not can_write_mp4():
        raise InputError(f"film: {path.name!r} needs the program ffmpeg; use a .gif instead")


def film(
    run: xr.Dataset,
    path: str | Path,
    *,
    pictures: int = 160,
    rate: int = 20,
) -> Path:
    """Write a film of a rupture: stress and strength above, slip rate below.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture` or `open_rupture`, with `slip_rate` and `shear_stress`.
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
        If a variable was not kept, the run is of a plane, or the file type is not known.
    """
    need(run, "slip_rate", "shear_stress", "peak_strength")
    check_count("pictures", pictures, 1)
    check_count("rate", rate, 1)
    target = as_path("path", path)
    _check_name(target)
    x = run["x"].values * MILLI
    times, onset = run["time"].values, float(run["onset_time"])
    stress = run["shear_stress"].values * MEGA
    slip_rate = np.maximum(run["slip_rate"].values, 1e-9)
    strength = shown_strength(run)
    mean = run["mean_stress"].values * MEGA
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
        below.set_xlim(0.0, x[-1] + x[1] - x[0])
        below.set_xlabel("$x$ (mm)")
        below.set_ylabel("slip rate (m/s)")
        clock = above.text(0.0, 1.04, " ", transform=above.transAxes, color=QUIET)

        def show(i: int) -> None:
            line.set_ydata(stress[i])
            moving.set_ydata(slip_rate[i])
            clock.set_text(
                f"$t - T$ = {(times[i] - onset) * MICRO:,.1f} µs,  "
                rf"$\langle\tau\rangle$ = {mean[i]:.3f} MPa"
            )

        figure.canvas.draw()
        figure.set_layout_engine("none")  # the panels must not move between pictures
        shown = _pictures(times, pictures)
        if target.suffix == ".gif":
            _write_gif(target, figure, [line, moving, clock], show, shown, rate)
        else:
            _write_mp4(target, figure, show, shown, rate)
    return target
