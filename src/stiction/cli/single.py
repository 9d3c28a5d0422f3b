"""Commands on one interface: onset, rupture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from stiction.cli.common import StudyFile, echo, writable_folder
from stiction.errors import InputError, unknown_name
from stiction.progress import Meter

Unit = Annotated[
    str | None, typer.Option(help="Of the values in PROFILE, such as MPa.", show_default=False)
]
XUnit = Annotated[str | None, typer.Option(help="Of x in PROFILE, such as mm.", show_default=False)]
ValueName = Annotated[
    str | None,
    typer.Option(
        help="Column or variable of the values: name, or number from 0.", show_default=False
    ),
]
XName = Annotated[
    str | None,
    typer.Option(help="Column or coordinate of x: name, or number from 0.", show_default=False),
]
Interpolate = Annotated[
    bool, typer.Option("--interpolate", help="Take points that lie elsewhere than the nodes.")
]
Gaps = Annotated[
    Literal["refuse", "fill"],
    typer.Option(help="Refuse missing values, or fill them with straight lines."),
]
LoadingRate = Annotated[
    float, typer.Option(help="Of the dynamic method, Pa/s, unless the study gives one.")
]
COLUMNS = ("critical_stress", "friction_coefficient", "critical_load", "first_instability")


def _profile(path: Path, problem: Any, **options: Any) -> Any:
    """The strength in a file, on the nodes of a problem; columns by name or number."""
    from stiction.profiles import read_profile

    for name in ("x", "value"):
        text = options[name]
        options[name] = int(text) if text is not None and text.isdecimal() else text
    return read_profile(path, interface=problem.interface, **options)


def onset(
    study: StudyFile,
    strength: Annotated[
        Path,
        typer.Option(
            metavar="PROFILE",
            help="Peak strength: .npy, text (.csv, .txt, ...) or NetCDF, with or without x; in Pa"
            " and m unless it states units, as in 'x (mm); strength (MPa)'. Of a plane: .npy of"
            " shape (nx, ny).",
        ),
    ],
    method: Annotated[
        list[str] | None,
        typer.Option(help="Only this method; may be given several times.", show_default=False),
    ] = None,
    loading_rate: LoadingRate = 2e7,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    interpolate: Interpolate = False,
    gaps: Gaps = "refuse",
) -> None:
    """At which load, and where, does one interface of given strength begin to slide?

    Takes the problem from a study file, which needs nothing else, and the strength from PROFILE,
    asks every method that applies, and prints a table. The method of the study, if it has one,
    keeps its options; the others take their defaults.
    """
    from stiction.methods import onset as find
    from stiction.study.study import read_setup

    problem, own, _ = read_setup(study)
    methods = _methods(own, method, loading_rate)
    names = {"unit": unit, "x_unit": x_unit, "value": value, "x": x}
    profile = _profile(strength, problem, interpolate=interpolate, gaps=gaps, **names)
    # Each method refuses, and warns, for itself.
    problem.sample(profile, accept=("barriers", "overstress", "constant"))
    rows: list[list[str]] = []
    refused: list[str] = []
    for one in methods:
        try:
            with Meter(f"onset by {one.type}"):
                rows.append(_row(one.type, find(problem, profile, method=one)))
        except InputError as error:
            refused.append(f"{one.type} does not apply: {error}")
    head = ["method", *(name.replace("_", " ") for name in COLUMNS), "position"]
    table = [head, *rows] if rows else []
    widths = [max(len(line[i]) for line in table) if table else 0 for i in range(len(head))]
    for line in table:
        cells = zip(line, widths, strict=True)
        echo("  ".join(cell.ljust(width) for cell, width in cells if width).rstrip())
    for text in refused:
        echo(text)
    if not rows:
        raise typer.Exit(1)


def _methods(own: Any, names: list[str] | None, loading_rate: float) -> list[Any]:
    """The methods to ask: the study's own as it is, the others with their defaults."""
    from stiction.methods import methods

    classes = methods()
    unknown = [name for name in names or () if name not in classes]
    if unknown:
        raise InputError([unknown_name("--method", name, classes) for name in unknown])
    found = []
    for name, cls in classes.items():
        if names and name not in names:
            continue
        if own is not None and name == own.type:
            found.append(own)
        elif name == "rupture":
            found.append(cls(loading_rate=loading_rate))
        else:
            try:
                found.append(cls())
            except (InputError, TypeError):  # options without defaults: only a study has them
                if names:
                    raise
    return found


