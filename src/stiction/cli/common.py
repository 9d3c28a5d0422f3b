"""Arguments, checks and summaries that several commands share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.errors import InputError

StudyFile = Annotated[
    Path, typer.Argument(metavar="STUDY.toml", help="Study file; `stiction schema` describes it.")
]
RunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="Folder of a run, or the .nc file of a finished one.")
]
Workers = Annotated[
    int | None, typer.Option(help="Threads; all cores by default.", show_default=False)
]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        help="Seconds; what there is by then is the result, and says so.", show_default=False
    ),
]


def echo(text: Any = "", *, err: bool = False) -> None:
    """Print what may come from a file: nothing in it can steer the terminal.

    Control characters other than line ends and tabs, and what is no valid UTF-8, are written as
    their escapes.
    """
    safe = "".join(
        char if char.isprintable() or char in "\n\t" else repr(char)[1:-1] for char in str(text)
    )
    typer.echo(safe, err=err)


def writable(path: Path, what: str) -> Path:
    """Refuse an output that cannot be written before any work is done."""
    from stiction._checks import as_path

    as_path("--out", path)
    folder = path.absolute().parent
    if path.is_dir():
        raise InputError(f"--out: {path} is a folder; give a file name for {what}")
    if not folder.is_dir():
        raise InputError(f"--out: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"--out: {path} cannot be written")
    return path


def writable_folder(path: Path) -> Path:
    """A folder for several files, made if need be, or refused before any work is done."""
    from stiction._checks import as_path

    as_path("--out", path)
    if path.exists() and not path.is_dir():
        raise InputError(f"--out: {path} is a file; give the name of a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out: {path} cannot be made: {error}") from None
    if not os.access(path, os.W_OK):
        raise InputError(f"--out: {path} cannot be written")
    return path


def summary(result: Any) -> str:
    """A few lines about the onset, for people."""
    lines = []
    for name in ("critical_stress", "friction_coefficient"):
        if name in result and bool(result[name].notnull().any()):
            variable = result[name]
            low, middle, high = (float(variable.quantile(q)) for q in (0.05, 0.5, 0.95))
            scale, unit = (1e-6, " MPa") if variable.attrs["units"] == "Pa" else (1.0, "")
            lines.append(
                f"{name:22s} mean {float(variable.mean()) * scale:.5g}{unit},"
                f" sd {float(variable.std()) * scale:.3g},"
                f" 5/50/95 % {low * scale:.5g} / {middle * scale:.5g} / {high * scale:.5g}"
            )
    return "\n".join(lines)


def size(count: float) -> str:
    """Bytes for people."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} TB"
