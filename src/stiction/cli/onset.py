"""The command that asks every method about one profile."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.cli.common import StudyFile, echo, writable
from stiction.cli.profile import (
    FillGaps,
    Interpolate,
    Unit,
    ValueName,
    XName,
    XUnit,
    profile_of,
)
from stiction.errors import InputError
from stiction.progress import Meter, duration

COLUMNS = ("method", "critical stress", "critical load", "first instability", "position", "time")


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
    loading_rate: Annotated[
        float, typer.Option(help="Of the dynamic method, Pa/s, unless the study gives one.")
    ] = 2e7,
    out: Annotated[
        Path | None, typer.Option(help="Figure to write (.png, .pdf or .svg).", show_default=False)
    ] = None,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    interpolate: Interpolate = False,
    fill_gaps: FillGaps = False,
) -> None:
    """At which load, and where, does one interface of given strength begin to slide?

    Takes the problem (and the method, if it has one) from a study file, which needs nothing else,
    and the strength from PROFILE, asks every method that applies, and prints a table; with --out
    also draws the profile and where each method sees sliding begin, of a plane its slip patches,
    too. The method of the study keeps its options, the others take their defaults.
    """
    from stiction.study.setup import read_setup

    if out is not None:
        if out.suffix not in (".png", ".pdf", ".svg"):
            raise InputError(f"--out: a figure must end in .png, .pdf or .svg, got {out}")
        writable(out, "the figure")
    problem, own = read_setup(study)
    methods = _methods(own, method, loading_rate)
    if out is not None and problem.interface.is_plane:
        methods = [_with_maps(one) for one in methods]
    profile = profile_of(
        strength,
        problem,
        unit=unit,
        x_unit=x_unit,
        value=value,
        x=x,
        interpolate=interpolate,
        fill_gaps=fill_gaps,
    )
    # Each method refuses, and warns, for itself.
    problem.sample(profile, accept=("barriers", "overstress", "constant"))
    results: dict[str, Any] = {}
    refused: list[tuple[str, str]] = []
    for one in methods:
        try:
            with Meter(f"onset by {one.type}"):
                results[one.type] = _ask(problem, profile, one)
        except InputError as error:
            refused.append((one.type, str(error)))
    _print_table(results, problem.load.normal_pressure is not None)
    for name, text in refused:
        echo(f"{name} does not apply: {text}")
    if not results:
        raise typer.Exit(1)
    _print_gaps(results)
    if out is not None:
        from stiction import plot
        from stiction.plot.style import save_figure

        with Meter("drawing the figure"):
            drawn = {name: result for name, (result, _) in results.items()}
            axes = plot.onset(drawn, profile.values, problem=problem)
            save_figure(axes.figure, out)
        echo(f"figure: {out}")


def _methods(own: Any, names: list[str] | None, loading_rate: float) -> list[Any]:
    """The methods to ask: the study's own as it is, the others with their defaults."""
    from stiction.errors import unknown_name
    from stiction.methods import methods

    classes = methods()
    unknown = [
        unknown_name("--method", name, classes) for name in names or () if name not in classes
    ]
    if unknown:
        raise InputError(unknown)
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


def _with_maps(method: Any) -> Any:
    """The method with the maps that the figure of a plane shows, if it has them."""
    maps = {"slip": True, "sensitivity": True}
    names = {field.name for field in dataclasses.fields(method)}
    return dataclasses.replace(method, **maps) if maps.keys() <= names else method


def _ask(problem: Any, profile: Any, method: Any) -> tuple[Any, float]:
    from stiction.methods import onset as ask

    begin = time.perf_counter()
    result = ask(problem, profile, method=method)
    return result, time.perf_counter() - begin


def _print_table(results: dict[str, Any], with_coefficient: bool) -> None:
    rows = []
    for name, (result, seconds) in results.items():
        stress, load, first = (
            f"{float(result[key][0]) * 1e-6:.6f} MPa"
            for key in ("critical_stress", "critical_load", "first_instability")
        )
        mark = " *" if _in_gap(result) else ""
        place = f"{_place(result['critical_position'][0])}{mark}"
        row = [name, stress, load, first, place, duration(seconds)]
        if with_coefficient:
            row.insert(2, f"{float(result['friction_coefficient'][0]):.6f}")
        rows.append(row)
    head = list(COLUMNS)
    if with_coefficient:
        head.insert(2, "coefficient")
    widths = [max(len(line[i]) for line in [head, *rows]) for i in range(len(head))]
    for line in [head, *rows]:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        echo("  ".join(cells).rstrip())


def _place(position: Any) -> str:
    """A position in mm; on a plane along x and y."""
    if position.ndim == 0:
        return f"{float(position) * 1e3:.4f} mm"
    return ", ".join(
        f"{name} = {float(one) * 1e3:.4f} mm"
        for name, one in zip(position["direction"].values, position, strict=True)
    )


def _in_gap(result: Any) -> bool:
    return "in_gap" in result and bool(result["in_gap"][0])


def _print_gaps(results: dict[str, Any]) -> None:
    """Where the profile was not measured, and whose onset lies there."""
    from stiction.gaps import listed

    first, _ = next(iter(results.values()))
    spans = listed(first)
    if not spans:
        return
    places = ", ".join(f"{a * 1e3:.4f} to {b * 1e3:.4f} mm" for a, b in spans)
    echo(
        f"not measured, filled with straight lines: x = {places}; a weaker place there is not seen"
    )
    inside = [name for name, (result, _) in results.items() if _in_gap(result)]
    if inside:
        echo(
            f"* the onset lies in a gap of the profile ({', '.join(inside)}): the strength there"
            " was filled in, not measured"
        )
