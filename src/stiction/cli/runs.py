"""Commands that make a run on disk or look at one: run, status, export, report."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.cli.common import (
    RunPath,
    StudyFile,
    TimeLimit,
    Workers,
    echo,
    size,
    summary,
    writable,
)
from stiction.errors import InputError
from stiction.progress import Meter, duration

SHOWN = 12


@contextmanager
def _terminated_like_interrupted() -> Iterator[None]:
    """A batch system's SIGTERM ends a run as Ctrl-C does: what is done is stored."""

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """The executor of a Dask scheduler; None without one."""
    if scheduler is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "--scheduler: needs distributed: python -m pip install 'stiction[distributed]'"
        ) from None
    try:
        client = Client(scheduler)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"--scheduler: {scheduler} cannot be reached: {error}") from None
    with client:
        yield client.get_executor(pure=False)


def run(
    study: StudyFile,
    out: Annotated[
        Path,
        typer.Option(metavar="RUN", help="Folder in which results are stored as they are done."),
    ],
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A running Dask scheduler, such as tcp://host:8786."),
    ] = None,
    retry: Annotated[
        bool, typer.Option("--retry", help="Compute stored samples that failed again.")
    ] = False,
    time_limit: TimeLimit = None,
    part: Annotated[
        str | None,
        typer.Option(
            metavar="K/N",
            help="Compute the K-th of N parts only, for jobs that share the folder RUN and do not"
            " know of each other.",
            show_default=False,
        ),
    ] = None,
    pilot: Annotated[
        bool, typer.Option(help="Compare the local criterion with the exact onset.")
    ] = True,
) -> None:
    """Run the study of a file, or what is missing of it.

    The same command goes on where a run was interrupted, however it ended, and computes only the
    new samples if `samples` was raised in the study. The numbers do not depend on workers,
    machines or interruptions.

    Exit code 0: complete; 1: samples failed or the run could not go on; 2: mistakes in the study
    or the command; 3: the time limit was reached; 130: interrupted.
    """
    from stiction.study.run import run_into
    from stiction.study.study import Study, open_run

    if workers is not None and scheduler is not None:
        raise InputError("--workers, --scheduler: give one of them")
    loaded = Study.from_toml(study)
    options: dict[str, Any] = {
        "retry": retry,
        "time_limit": time_limit,
        "part": part,
        "pilot": pilot,
    }
    try:
        with _terminated_like_interrupted(), _executor(scheduler) as executor:
            stored = run_into(loaded, out, workers=workers, executor=executor, **options)
    except KeyboardInterrupt:
        try:
            state = open_run(out).status(verify=False)
            done = f"{state.done} of {state.samples} samples are stored in {out}"
        except RuntimeError:
            done = "nothing is stored yet"
        echo(f"interrupted: {done}; the same command goes on", err=True)
        raise typer.Exit(130) from None
    result = stored.dataset(only=["critical_stress", "friction_coefficient"])
    state = stored.status(verify=False)
    _show_results(loaded, result)
    which = "" if part is None else f"part {part}: "
    echo(f"{which}{state.done} of {state.samples} samples in {out}")
    if state.failures:
        echo(f"{len(state.failures)} samples failed:", err=True)
        _show_some(state.failures, "  ", err=True)
        again = "" if part is None else f" --part {part}"
        command = f"stiction run {study} --out {out}{again} --retry"
        echo(f"compute them again with: {command}", err=True)
        raise typer.Exit(1)
    if not state.complete and part is None:
        reason = "time limit reached" if time_limit is not None else "samples are missing"
        echo(f"{reason}: {result.attrs['cut_short']}; the same command goes on", err=True)
        raise typer.Exit(3 if time_limit is not None else 1)


def _show_some(texts: Sequence[Any], prefix: str, *, err: bool = False) -> None:
    for text in texts[:SHOWN]:
        echo(f"{prefix}{text}", err=err)
    if len(texts) > SHOWN:
        echo(f"{prefix}and {len(texts) - SHOWN} more", err=err)


def _show_results(study: Any, result: Any) -> None:
    from stiction.study.sweep import name_point

    if not study.sweep:
        echo(summary(result))
        return
    flat = result.stack(point=[axis.dim for axis in study.axes])
    for point in study.points[:SHOWN]:
        echo(f"{name_point(point)}:\n  " + summary(flat.isel(point=point.number)))
    if len(study.points) > SHOWN:
        echo(f"and {len(study.points) - SHOWN} more points")


def status(
    run: RunPath,
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Read everything and compare it with its checksums."),
    ] = False,
) -> None:
    """Say how far a run is, which samples failed and which chunks are damaged."""
    from stiction.study.study import open_run
    from stiction.study.sweep import name_point

    stored = open_run(run)
    with Meter(f"checking {run}"):
        state, study = stored.status(verify=verify), stored.study
    share = 100.0 * state.done / state.samples
    echo(f"{run}" + (f": {' '.join(study.title.split())}" if study.title else ""))
    echo(f"  samples   {state.done} of {state.samples} ({share:.1f} %)")
    echo(f"  chunks    {state.chunks}, {size(state.bytes)}")
    if state.seconds:
        echo(f"  computed  {duration(state.seconds)} of one core")
    if study.sweep and not state.complete:
        each = study.ensemble.samples
        open_points = [
            f"{name_point(point)}: {state.done_by_point[point.number]} of {each}"
            for point in study.points
            if state.done_by_point[point.number] < each
        ]
        _show_some(open_points, "  ")
    _show_some(state.damaged, "  damaged   ")
    if state.damaged:
        echo("  running the study again mends this")
    elif state.verified:
        echo("  verified  everything that is stored is what was written")
    if state.failures:
        echo(f"  failed    {len(state.failures)}; `stiction run ... --retry` tries again:")
        _show_some(state.failures, "    ")


def export(
    run: RunPath,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT",
            help="File to write: .nc (NetCDF), .csv, .parquet (needs pyarrow) or .zarr (needs"
            " zarr).",
        ),
    ],
) -> None:
    """Write a run as one file over the sweep and the samples; missing samples are NaN.

    The suffix says which kind. A table (.csv, .parquet) has a row a sample and columns named
    `name (unit)`; profiles along the interface do not fit into it.
    """
    from stiction.study.export import check_suffix
    from stiction.study.study import open_run

    check_suffix(out)
    if not (out.suffix == ".zarr" and out.is_dir()):
        writable(out, "the result")
    stored = open_run(run)
    with Meter(f"exporting {run}"):
        stored.export(out)
        state = stored.status(verify=False)
    if not state.complete:
        missing = state.samples - state.done
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
    from stiction.study.study import open_run

    stored = open_run(run)
    path = writable(out or run / "report.html", "the report")
    with Meter("writing the report"):
        write_report(stored, path)
    echo(f"report: {path}")
