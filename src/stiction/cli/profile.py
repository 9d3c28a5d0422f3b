"""Options of every command that takes a profile from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Unit = Annotated[
    str | None,
    typer.Option(help="Of the values in PROFILE, such as MPa.", show_default=False),
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
FillGaps = Annotated[
    bool, typer.Option("--fill-gaps", help="Fill missing values with straight lines.")
]


def column(text: str | None) -> str | int | None:
    """A column by name or number."""
    return int(text) if text is not None and text.isdecimal() else text


def profile_of(
    path: Path,
    problem: Any,
    *,
    unit: str | None,
    x_unit: str | None,
    value: str | None,
    x: str | None,
    interpolate: bool,
    fill_gaps: bool,
) -> Any:
    """The strength in a file, on the nodes of a problem."""
    from stiction.profiles import read_profile

    return read_profile(
        path,
        interface=problem.interface,
        x=column(x),
        value=column(value),
        unit=unit,
        x_unit=x_unit,
        interpolate=interpolate,
        gaps="fill" if fill_gaps else "refuse",
    )
