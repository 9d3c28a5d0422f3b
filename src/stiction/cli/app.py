"""The command line: parse, call, print."""

from __future__ import annotations

import functools
import logging
import sys
import warnings
from collections.abc import Callable
from typing import Annotated, Any

import typer

from stiction import __version__
from stiction.cli.onset import onset
from stiction.cli.paper import paper
from stiction.cli.reliability import reliability
from stiction.cli.runs import export, plot, report, status
from stiction.cli.rupture import rupture
from stiction.cli.studies import check, run, schema
from stiction.ensemble.trouble import RunError
from stiction.errors import InputError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="The statistics of static friction: at which load, and where, does an interface let go?",
)


def _say_version(asked: bool) -> None:
    if asked:
        typer.echo(f"stiction {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="And exit.")
    ] = False,
) -> None:
    pass


def _interruptible(command: Callable[..., None]) -> Callable[..., None]:
    """Ctrl-C ends a command with exit code 130, as shells expect."""

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            raise typer.Exit(130) from None

    return wrapped


for command in (
    paper,
    run,
    onset,
    rupture,
    reliability,
    check,
    schema,
    status,
    export,
    plot,
    report,
):
    app.command()(_interruptible(command))


def _show_warning(message: Warning | str, *args: Any, **kwargs: Any) -> None:
    typer.echo(f"warning: {message}", err=True)


def main() -> None:
    """Entry point: the user's mistakes end with a message and exit code 2, not a traceback."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    warnings.showwarning = _show_warning
    try:
        app(standalone_mode=True)
    except InputError as error:
        for text in error.problems:
            typer.echo(f"error: {text}", err=True)
        sys.exit(2)
    except (RunError, TimeoutError) as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(1)
