"""Arguments, checks and summaries that several commands share."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.models import OptionInfo

from stiction.errors import InputError

StudyFile = Annotated[
    Path, typer.Argument(metavar="STUDY.toml", help="Study file; `stiction schema` describes it.")
]
RunPath = Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")]
Workers = Annotated[
    int | None,
    typer.Option(help="Threads; all cores by default.", show_default=False, min=1),
]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        help="Seconds; the result is what is done by then, and says so.", show_default=False
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


def in_options(text: str, command: Callable[..., Any] | None) -> str:
    """Return a message in the words of the command line: ``--gaps fill`` for ``gaps="fill"``.

    Parameters
    ----------
    text : str
        Message of a function of the package, which names its own arguments.
    command : callable, optional
        The function of a command, whose options have the names of those arguments.
    """
    hints = {} if command is None else get_type_hints(command, include_extras=True)
    for name, hint in hints.items():
        if any(isinstance(extra, OptionInfo) for extra in getattr(hint, "__metadata__", ())):
            option, argument = f"--{name.replace('_', '-')}", rf"(?<![\w.-]){name}"
            text = re.sub(rf"{argument}=(True\b|\.\.\.)", option, text)
            text = re.sub(rf"{argument}=[\"']?([^\s\"',;)]*)[\"']?", rf"{option} \1", text)
            text = re.sub(rf"^{name}(?=:| must)", option, text)
    return text


def writable(path: Path, what: str) -> Path:
    """Refuse an output file that cannot be written, before any work is done."""
    from stiction.model import FilePath, check

    check("--out", path, FilePath)
    folder = path.absolute().parent
    if path.is_dir():
        raise InputError(f"--out: {path} is a folder; give a file name for {what}")
    if not folder.is_dir():
        raise InputError(f"--out: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"--out: {path} cannot be written")
    return path


def writable_folder(path: Path) -> Path:
    """Make a folder for several files, or refuse it before any work is done."""
    from stiction.model import FilePath, check

    check("--out", path, FilePath)
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
    """Return a few lines about the onset, for people."""
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
    """Return bytes for people."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} TB"
