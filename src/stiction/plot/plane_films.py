"""A film of a rupture on a plane: slip rate and shear stress side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm

from stiction._typing import Array
from stiction.plot.axes import MEGA
from stiction.plot.film_writer import write_film
from stiction.plot.style import PAGE, QUIET, new_figure, paper_style

RATES = "inferno_r"
DECADES = 4.0
"""Of slip rate below the largest that are shown."""


def unit_of(values: Array, units: tuple[str, ...]) -> tuple[float, str]:
    """Factor and name of the unit, thousands apart, in which the largest value is below 1000."""
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    factor, number = 1.0, 0
    while largest * factor < 1.0 and number + 1 < len(units) and largest > 0.0:
        factor, number = factor * 1e3, number + 1
    return factor, units[number]


def lengths_of(run: xr.Dataset) -> tuple[float, float]:
    """Lengths of the plane along x and y, m."""
    return tuple(  # type: ignore[return-value]  # two by construction
        float(run[axis][-1] - 2.0 * run[axis][0] + run[axis][1]) for axis in ("x", "y")
    )


def length_unit(run: xr.Dataset) -> tuple[float, str]:
    """Factor and name of the unit of the axes."""
    if max(lengths_of(run)) >= 1e3:
        return 1e-3, "km"
    return unit_of(np.array(lengths_of(run)), ("m", "mm", "µm"))


def edges(run: xr.Dataset, factor: float) -> tuple[float, float, float, float]:
    """Edges of the cells around the nodes, in the unit of the axes."""
    (dx, dy), (lx, ly) = (
        (float(run[axis][1] - run[axis][0]) for axis in ("x", "y")),
        lengths_of(run),
    )
    return tuple(  # type: ignore[return-value]  # four by construction
        factor * edge for edge in (-0.5 * dx, lx - 0.5 * dx, -0.5 * dy, ly - 0.5 * dy)
    )


def rate_scale(rate: Array) -> LogNorm:
    """Colors of slip rates: some decades below the largest."""
    top = max(float(rate.max()), 1e-12)
    return LogNorm(top * 10.0**-DECADES, top)


def fast(rate: Array, norm: LogNorm) -> Any:
    """Slip rates as they are drawn: what sticks, or nearly so, stays white."""
    return np.ma.masked_less(rate, norm.vmin or 0.0).T


def plane_film(run: xr.Dataset, path: Path, *, pictures: int, rate: int) -> Path:
    """A film of slip rate and shear stress side by side."""
    factor, unit = length_unit(run)
    times, onset = run["time"].values, float(run["onset_time"])
    speeds, stress = run["slip_rate"].values, run["shear_stress"].values * MEGA
    norm = rate_scale(speeds)
    scale, name = unit_of(times[times > onset] - onset, ("s", "ms", "µs"))
    mean = run["mean_stress"].values * MEGA
    low, high = np.quantile(stress, [0.001, 0.999])
    with paper_style():
        figure = new_figure(PAGE * 1.15, 3.4)
        panels = figure.subplots(1, 2, sharey=True)
        box = edges(run, factor)
        left = panels[0].imshow(
            fast(speeds[0], norm), origin="lower", norm=norm, cmap=RATES, extent=box
        )
        right = panels[1].imshow(
            stress[0].T, origin="lower", vmin=low, vmax=high, cmap="cividis", extent=box
        )
        for axes, image, label in (
            (panels[0], left, "slip rate (m/s)"),
            (panels[1], right, "shear stress (MPa)"),
        ):
            figure.colorbar(image, ax=axes, label=label, location="bottom", shrink=0.9)
            axes.set_xlabel(f"$x$ ({unit})")
        panels[0].set_ylabel(f"$y$ ({unit})")
        clock = panels[0].text(0.0, 1.04, " ", transform=panels[0].transAxes, color=QUIET)

        def show(i: int) -> None:
            left.set_data(fast(speeds[i], norm))
            right.set_data(stress[i].T)
            clock.set_text(
                f"$t - T$ = {scale * (times[i] - onset):,.1f} {name},  "
                rf"$\langle\tau\rangle$ = {mean[i]:.3f} MPa"
            )

        moving: list[Any] = [left, right, clock]
        return write_film(path, figure, moving, show, times.size, pictures=pictures, rate=rate)
