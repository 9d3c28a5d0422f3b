"""Films of ruptures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from stiction._checks import as_path, check_count
from stiction.plot.axes import MEGA, MICRO, MILLI
from stiction.plot.film_writer import check_film_name, write_film
from stiction.plot.plane_films import plane_film
from stiction.plot.ruptures import need, shown_strength
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, new_figure, paper_style


def film(
    run: xr.Dataset,
    path: str | Path,
    *,
    pictures: int = 160,
    rate: int = 20,
) -> Path:
    """Write a film of a rupture: stress and strength above, slip rate below.

    Of a plane it shows slip rate and shear stress side by side.

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
        If a variable was not kept, or the file type is not known.
    """
    need(run, "slip_rate", "shear_stress", "peak_strength", plane=True)
    check_count("pictures", pictures, 1)
    check_count("rate", rate, 1)
    target = as_path("path", path)
    check_film_name(target)
    if "y" in run.dims:
        return plane_film(run, target, pictures=pictures, rate=rate)
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

        moving_parts = [line, moving, clock]
        return write_film(
            target, figure, moving_parts, show, times.size, pictures=pictures, rate=rate
        )
