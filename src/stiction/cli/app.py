"""The command line: parse, call, print."""

from __future__ import annotations

import functools
import logging
import os
import sys
import warnings
from collections.abc import Callable
from typing import Annotated, Any

import typer

from stiction import __version__
from stiction.cli.check import check, schema
from stiction.cli.common import echo, in_options
from stiction.cli.reliability import reliability
from stiction.cli.runs import export, report, run, status
from stiction.cli.single import onset, rupture
from stiction.errors import InputError, RunError

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="The statistics of static friction: at which load, and where, does an interface let go?",
)


def _say_version(asked: bool) -> None:
    if asked:
        echo(f"stiction {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", "-V", callback=_say_version, is_eager=True, help="Print it."),
    ] = False,
) -> None:
    pass


_running: list[Callable[..., None]] = []
"""The command, whose words warnings use."""


def _command(function: Callable[..., None]) -> Callable[..., None]:
    """Errors in the words of the command line; Ctrl-C ends with exit code 130, as shells expect."""

    @functools.wraps(function)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        _running.append(function)
        try:
            function(*args, **kwargs)
        except InputError as error:
            raise InputError([in_options(text, function) for text in error.problems]) from None
        except KeyboardInterrupt:
            echo("interrupted", err=True)
            raise typer.Exit(130) from None

    return wrapped


for function in (run, check, status, export, report, schema, onset, rupture, reliability):
    app.command()(_command(function))


def _show_warning(message: Warning | str, *args: Any, **kwargs: Any) -> None:
    echo(f"warning: {in_options(str(message), _running[-1] if _running else None)}", err=True)


def _of_the_system(error: OSError) -> str:
    """What the system said, with the file it was about."""
    where = f"{error.filename}: " if error.filename else ""
    return f"{where}{error.strerror or error}"


def main() -> None:
    """Entry point: mistakes and a full disk end with a message, not a traceback.

    Exit code 2 for the user's mistakes; 1 where something went wrong on the way.
    """
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    warnings.showwarning = _show_warning
    try:
        try:
            app(standalone_mode=True)
        finally:
            sys.stdout.flush()
    except InputError as error:
        for text in error.problems:
            echo(f"error: {text}", err=True)
        sys.exit(2)
    except (RunError, TimeoutError) as error:
        echo(f"error: {error}", err=True)
        sys.exit(1)
    except MemoryError as error:
        echo(f"error: there is not enough memory for this: {error}", err=True)
        sys.exit(1)
    except OSError as error:
        echo(f"error: {_of_the_system(error)}", err=True)
        _drop_output()
        sys.exit(1)


def _drop_output() -> None:
    """Leave nothing that the interpreter would try to write at its end, to a full disk again."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
