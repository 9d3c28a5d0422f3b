"""The command that simulates one rupture in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from stiction._progress import Meter
from stiction.cli.common import StudyFile, writable_folder
from stiction.cli.profile import (
    FillGaps,
    Interpolate,
    Unit,
    ValueName,
    XName,
    XUnit,
    profile_of,
)


def rupture(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="Folder for the result and its figures.")] = Path(
        "stiction-rupture"
    ),
    sample: Annotated[int, typer.Option(help="Number of the sample of the study's strength.")] = 0,
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
    film: Annotated[bool, typer.Option("--film", help="Also a film, rupture.gif.")] = False,
    every: Annotated[int, typer.Option(help="Explicit steps between frames kept.")] = 5,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    interpolate: Interpolate = False,
    fill_gaps: FillGaps = False,
) -> None:
    """Simulate one interface from its first slip to global sliding.

    Takes a sample of the study's strength (of a sweep, its first point) or a profile of your own.
    Writes `rupture.nc` (slip, slip rate and stress over time and x), `rupture.png` and `.pdf`
    (slip rate in space and time, load, strength), `front.png` and `.pdf` (where the rupture front
    is and how fast), and with --film an animation.
    """
    from stiction.dynamics.method import Rupture
    from stiction.dynamics.simulate import simulate_rupture
    from stiction.report.rupture_figures import front_figure, rupture_figure, rupture_film
    from stiction.study.study import Study, read_setup

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
    result = simulate_rupture(problem, profiles, method=method, every=every)
    result.to_netcdf(out / "rupture.nc")
    typer.echo(
        f"critical stress {float(result.critical_stress) * 1e-6:.6f} MPa,"
        f" kinetic stress {round(float(result.kinetic_stress) * 1e-6, 6) + 0.0:.6f} MPa\n"
        f"onset at x = {float(result.critical_position) * 1e3:.3f} mm after"
        f" {float(result.onset_time):.5g} s; fastest front {float(result.rupture_speed):.0f} m/s"
        f" (c_R {problem.solid.rayleigh_wave_speed:.0f}, c_s {problem.solid.shear_wave_speed:.0f},"
        f" c_d {problem.solid.dilatational_wave_speed:.0f}); ended by: {result.attrs['stopped']}"
    )
    with Meter("drawing the figures"):
        for name, draw in (("rupture", rupture_figure), ("front", front_figure)):
            figure = draw(result, problem)
            for ending in ("png", "pdf"):
                figure.savefig(out / f"{name}.{ending}")
    if film:
        with Meter("drawing the film"):
            path = rupture_film(result, problem, out / "rupture.gif")
        typer.echo(f"film: {path}")
    typer.echo(f"written to {out}")
