"""The command that simulates one rupture in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from stiction.cli.common import StudyFile, echo, writable_folder
from stiction.cli.profile import (
    FillGaps,
    Interpolate,
    Unit,
    ValueName,
    XName,
    XUnit,
    profile_of,
)
from stiction.progress import Meter

if TYPE_CHECKING:
    import xarray as xr

    from stiction.problem import Problem


def rupture(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="Folder for the result and its figures.")] = Path(
        "stiction-rupture"
    ),
    sample: Annotated[
        int, typer.Option(min=0, help="Number of the sample of the study's strength.")
    ] = 0,
    strength: Annotated[
        Path | None,
        typer.Option(
            metavar="PROFILE",
            help="Peak strength instead of a sample, as of `stiction onset`; the study then needs"
            " a problem only.",
            show_default=False,
        ),
    ] = None,
    loading_rate: Annotated[
        float, typer.Option(help="Pa/s, unless the study's method is a rupture.")
    ] = 2e7,
    film: Annotated[
        bool, typer.Option("--film", help="Also a film: rupture.gif, and .mp4 if there is ffmpeg.")
    ] = False,
    every: Annotated[
        int | None,
        typer.Option(
            help="Explicit steps between frames kept; if left out 5, on a plane 20 without a film.",
            show_default=False,
        ),
    ] = None,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    interpolate: Interpolate = False,
    fill_gaps: FillGaps = False,
) -> None:
    """Simulate one interface from its first slip to global sliding, or as far as the study says.

    Takes a sample of the study's strength (of a sweep, its first point) or a profile of your own.
    Writes `rupture.nc` (slip, slip rate and stress over time and x), `rupture.png` and `.pdf`
    (slip rate in space and time, load, strength), `front.png` and `.pdf` (where the rupture front
    is and how fast), and with --film an animation. Speeds of the front are apparent: the distance
    between nodes over the time between their weakening.
    """
    from stiction import plot
    from stiction.dynamics.method import Rupture
    from stiction.dynamics.simulate import simulate_rupture
    from stiction.export import write_result
    from stiction.plot.style import save_figure
    from stiction.study.setup import read_setup
    from stiction.study.study import Study

    writable_folder(out)
    profiles: Any
    if strength is None:
        plan = Study.from_toml(study).plans[0]
        problem, method = plan.problem, plan.method
        profiles = plan.profiles(sample, 1)
    else:
        problem, method = read_setup(study)
        profiles = profile_of(
            strength,
            problem,
            unit=unit,
            x_unit=x_unit,
            value=value,
            x=x,
            interpolate=interpolate,
            fill_gaps=fill_gaps,
        )
    if not isinstance(method, Rupture):
        method = Rupture(loading_rate=loading_rate)
    plane = problem.interface.is_plane  # where frames are large, and creep is of less interest
    result = simulate_rupture(
        problem,
        profiles,
        method=method,
        every=every or (20 if plane and not film else 5),
        every_implicit=10 if plane else 1,
    )
    write_result(result, out / "rupture.nc")
    echo(_summary(result, problem))
    with Meter("drawing the figures"):
        for name, draw in (("rupture", plot.rupture), ("front", plot.front)):
            axes = draw(result, problem=problem)
            for ending in ("png", "pdf"):
                save_figure(axes.figure, out / f"{name}.{ending}")
    if film:
        with Meter("drawing the film"):
            echo(f"film: {plot.film(result, out / 'rupture.gif')}")
    echo(f"written to {out}")


def _megapascals(stress: Any) -> str:
    # Rounded first, and without the sign of a zero.
    return f"{round(float(stress) * 1e-6, 6) + 0.0:.6f} MPa"


def _summary(result: xr.Dataset, problem: Problem) -> str:
    """What the run amounts to, in lines; what is not known at its end is left out."""
    solid = problem.solid
    loads = f"critical stress {_megapascals(result.critical_stress)}"
    if np.isfinite(result.kinetic_stress):
        loads += (
            f", kinetic stress {_megapascals(result.kinetic_stress)},"
            f" stress drop {_megapascals(result.stress_drop)}"
        )
    lines = [
        loads,
        f"onset at {_place(result, problem)} after {float(result.onset_time):.5g} s",
    ]
    median, fastest = (
        np.atleast_1d(result[name].values) for name in ("median_rupture_speed", "rupture_speed")
    )
    if np.isfinite(median).any():
        lines.append(
            f"front speed {_along_axes(median)} m/s (median;"
            f" c_R {solid.rayleigh_wave_speed:.0f}, c_s {solid.shear_wave_speed:.0f},"
            f" c_d {solid.dilatational_wave_speed:.0f})"
        )
    if np.isfinite(fastest).any():
        text = f"largest apparent speed over 2 h_n {_along_axes(fastest)} m/s"
        if np.nanmax(fastest) > solid.dilatational_wave_speed:
            text += ": above c_d, because patches ahead of the front slip before it comes"
        lines.append(text)
    energy, unit = float(result.radiated_energy[-1]), result.radiated_energy.attrs["units"]
    lines.append(f"radiated energy {energy:.4g} {unit}; ended by: {result.attrs['stopped']}")
    return "\n".join(lines)


def _place(result: xr.Dataset, problem: Problem) -> str:
    values = np.atleast_1d(result.critical_position.values) * 1e3
    pairs = zip(problem.interface.dims, values, strict=True)
    return ", ".join(f"{dim} = {value:.3f} mm" for dim, value in pairs)


def _along_axes(speeds: Any) -> str:
    """Of a line one number, of a plane one along each axis."""
    if speeds.size == 1:
        return f"{speeds[0]:.0f}"
    return ", ".join(
        f"{value:.0f} along {dim}"
        for dim, value in zip("xy", speeds, strict=True)
        if np.isfinite(value)
    )
