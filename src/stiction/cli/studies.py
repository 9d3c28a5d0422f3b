"""Commands that work with study files: run, check, schema."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from stiction.cli.common import StudyFile, TimeLimit, Workers, echo, size, summary
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


def run(
    study: StudyFile,
    out: Annotated[
        Path,
        typer.Option(
            metavar="RUN",
            help="Folder in which results are stored as they are done, or a .nc file (with such a"
            " folder beside it until it is complete).",
        ),
    ],
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A running Dask scheduler, such as tcp://host:8786."),
    ] = None,
    slurm: Annotated[
        bool,
        typer.Option(
            "--slurm",
            help="Submit SLURM jobs; what they ask for is in [cluster] of the study or in"
            " dask-jobqueue's own configuration.",
        ),
    ] = False,
    retry: Annotated[
        bool, typer.Option("--retry", help="Compute stored samples that failed again.")
    ] = False,
    time_limit: TimeLimit = None,
    part: Annotated[
        str | None,
        typer.Option(
            metavar="K/N",
            help="Compute the K-th of N parts only, into RUN.parts, for jobs that know nothing of"
            " each other; `stiction merge RUN` joins them.",
            show_default=False,
        ),
    ] = None,
    no_lock: Annotated[
        bool,
        typer.Option(
            "--no-lock",
            help="For file systems without locks: do not keep other runs out of RUN.",
        ),
    ] = False,
) -> None:
    """Run the study of a file, or what is missing of it.

    The same command goes on where a run was interrupted, however it ended, and computes only the
    new samples if `samples` was raised in the study. The numbers do not depend on workers,
    machines or interruptions.

    Exit code 0: complete; 1: samples failed or the run could not go on; 2: mistakes in the study
    or the command; 3: the time limit was reached; 130: interrupted.
    """
    from stiction._checks import as_path
    from stiction.ensemble.part import as_part
    from stiction.stored_run import StoredRun
    from stiction.study.study import Study
    from stiction.study_run import check_target, make_part_folder, run_into

    if sum((workers is not None, scheduler is not None, slurm)) > 1:
        raise InputError("--workers, --scheduler, --slurm: give one of them")
    mine = None if part is None else as_part(part)
    loaded = Study.from_toml(study)
    loaded.to_dict()
    place = as_path("--out", out)
    if mine is None:
        check_target(place)
    else:
        place = make_part_folder(place, mine)
    try:
        with _terminated_like_interrupted(), _executor(loaded, scheduler, slurm) as executor:
            stored = run_into(
                loaded,
                out,
                workers=workers,
                executor=executor,
                retry=retry,
                time_limit=time_limit,
                lock=not no_lock,
                part=mine,
            )
    except KeyboardInterrupt:
        try:
            state = StoredRun(place).status()
            done = f"{state.done} of {state.samples} samples are stored in {place}"
        except RuntimeError:
            done = "nothing is stored yet"
        echo(f"interrupted: {done}; the same command goes on", err=True)
        raise typer.Exit(130) from None
    names = ["critical_stress", "friction_coefficient"]
    result = stored.dataset(only=names)
    _show_results(loaded, result)
    if stored.missing(mine):
        text = f"time limit reached: {result.attrs['cut_short']}, stored in {place}"
        echo(f"{text}; the same command goes on", err=True)
        raise typer.Exit(3)
    state = stored.status()
    which = "" if mine is None else f"part {mine.number} of {mine.of}: "
    echo(f"{which}{state.done} samples in {place}")
    if state.failures:
        again = "" if mine is None else f" --part {part}"
        _show_failures(state.failures, f"stiction run {study} --out {out}{again} --retry")
        raise typer.Exit(1)


def merge(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="What was given as --out with --part."),
    ],
) -> None:
    """Join the parts of a run that jobs have computed with `stiction run --part K/N`.

    The numbers are those of one run, to the bit. Parts stay as they are. Those that are missing,
    not finished or damaged are named, and the others are joined.

    Exit code 0: complete; 1: samples are missing or have failed.
    """
    from stiction.merge import merge_parts

    stored = merge_parts(run)
    _show_results(stored.study, stored.dataset(only=["critical_stress", "friction_coefficient"]))
    state = stored.status()
    echo(f"{state.done} of {state.samples} samples in {run}")
    if state.failures:
        _show_failures(state.failures, f"stiction run STUDY.toml --out {run} --retry")
    if not state.complete:
        raise typer.Exit(1)


def _executor(study: Any, scheduler: str | None, slurm: bool) -> Any:
    if scheduler is None and not slurm:
        return nullcontext()
    from stiction.ensemble.distributed import dask_executor

    return dask_executor(scheduler, study.cluster)


def _show_failures(failures: Any, command: str) -> None:
    echo(f"{len(failures)} samples failed:", err=True)
    for failure in failures[:SHOWN]:
        echo(f"  {failure}", err=True)
    if len(failures) > SHOWN:
        echo(f"  and {len(failures) - SHOWN} more", err=True)
    echo(f"compute them again with: {command}", err=True)


def _show_results(study: Any, result: Any) -> None:
    from stiction.study.sweep import name_point

    if not study.sweep:
        echo(summary(result))
        return
    dims = [axis.dim for axis in study.axes]
    flat = result.stack(point=dims)
    for point in study.points[:SHOWN]:
        echo(f"{name_point(point)}:\n  " + summary(flat.isel(point=point.number)))
    if len(study.points) > SHOWN:
        echo(f"and {len(study.points) - SHOWN} more points")


def check(
    study: StudyFile,
    probe: Annotated[
        bool, typer.Option(help="Time a few samples (about two seconds) to estimate the time.")
    ] = True,
) -> None:
    """Say what a study file would do, how long and how big, or everything that is wrong with it."""
    from stiction.study.study import Study

    loaded = Study.from_toml(study)
    echo(f"{study}: valid" + (f", {loaded.title!r}" if loaded.title else ""))
    for name, text in _description(loaded):
        echo(f"  {name:20s} {text}")
    if probe:
        with Meter("timing a few samples"):
            cost = _cost(loaded)
        for name, text in cost:
            echo(f"  {name:20s} {text}")


def _description(study: Any) -> list[tuple[str, str]]:
    plans, ensemble = study.plans, study.ensemble
    samples = f"{ensemble.samples} (seed {ensemble.seed})"
    if study.sweep:
        samples += f" at each of {len(plans)} points: {len(plans) * ensemble.samples} in all"
    methods = list(dict.fromkeys(plan.method.label for plan in plans))
    lines = [("method", ", ".join(methods)), ("samples", samples)]
    for axis in study.axes:
        keys = " with ".join(variable.long_name for _, variable in axis.coordinates.values())
        values = next(iter(axis.coordinates.values()))[0]
        lines.append(("sweep", f"{keys}: {axis.size} values, {values[0]} to {values[-1]}"))
    lines.append(("effective modulus", _range([p.problem.effective_modulus for p in plans], "Pa")))
    lines += _resolution([plan.problem for plan in plans])
    means = _range([plan.random.strength.mean for plan in plans], "Pa")
    deviations = _range([plan.random.strength.standard_deviation for plan in plans], "Pa")
    modes = _range(
        [plan.random.strength.modes(plan.problem.interface).count for plan in plans], "modes"
    )
    lines.append(("strength", f"mean {means}, standard deviation {deviations}, {modes}"))
    fields = {plan.random.strength for plan in plans}
    lines.append(
        (
            "correlation 1/e at",
            _range([field.efolding_length() for field in fields], "m") + " (of the strength)",
        )
    )
    if plans[0].wide:
        chosen = "all" if ensemble.keep_samples is None else str(len(ensemble.keep_samples))
        lines.append(("kept", f"{', '.join(plans[0].wide)} of {chosen} samples"))
    return lines


def _range(values: Any, unit: str) -> str:
    low, high = min(values), max(values)
    text = f"{low:.6g}" if low == high else f"{low:.4g} to {high:.4g}"
    return f"{text} {unit}"


def _resolution(problems: Any) -> list[tuple[str, str]]:
    try:
        lengths = [problem.nucleation_length for problem in problems]
    except InputError:
        return [("nucleation length", "varies along the interface")]
    pairs = list(zip(problems, lengths, strict=True))
    rates = [problem.uniform_rate for problem in problems]
    nodes = _range(
        [p.nodes_in_nucleation_length(rate) for p, rate in zip(problems, rates, strict=True)],
        "nodes",
    )
    ratio = " x ".join(
        _range([problem.interface.lengths[i] / length for problem, length in pairs], "h_n")
        for i in range(min(len(problem.interface.lengths) for problem in problems))
    )
    return [("nucleation length", f"{_range(lengths, 'm')}: {nodes}, L = {ratio}")]


def _cost(study: Any) -> list[tuple[str, str]]:
    from stiction.ensemble.cost_estimate import probe_time, stored_bytes
    from stiction.ensemble.scheduler import usable_cores

    ensemble, plans = study.ensemble, study.plans
    cost = probe_time(plans, ensemble.samples, ensemble.first)
    low, high = (duration(seconds) for seconds in cost.per_sample)
    each = low if low == high else f"{low} to {high}"
    cores = usable_cores()
    lines = [
        (
            "time",
            f"about {duration(cost.seconds)} on one core, {duration(cost.seconds / cores)} on the"
            f" {cores} here ({each} a sample, probed at {cost.probed} of {len(plans)} points)",
        ),
        ("size", f"about {size(stored_bytes(plans, ensemble.samples, ensemble.first))}"),
    ]
    lines += [("failed in the probe", text) for text in cost.failures[:SHOWN]]
    return lines


def schema() -> None:
    """Print the JSON schema of a study file, for editors that complete and check TOML."""
    from stiction.study.study import study_schema

    echo(json.dumps(study_schema(), indent=2))
