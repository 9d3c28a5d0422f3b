"""The command that opens the explorer."""

from __future__ import annotations

import importlib.util
from typing import Annotated

import typer

from stiction.errors import InputError


def explore(
    port: Annotated[int, typer.Option(help="0 takes any that is free.")] = 5006,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address, open nothing.")
    ] = False,
) -> None:
    """Open a page with sliders for strength, friction, pressure and length.

    As they move it shows a strength profile with its slip patches under load, the distribution of
    the friction coefficient over a thousand samples and its lower tail; it shows the Python for
    that, and saves it as a study file. Served on 127.0.0.1 only; Ctrl-C ends it. Needs the extra
    `app`.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"--port: must lie between 0 and 65535, got {port}")
    if importlib.util.find_spec("panel") is None:
        raise InputError(
            "explore: needs panel, which is not installed: python -m pip install 'stiction[app]',"
            " or python -m pip install panel"
        )
    from stiction.explorer.page import free_port, serve

    serve(port or free_port(), show=not no_browser)
