"""The command that fits a random field to profiles and draws what it is judged by."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from stiction.cli.common import TimeLimit, Workers, echo, writable_folder
from stiction.cli.profile import Unit, ValueName, XName, XUnit, column
from stiction.errors import InputError


def fit(
    profiles: Annotated[
        list[Path],
        typer.Argument(
            metavar="PROFILE...",
            help="One or more records of one field: text (.csv, .txt, ...), .npy or NetCDF; in Pa"
            " and m unless they state units, as in 'x (mm); strength (MPa)'.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the page, the figure and the field.")] = (
        Path("stiction-fit")
    ),
    marginal: Annotated[
        list[str] | None,
        typer.Option(
            help="Family of the values; several are compared, which is also done without.",
            show_default=False,
        ),
    ] = None,
    low: Annotated[
        float | None, typer.Option(help="Lower bound of the marginal, SI.", show_default=False)
    ] = None,
    high: Annotated[
        float | None, typer.Option(help="Upper bound of the marginal, SI.", show_default=False)
    ] = None,
    spectrum: Annotated[
        Literal["power_law", "squared_exponential", "exponential"],
        typer.Option(help="Family of the spectrum."),
    ] = "power_law",
    exponent: Annotated[
        float | None,
        typer.Option(help="Of the power law; estimated if left out.", show_default=False),
    ] = None,
    detrend: Annotated[int, typer.Option(help="Degree of the trend to take off, 0 to 3.")] = 0,
    noise: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation of the measurement noise, SI; estimated if left out.",
            show_default=False,
        ),
    ] = None,
    gaps: Annotated[
        Literal["refuse", "skip"],
        typer.Option(help="What to do where values are missing; 'skip' leaves them out."),
    ] = "refuse",
    quantity: Annotated[
        str, typer.Option(help="What it is: strength, normal_pressure, ...")
    ] = "strength",
    bootstrap: Annotated[int, typer.Option(help="Repetitions that intervals come from.")] = 200,
    seed: Annotated[int, typer.Option(help="Of the repetitions.")] = 0,
    unit: Unit = None,
    x_unit: XUnit = None,
    value: ValueName = None,
    x: XName = None,
    workers: Workers = None,
    time_limit: TimeLimit = None,
) -> None:
    """Which random field has such profiles, and how well is it known?

    Fits a marginal and a spectrum, with the measurement noise, prints every parameter with its
    interval, and writes a page of plots (page.html, fit.png) and the field as a table of a study
    file (field.toml).
    """
    import tomli_w

    from stiction._model import to_plain
    from stiction.inference.fit import MARGINALS, fit_field
    from stiction.profiles import read_profile
    from stiction.report.fit_page import write_fit

    folder = writable_folder(out)
    records = [
        read_profile(
            path, x=column(x), value=column(value), unit=unit, x_unit=x_unit, quantity=quantity,
            gaps=gaps,
        )
        for path in profiles
    ]  # fmt: skip
    found = fit_field(
        records,
        marginal=_marginals(marginal or list(MARGINALS), low, high),
        spectrum=_spectrum(spectrum, exponent),
        detrend=detrend,
        noise=True if noise is None else noise,
        gaps=gaps,
        quantity=quantity,
        bootstrap=bootstrap,
        seed=seed,
        workers=workers,
        time_limit=time_limit,
    )
    echo(str(found))
    table = {"random": {quantity: to_plain(found.field)}}
    write_fit(found, [str(path) for path in profiles], tomli_w.dumps(table), folder)
    echo(f"page: {folder / 'page.html'}; field: {folder / 'field.toml'}")


def _marginals(names: list[str], low: float | None, high: float | None) -> Any:
    kept = {name: one for name, one in (("low", low), ("high", high)) if one is not None}
    if not kept:
        return names
    if len(names) > 1:
        raise InputError("--low, --high: are bounds of one family; name it with --marginal")
    return {"type": names[0]} | kept


def _spectrum(name: str, exponent: float | None) -> Any:
    if exponent is None:
        return name
    return {"type": name, "exponent": exponent}