def _row(name: str, result: Any) -> list[str]:
    """The answer of one method; what it does not return is left empty."""
    row = [name]
    for column in COLUMNS:
        if column not in result:
            row.append("")
        elif column == "friction_coefficient":
            row.append(f"{float(result[column][0]):.6f}")
        else:
            row.append(f"{float(result[column][0]) * 1e-6:.6f} MPa")
    place = np.atleast_1d(result["critical_position"][0].values) * 1e3
    labels = [""] if place.size == 1 else ["x = ", "y = "]
    place_text = ", ".join(f"{label}{at:.4f} mm" for label, at in zip(labels, place, strict=True))
    return [*row, place_text]


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
    loading_rate: LoadingRate = 2e7,
    film: Annotated[
        bool, typer.Option("--film", help="Also a film: rupture.gif, and .mp4 if there is ffmpeg.")
    ] = False,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    interpolate: Interpolate = False,
    gaps: Gaps = "refuse",
) -> None:
    """Simulate one interface from its first slip to global sliding, or as far as the study says.

    Takes a sample of the study's strength (of a sweep, its first point) or a profile of your own.
    Writes `rupture.nc` (slip, slip rate and stress over time and x), and as PNG and PDF `rupture`
    (slip rate in space and time, load, strength) and `front` (where the rupture front is and how
    fast), and with --film an animation.
    """
    from stiction import plot
    from stiction.dynamics.method import Rupture
    from stiction.dynamics.simulate import simulate_rupture
    from stiction.plot.style import save_figure
    from stiction.study.export import write_result
    from stiction.study.study import Study, read_setup

    writable_folder(out)
    profiles: Any
    if strength is None:
        loaded = Study.from_toml(study)
        point, save = loaded.experiments[0], loaded.save
        problem, method = point.problem, point.method
        profiles = point.profiles(point.draws(point.seed, sample, 1))
    else:
        problem, method, save = read_setup(study)
        names = {"unit": unit, "x_unit": x_unit, "value": value, "x": x}
        profiles = _profile(strength, problem, interpolate=interpolate, gaps=gaps, **names)
    if not isinstance(method, Rupture):
        method = Rupture(loading_rate=loading_rate)
    result = simulate_rupture(problem, profiles, method=method, save=save)
    write_result(result, out / "rupture.nc")
    echo(_summary(result, problem))
    with Meter("drawing the figures"):
        for name, draw in (("rupture", plot.rupture), ("front", plot.front)):
            figure = draw(result, problem=problem).figure
            for ending in ("png", "pdf"):
                save_figure(figure, out / f"{name}.{ending}")
    if film:
        with Meter("drawing the film"):
            echo(f"film: {plot.film(result, out / 'rupture.gif')}")
    echo(f"written to {out}")


def _summary(result: Any, problem: Any) -> str:
    """Return the rupture in a few lines, without what is not known at its end."""
    from stiction.plot.axes import unit_for

    def value(name: str, scale: float = 1.0) -> str:
        numbers = np.atleast_1d(result[name].values) * scale
        return " and ".join(f"{number:.5g}" for number in numbers)

    lines = [f"critical stress {value('critical_stress', 1e-6)} MPa"]
    if np.isfinite(result.kinetic_stress):
        lines[0] += f", stress drop {value('stress_drop', 1e-6)} MPa"
    if np.isfinite(result.onset_time):
        factor, unit = unit_for("m", problem.interface.lengths)
        place = value("critical_position", factor)
        lines.append(f"onset at {place} {unit} after {value('onset_time')} s")
    if np.isfinite(result.median_rupture_speed).any():
        lines.append(
            f"apparent front speed, median over h_n/2: {value('median_rupture_speed')} m/s (c_R"
            f" {problem.solid.rayleigh_wave_speed:.0f}, c_s {problem.solid.shear_wave_speed:.0f},"
            f" c_d {problem.solid.dilatational_wave_speed:.0f})"
        )
        if np.nanmax(result.median_rupture_speed) > problem.solid.dilatational_wave_speed:
            lines[-1] += ": above c_d where patches ahead slip before the front comes"
    energy, unit = float(result.radiated_energy[-1]), result.radiated_energy.attrs["units"]
    lines.append(f"radiated energy {energy:.4g} {unit}; ended by: {result.attrs['stopped']}")
    return "\n".join(lines)
