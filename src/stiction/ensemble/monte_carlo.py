"""An ensemble of random interfaces: the public function, and the loop over its samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.ensemble.batches import missing_spans, solve_spans, usable_cores
from stiction.ensemble.dataset import Gathered, GridAxis, warn_of_failures
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.pilot import pilot_attributes
from stiction.ensemble.points import differing_in
from stiction.ensemble.table import Table
from stiction.errors import InputError, collect_warnings, warn_accuracy, warn_user
from stiction.methods import Method
from stiction.model import (
    Flag,
    Progress,
    at_least,
    check,
    describe,
    is_real,
    is_whole,
    names_to_keep,
    to_plain,
)
from stiction.problem import Problem
from stiction.progress import Meter, Show, check_time_limit
from stiction.random.checks import check_residual, warn_if_unresolved
from stiction.random.random_field import RandomField, too_many_samples
from stiction.random.random_interface import RandomInterface

KEEP_LIMIT = 2.0**30
FEW = 4
HOPELESS = 16
"""Samples of a point that fail, with none solved, before the whole ensemble is given up."""


class Rows(Protocol):
    """Where the samples of an ensemble go: to memory, or to a folder."""

    def add(self, table: Table) -> None:
        """Take the rows of a table."""

    def save(self, *, now: bool = False) -> None:
        """Store them if it is time to, or now."""


def compute(
    points: Sequence[Experiment],
    done: NDArray[np.bool_],
    rows: Rows,
    *,
    first: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    time_limit: float | None = None,
    seconds: float = 0.25,
) -> None:
    """Compute the samples of some points that are not done.

    Parameters
    ----------
    points : sequence of Experiment
    done : (points, samples) array of bool
    rows : Rows
        Gets them as they are solved. When the seconds of `time_limit` are over, the rest is left.
    first : int
        Number of the first sample.
    workers, executor, progress, time_limit
        See `monte_carlo`.
    seconds : float
        About how long a piece of work takes.

    Raises
    ------
    InputError, RuntimeError
        If no sample of a point can be solved.
    StoreError, WorkerError
    """
    spans = missing_spans(done, first)
    if spans:
        check_fields(points)
    solved = done.any(axis=1)
    lost = np.zeros(len(points), dtype=np.int64)
    enough = np.minimum(HOPELESS, (~done).sum(axis=1))
    workers = usable_cores() if workers is None else workers
    work = solve_spans(points, spans, executor=executor, workers=workers, seconds=seconds)
    total = sum(span.samples for span in spans)
    with (
        Meter(_method_name(points), total, progress, time_limit=time_limit) as meter,
        closing(work),
    ):
        try:
            for table in work:
                if table is not None:
                    rows.add(table)
                    meter.advance(table.count)
                    solved[table.point] = True
                    for failure in table.failures:
                        lost[failure.point] += 1
                        if (
                            lost[failure.point] >= enough[failure.point]
                            and not solved[failure.point]
                        ):
                            raise failure.exception()
                rows.save()
                if meter.over:
                    break
        finally:  # also on Ctrl-C, and when workers are lost: what is done is kept
            rows.save(now=True)


def _method_name(points: Sequence[Experiment]) -> str:
    """The method of some points, for progress."""
    names = {point.method.label for point in differing_in(points, "method")}
    return str(names.pop()) if len(names) == 1 else "samples"


def check_fields(points: Sequence[Experiment]) -> None:
    """Warn of fields that do not suit the grid, the interface or their units, once each."""
    pairs = list(
        dict.fromkeys(
            (field, point.problem.interface)
            for point in differing_in(points, "random", "problem.interface")
            for field in point.random.properties.values()
        )
    )
    some = differing_in(points, "random", "problem")
    meter = Meter("checking the fields", len(pairs) + len(some), unit="fields")
    with collect_warnings() as caught, meter:
        for field, interface in pairs:
            field.warn_if_inaccurate(interface)
            meter.advance()
        for point in some:
            point.problem.warn_of_units(point.mean("strength"))
            check_residual(point.problem, point.random.properties)
            warn_if_unresolved(point.problem, point.random)
            meter.advance()
    found = list(dict.fromkeys(caught))
    for text, category in found[:FEW]:
        warn_user(text, category)
    if len(found) > FEW:
        more = f"{len(found) - FEW} more warnings like these, at other points of the sweep"
        warn_accuracy(more)


def wide_bytes(experiment: Experiment, samples: int, first: int = 0) -> float:
    """Return the bytes of what is kept along the interface."""
    kept = samples
    if experiment.keep_samples is not None:
        kept = sum(first <= sample < first + samples for sample in experiment.keep_samples)
    return 8.0 * experiment.problem.interface.size * len(experiment.wide) * kept


def check_size(needed: float, limit: float) -> None:
    """Refuse to keep more than the stated size."""
    if needed > limit:
        raise InputError(
            f"keep: what is kept along the interface takes {needed / 2**20:,.0f} MiB, more than"
            f" keep_limit = {limit / 2**20:,.0f} MiB; keep fewer variables, choose samples with"
            " keep_samples, or raise keep_limit (bytes)"
        )


def check_options(
    *, workers: Any, executor: Any, progress: Any, time_limit: Any, pilot: Any
) -> int | None:
    """Return the number of workers; refuse options of a run that make no sense."""
    check("progress", progress, Progress)
    check("pilot", pilot, Flag)
    if workers is not None:
        workers = check("workers", workers, at_least(1))
    if executor is not None and not hasattr(executor, "submit"):
        raise InputError(
            f"executor: must be a concurrent.futures executor, got {describe(executor)}"
        )
    problems = check_time_limit(time_limit)
    if problems:
        raise InputError(problems)
    return workers


def _check_keep(
    keep: Any, keep_samples: Any, keep_limit: Any
) -> tuple[tuple[str, ...], tuple[int, ...] | None]:
    """What is to be kept, and of which samples, or what is wrong with it."""
    problems: list[str] = []
    names: tuple[str, ...] = ()
    try:
        names = names_to_keep(keep)
    except InputError as error:
        problems += error.problems
    known = keep_samples is None or (
        isinstance(keep_samples, list | tuple | range | np.ndarray)
        and getattr(keep_samples, "ndim", 1) == 1
        and all(is_whole(sample, 0) for sample in keep_samples)
    )
    if not known:
        given = describe(keep_samples)
        problems.append(f"keep_samples: must be a list of sample numbers, got {given}")
    if not (is_real(keep_limit) and keep_limit > 0.0):
        problems.append(f"keep_limit: must be a positive number, got {describe(keep_limit)}")
    if problems:
        raise InputError(problems)
    return names, None if keep_samples is None else tuple(int(sample) for sample in keep_samples)


def gather(
    points: Sequence[Experiment],
    samples: int,
    *,
    first: int = 0,
    axes: Sequence[GridAxis] = (),
    attributes: Mapping[str, Any],
    pilot: bool = True,
    time_limit: float | None = None,
    **options: Any,
) -> xr.Dataset:
    """Compute samples first .. first + samples - 1 of every point in memory; see `monte_carlo`."""
    rows = Gathered(points, samples, first)
    compute(points, rows.done.copy(), rows, first=first, time_limit=time_limit, **options)
    if pilot:
        attributes = {**attributes, **pilot_attributes(points, samples, first)}
    result = rows.dataset(attributes, axes)
    warn_of_failures(rows.failed, len(points) * samples)
    for failure in rows.failed:
        rows.done[failure.point, failure.sample - first] = True
    return result if rows.done.all() else _cut_short(result, rows.done)


def _cut_short(result: xr.Dataset, done: NDArray[np.bool_]) -> xr.Dataset:
    """The first samples, up to one that no point has, when the time was over."""
    count = int(np.argmin(np.append(done.any(axis=0), False)))
    if not count:
        raise TimeoutError(
            "time_limit: not one sample was done in this time; raise time_limit, or give out= to"
            " keep what is done and go on later"
        )
    result = result.isel(sample=slice(0, count))
    if "kept_sample" in result.dims:
        there = np.isin(result["kept_sample"].values, result["sample"].values)
        result = result.isel(kept_sample=there)
    text = f"{done[:, :count].sum()} of {done.size} samples were done when the time was over"
    warn_accuracy(text)
    return result.assign_attrs(cut_short=text)


def study_attributes(experiment: Experiment, samples: int, first: int = 0) -> dict[str, Any]:
    """Return all it takes to run an experiment again, as a study in plain form."""
    ensemble: dict[str, Any] = {"samples": samples, "seed": experiment.seed, "first": first}
    ensemble["keep"] = list(experiment.keep)
    if experiment.keep_samples is not None:
        ensemble["keep_samples"] = list(experiment.keep_samples)
    try:
        study: dict[str, Any] = {
            "problem": to_plain(experiment.problem),
            "random": to_plain(experiment.random),
            "method": to_plain(experiment.method),
            "ensemble": ensemble,
        }
    except InputError as error:  # a function of the user's: the result says so and is still one
        return {"study_incomplete": str(error), "seed": experiment.seed}
    return {"study": study, "seed": experiment.seed}


def monte_carlo(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    method: Method,
    samples: int,
    seed: int = 0,
    first: int = 0,
    keep: str | Sequence[str] = (),
    keep_samples: Sequence[int] | None = None,
    keep_limit: float = KEEP_LIMIT,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    time_limit: float | None = None,
    pilot: bool = True,
) -> xr.Dataset:
    """Onset of many random interfaces.

    Sample i depends on (seed, i) only: not on the number of samples, the workers or the executor.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    samples : int
        Number of samples.
    seed : int
        Not negative.
    first : int
        Number of the first sample, to continue an ensemble.
    keep : str or tuple of str
        What is kept along the interface: random fields, such as ``"strength"``, and what the
        method can add, such as ``"sensitivity"``.
    keep_samples : sequence of int, optional
        Numbers of the samples for which it is kept; all if left out.
    keep_limit : float
        Bytes that this may take.
    workers : int, optional
        Threads; all cores by default. The compiled kernels release the interpreter lock.
    executor : concurrent.futures.Executor, optional
        Anything that has `submit`: processes, a Dask client's executor, ... instead of threads.
    progress : bool or callable
        True shows how far it is, on standard error, once it takes more than two seconds; a
        callable gets (done, total).
    time_limit : float, optional
        Seconds. When they are over, the result holds the samples that are done, with the
        attribute 'cut_short'; they are the first ones, to which `first` adds the rest later.
    pilot : bool
        Solve the first samples by `Equilibrium` too if the method is the local criterion, 32 on a
        line and 8 on a plane, and say how far the two are apart; the ensemble stays the same.

    Returns
    -------
    xarray.Dataset
        Over 'sample', as from `onset`. The attributes hold the version, the study as JSON and the
        seed: enough to run it again. Samples that could not be solved are NaN, and listed in the
        attribute 'failed_samples' (point, sample, seed, message, whether the sample itself does
        not fit). With a pilot, 'pilot_bias' and 'pilot_scatter' are the mean and the standard
        deviation of the difference in `critical_stress`, relative to the mean by `Equilibrium`.

    Raises
    ------
    InputError
        Naming all that does not fit. If no sample at all can be solved, naming one with its seed.
    RuntimeError
        Naming a sample and the seed, if a solver fails on all of them.
    TimeoutError
        If not one sample was done within `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the time limit was reached, samples could not be solved, or the pilot differs from the
        local criterion by more than 1 %.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> method = st.LocalCriterion()
    >>> found = st.monte_carlo(problem, strength, method=method, samples=50, seed=0)
    >>> found.critical_stress.dims, found.critical_stress.attrs["units"]
    (('sample',), 'Pa')
    """
    names, chosen = _check_keep(keep, keep_samples, keep_limit)
    samples, first = check("samples", samples, at_least(1)), check("first", first, at_least(0))
    seed = check("seed", seed, at_least(0))
    if problems := too_many_samples(samples, first):
        raise InputError(problems)
    workers = check_options(
        workers=workers, executor=executor, progress=progress, time_limit=time_limit, pilot=pilot
    )
    experiment = Experiment(problem, random, method, names, chosen, seed)
    check_size(wide_bytes(experiment, samples, first), keep_limit)
    return gather(
        [experiment],
        samples,
        first=first,
        attributes=study_attributes(experiment, samples, first),
        workers=workers,
        executor=executor,
        progress=progress,
        time_limit=time_limit,
        pilot=pilot,
    )
