"""The command that reproduces the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stiction.cli.common import Workers, echo


def paper(
    out: Annotated[Path, typer.Option(help="Folder for results, figures and the report.")] = Path(
        "stiction-paper"
    ),
    samples: Annotated[
        int | None,
        typer.Option(
            help="Samples for each correlation length: 10,000, or 500 with --quick.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the ensemble.")] = 0,
    quick: Annotated[
        bool, typer.Option("--quick", help="500 samples, few ruptures: a first look.")
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Also a Monte Carlo study by elastodynamics.")
    ] = False,
    ruptures: Annotated[
        int | None,
        typer.Option(
            help="Ruptures for each correlation length: 20, or all samples with --full.",
            show_default=False,
        ),
    ] = None,
    workers: Workers = None,
    only: Annotated[
        list[str] | None, typer.Option(help="Only this figure; may be given several times.")
    ] = None,
) -> None:
    """Compute the paper's statistics, draw its figures and write a report.

    Albertini, Karrer, Grigoriu and Kammer (2020), Stochastic properties of static friction. Makes
    a folder with `report.html`, `results.nc`, the figures (PNG and PDF) and the tables behind them.
    Results are kept there as they come: the same command after an interruption goes on.
    """
    from stiction import paper as room

    report = room.run(
        out=out,
        samples=samples,
        seed=seed,
        quick=quick,
        full=full,
        ruptures=ruptures,
        workers=workers,
        only=only,
        progress=True,
    )
    echo(f"report: {report}")
