"""Commands that look at a run on disk: status, export, plot, report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stiction.cli.common import RunPath, echo, size, writable
from stiction.progress import Meter, duration

SHOWN = 20


def status(
    run: RunPath,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Read everything and compare it with its checksums; else whether chunks are"
            " there in their sizes.",
        ),
    ] = False,
) -> None:
    """Say how far a run is, which samples failed and which chunks are damaged."""
    from stiction.stored_run import StoredRun
    from stiction.study.sweep import name_point

    stored = StoredRun(run)
    with Meter(f"checking {run}"):
        state, study = stored.status(verify=verify), stored.study
    share = 100.0 * state.done / state.samples
    echo(f"{run}" + (f": {' '.join(study.title.split())}" if study.title else ""))
    echo(f"  samples   {state.done} of {state.samples} ({share:.1f} %)")
    echo(f"  chunks    {state.chunks}, {size(state.bytes)}")
    if state.seconds:
        echo(f"  computed  {duration(state.seconds)} of one core")
    if state.active:
        echo("  a run is writing to it now")
    if study.sweep and not state.complete:
        open_points = [
            p for p in study.points if state.done_by_point[p.number] < (study.ensemble.samples)
        ]
        for point in open_points[:SHOWN]:
            done = state.done_by_point[point.number]
            echo(f"  {name_point(point)}: {done} of {study.ensemble.samples}")
        if len(open_points) > SHOWN:
            echo(f"  and {len(open_points) - SHOWN} more points that are not complete")
    for text in state.damaged[:SHOWN]:
        echo(f"  damaged   {text}; running the study again mends this")
    if state.verified and not state.damaged:
        echo("  verified  everything that is stored is what was written")
    if state.failures:
        echo(f"  failed    {len(state.failures)}; `stiction run ... --retry` tries again:")
        for failure in state.failures[:SHOWN]:
            echo(f"    {failure}")


def export(
    run: RunPath,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT",
            help="What to write: .nc (NetCDF), .csv, .parquet (needs pyarrow) or .zarr (needs"
            " zarr).",
        ),
    ],
) -> None:
    """Write a run as one file over the sweep and the samples; missing samples are NaN.

    The suffix says which kind. A table (.csv, .parquet) has a row a sample and columns named
    `name (unit)`; profiles along the interface do not fit into it.
    """
    from stiction.export import check_suffix
    from stiction.stored_run import StoredRun

    check_suffix(out)
    if not (out.suffix == ".zarr" and out.is_dir()):
        writable(out, "the result")
    stored = StoredRun(run)
    with Meter(f"exporting {run}"):
        stored.export(out)
        state = stored.status()
    missing = state.samples - state.done
    if missing:
        echo(f"warning: {missing} of {state.samples} samples are missing (NaN)", err=True)
    echo(f"{state.done} samples written to {out}")


def report(
    run: RunPath,
    out: Annotated[
        Path | None, typer.Option(help="HTML file; report.html in the run's folder by default.")
    ] = None,
) -> None:
    """Write one self-contained HTML page: figures, tables, failures, the study and versions."""
    from stiction.report import write_report
    from stiction.stored_run import StoredRun

    stored = StoredRun(run)
    path = writable(out or _beside(run, "report.html"), "the report")
    with Meter("writing the report"):
        write_report(stored, path)
    echo(f"report: {path}")


def _beside(run: Path, name: str) -> Path:
    return run / name if run.is_dir() else run.with_name(f"{run.stem}-{name}")
