"""An ensemble of random interfaces: the public function, and the loop over its samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.ensemble.batches import AnyExecutor, missing_spans, solve_spans, usable_cores
from stiction.ensemble.dataset import Gathered, GridAxis, warn_of_failures
from stiction.ensemble.experiment import AnyRandom, Chosen, Ensemble, Experiment
from stiction.ensemble.pilot import pilot_attributes
from stiction.ensemble.points import differing_in
from stiction.ensemble.table import Table
from stiction.errors import InputError, collect_warnings, warn_accuracy, warn_user
from stiction.methods import MethodObject
from stiction.model import (
    Count,
    Flag,
    Names,
    Number,
    Positive,
    Progress,
    Seconds,
    checked,
    to_plain,
)
from stiction.problem import Problem
from stiction.progress import Meter, Show
from stiction.random.random_field import too_many_samples

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
        if len(points) == 1:
            points[0].prepare()  # here and not in a thread, so that it warns at the caller's line
    solved: NDArray[np.bool_] = np.any(done, axis=1)
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
    some = differing_in(points, "random", "problem")
    with collect_warnings() as caught, Meter("checking the fields", len(some)) as meter:
        for point in some:
            point.check_fields()
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


def check_size(needed: float, limit: float | None) -> None:
    """Refuse to keep more than the stated size, 1 GiB if it is None."""
    limit = KEEP_LIMIT if limit is None else limit
    if needed > limit:
        raise InputError(
            f"keep: what is kept along the interface takes {needed / 2**20:,.0f} MiB, more than"
            f" keep_limit = {limit / 2**20:,.0f} MiB; keep fewer variables, choose samples with"
            " keep_samples, or raise keep_limit (bytes)"
        )


def gather(
    points: Sequence[Experiment],
    ensemble: Ensemble,
    attributes: Mapping[str, Any],
    axes: Sequence[GridAxis] = (),
    *,
    pilot: bool = True,
    **options: Any,
) -> xr.Dataset:
    """Compute an ensemble at every point in memory; `options` are those of `compute`."""
    samples, first = ensemble.samples, ensemble.first
    rows = Gathered(points, samples, first)
    compute(points, rows.done.copy(), rows, first=first, **options)
    if pilot:
        show = options.get("progress", True) is True
        attributes = {**attributes, **pilot_attributes(points, samples, first, show=show)}
    result = rows.dataset(attributes, axes)
    warn_of_failures(rows.failed, rows.done.size)
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


def _attributes(experiment: Experiment, ensemble: Ensemble) -> dict[str, Any]:
    """All it takes to run an ensemble again, as a study in plain form."""
    parts = {name: getattr(experiment, name) for name in ("problem", "random", "method")}
    parts["ensemble"] = replace(ensemble, keep_limit=None)
    try:
        study = {name: to_plain(part) for name, part in parts.items()}
    except InputError as error:  # a function of the user's: the result says so and is still one
        return {"study_incomplete": str(error), "seed": ensemble.seed}
    return {"study": study, "seed": ensemble.seed}


@checked
def monte_carlo(
    problem: Problem,
    random: AnyRandom,
    *,
    method: MethodObject,
    samples: Count,
    seed: Number = 0,
    first: Number = 0,
    keep: Names = (),
    keep_samples: Chosen | None = None,
    keep_limit: Positive | None = None,
    workers: Count | None = None,
    executor: AnyExecutor | None = None,
    progress: Progress = True,
    time_limit: Seconds | None = None,
    pilot: Flag = True,
) -> xr.Dataset:
    """Compute the onset of many random interfaces.

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
    keep_samples : sequence of int or int, optional
        Numbers of the samples for which it is kept, or how many of the first; all if left out.
    keep_limit : float, optional
        Bytes that this may take; 1 GiB if left out.
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
    if problems := too_many_samples(samples, first):
        raise InputError(problems)
    ensemble = Ensemble(
        samples=samples,
        seed=seed,
        first=first,
        keep=keep,
        keep_samples=keep_samples,
        keep_limit=keep_limit,
    )
    experiment = ensemble.of(problem, random, method)
    check_size(wide_bytes(experiment, samples, first), ensemble.keep_limit)
    return gather(
        [experiment],
        ensemble,
        _attributes(experiment, ensemble),
        workers=workers,
        executor=executor,
        progress=progress,
        time_limit=time_limit,
        pilot=pilot,
    )
