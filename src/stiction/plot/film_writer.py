"""Films: a figure of which some parts move, drawn picture by picture."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from stiction.errors import InputError


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


def check_film_name(path: Path) -> None:
    """Refuse endings that are no film, and .mp4 without the program for it."""
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(f"film: the name must end in .gif or .mp4, got {path.name!r}")
    if path.suffix == ".mp4" and not can_write_mp4():
        raise InputError(f"film: {path.name!r} needs the program ffmpeg; use a .gif instead")


def write_film(
    path: Path,
    figure: Figure,
    moving: list[Any],
    show: Any,
    frames: int,
    *,
    pictures: int,
    rate: int,
) -> Path:
    """Write a film and return its path.

    Parameters
    ----------
    path : Path
        Checked with `check_film_name`.
    figure : Figure
    moving : list of artists
        Those that `show` changes; the rest of a .gif is drawn once.
    show : callable
        Called with the number of a frame before its picture is drawn.
    frames : int
        How many there are; `pictures` of them are drawn, spread evenly: steps, and so frames, are
        short where things happen fast.
    rate : int
        Pictures a second.
    """
    FigureCanvasAgg(figure).draw()
    figure.set_layout_engine("none")  # the panels must not move between pictures
    shown = np.unique(np.linspace(0, frames - 1, min(pictures, frames)).round().astype(int))
    if path.suffix == ".gif":
        _write_gif(path, figure, moving, show, shown, rate)
    else:
        _write_mp4(path, figure, show, shown, rate)
    return path
