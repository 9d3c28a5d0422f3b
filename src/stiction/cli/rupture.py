"""The command that simulates one rupture in space and time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from stiction._progress import status_line
from stiction.cli.common import StudyFile, echo, writable_folder


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
            help="Peak strength, Pa, instead of a sample: .npy, .csv or NetCDF.",
            show_default=False,
        ),
    ] = None,
    loading_rate: Annotated[
        float, typer.Option(help="Pa/s, unless the study's method is a rupture.")
    ] = 2e7,
    film: Annotated[bool, typer.Option("--film", help="Also a film, rupture.gif.")] = False,
    every: Annotated[int, typer.Option(help="Explicit steps between frames kept.")] = 5,
) -> None:
    """Simulate one interface from its first slip to global sliding.

    Takes a sample of the study's strength (of a sweep, its first point) or a profile of your own.
    Writes `rupture.nc` (slip, slip rate and stress over time and x), `rupture.png` and `.pdf`
    (slip rate in space and time, load, strength), `front.png` and `.pdf` (where the rupture front
    is and how fast), and with --film an animation.
    """
    from stiction.dynamics.method import Rupture
    from stiction.dynamics.simulate import simulate_rupture
    from stiction.profile_file import read_profile
    from stiction.report.rupture_figures import front_figure, rupture_figure, rupture_film
    from stiction.report.style import save_figure
    from stiction.runs import write_result
    from stiction.study import Study

    writable_folder(out)
    loaded = Study.from_toml(study)
    plan = loaded.plans[0]
    problem, method = plan.problem, plan.method
    if not isinstance(method, Rupture):
        method = Rupture(loading_rate=loading_rate)
    extras: dict[str, Any] = {}
    if strength is None:
        profiles = plan.profiles(sample, 1)
        tau_p = profiles.pop("strength")
        extras = profiles
    else:
        tau_p = read_profile(strength, problem.interface)
    with status_line("rupture") as say:
        result = simulate_rupture(
            problem,
            tau_p,
            method=method,
            every=every,
            progress=lambda now: say(
                f"step {now.steps}, t = {now.time:.6g} s, mean stress"
                f" {now.mean_stress * 1e-6:.4f} MPa, {now.weakened_fraction:.0%} weakened"
            ),
            **extras,
        )
    write_result(result, out / "rupture.nc")
    echo(
        f"critical stress {float(result.critical_stress) * 1e-6:.6f} MPa,"
        f" kinetic stress {round(float(result.kinetic_stress) * 1e-6, 6) + 0.0:.6f} MPa\n"
        f"onset at x = {float(result.critical_position) * 1e3:.3f} mm after"
        f" {float(result.onset_time):.5g} s; fastest front {float(result.rupture_speed):.0f} m/s"
        f" (c_R {problem.solid.rayleigh_wave_speed:.0f}, c_s {problem.solid.shear_wave_speed:.0f},"
        f" c_d {problem.solid.dilatational_wave_speed:.0f}); ended by: {result.attrs['stopped']}"
    )
    for name, draw in (("rupture", rupture_figure), ("front", front_figure)):
        figure = draw(result, problem)
        for ending in ("png", "pdf"):
            save_figure(figure, out / f"{name}.{ending}")
    if film:
        echo(f"film: {rupture_film(result, problem, out / 'rupture.gif')}")
    echo(f"written to {out}")
