"""An ensemble of random interfaces: the public function and the loop over samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, closing
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from stiction.base.errors import (
    InputError,
    RunError,
    Warned,
    merge_warnings,
    warn_accuracy,
    warn_user,
)
from stiction.base.model import Count, Flag, Names, Number, Progress, checked
from stiction.base.progress import Meter, Show, duration
from stiction.ensemble.batches import solve_spans, spans_of, usable_cores
from stiction.ensemble.dataset import Gathered, GridAxes, distinct
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.pilot import compare, pilot_doubt
from stiction.ensemble.store import Store
from stiction.methods.protocol import MethodObject
from stiction.problem.problem import Problem
from stiction.problem.results import study_attributes
from stiction.random.equally_likely import AnyRandom

if TYPE_CHECKING:
    import xarray as xr

Samples: TypeAlias = Annotated[Count, Field(le=10**10)]
MAX_SHOWN_FAILURES = 3
"""Number of failures that a warning lists."""
LONG_RUN_SECONDS = 3600.0
"""Estimated seconds of a run above which a warning states the time."""
MAX_FAILED_FROM_START = 16
"""Failed items after which a run without any solved item is given up."""


def check_fields(points: Sequence[Experiment]) -> None:
    """Warn once about each field that does not suit the grid, the interface or its unit.

    Each pair of a field and a problem is checked once, and one warning is
    issued.

    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import collect_warnings
    >>> checked_points, problem, a, b = [], Named(), Named(), Named()
    >>> def point(random):
    ...     def check():
    ...         checked_points.append(random)
    ...         warn_accuracy("coarse")
    ...
    ...     return Named(random=random, problem=problem, check_fields=check)
    >>> with collect_warnings() as texts:
    ...     check_fields([point(a), point(b), point(a)])
    >>> checked_points == [a, b], len(checked_points), [str(text) for text in texts]
    (True, 2, ['coarse'])
    """
    with merge_warnings():
        for point in distinct(points, "random", "problem"):
            point.check_fields()


def check_run(points: Sequence[Experiment]) -> None:
    """Check the fields, and prepare the method, before the first sample of a run."""
    check_fields(points)
    points[0].prepare()  # in this thread, so that it warns at the line of the caller


def _warn_if_long(points: Sequence[Experiment], missing: NDArray[Any], workers: int) -> None:
    """Warn about an ensemble that takes hours, before it begins.

    Three samples of an hour and two of three hours take 4.5 hours on two
    cores.

    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import collect_warnings
    >>> def warned(*hours, workers=2):
    ...     missing = np.array([[True, True, True], [False, True, True]])
    ...     with collect_warnings() as texts:
    ...         _warn_if_long(
    ...             [Named(seconds=3600.0 * each) for each in hours], missing, workers
    ...         )
    ...     return [str(text) for text in texts]
    >>> warned(1.0, 3.0)
    ['samples: 5 samples take about 4.5 h on 2 cores']
    >>> warned(1.0, 3.0, workers=1)
    ['samples: 5 samples take about 9 h on 1 core']
    >>> warned(0.4, 0.4), len(warned(0.41, 0.4))  # an hour, and more
    ([], 1)
    """
    # Points of a sweep may take different times for a sample.
    counts = missing.sum(axis=1)
    seconds = sum(p.seconds * n for p, n in zip(points, counts, strict=True)) / workers
    if seconds > LONG_RUN_SECONDS:
        warn_user(
            f"samples: {int(missing.sum()):,} samples take about {duration(seconds)} on {workers}"
            f" core{'s' * (workers > 1)}",
            UserWarning,
        )


def complete(
    rows: Gathered,
    missing: NDArray[np.bool_],
    *,
    store: Store | None,
    executor: Executor | None,
    workers: int,
    progress: Show,
) -> None:
    """Compute missing samples, and pass each finished table to memory and to the store.

    `missing` is a mask (points, samples). A warning that several tables
    cause is issued once.

    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import collect_warnings, warn_of_samples
    >>> from stiction.base.variables import Variable
    >>> def point(factor, failing=()):
    ...     def results(first, count):
    ...         if failing == "all" or first in failing:
    ...             raise ArithmeticError("no root")
    ...         warn_of_samples("{samples} are doubtful", np.arange(count) == 0)
    ...         return {"stress": factor * np.arange(first, first + count)}
    ...
    ...     return Named(
    ...         problem=Named(interface=Named(shape=(16,))),
    ...         method=Named(label="criterion"),
    ...         seed=9,
    ...         batch=300,
    ...         sample_bytes=8.0,
    ...         results=results,
    ...         batches=lambda *span: [span],
    ...     )
    >>> def completed(*points, missing, executor=None):
    ...     rows, tables = Gathered(points, 3, only=["stress"]), []
    ...     store = Named(add=tables.append, save=lambda: tables.append("saved"))
    ...     with collect_warnings() as texts:
    ...         complete(
    ...             rows,
    ...             np.array(missing),
    ...             store=store,
    ...             executor=None,
    ...             workers=1,
    ...             progress=False,
    ...         )
    ...     return rows, tables, [str(text) for text in texts]
    >>> rows, tables, texts = completed(point(2.0, [1]), missing=[[False, True, True]])
    >>> rows.done.tolist(), [failure.sample for failure in rows.failed], texts
    ([[False, False, True]], [1], ['1 of 1 samples (2) are doubtful'])
    >>> len(tables), tables[-1]
    (2, 'saved')
    >>> rows, tables, texts = completed(
    ...     point(2.0), point(3.0), missing=[[True, True, True]] * 2
    ... )
    >>> rows.done.all().item(), texts
    (True, ['2 of 6 samples are doubtful'])
    >>> completed(point(2.0, "all"), missing=[[True, False, True]])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.RunError: sample ... (seed 9): ArithmeticError: no root
    """
    points, lost, total = rows.points, 0, int(missing.sum())
    label = " and ".join({point.method.label: None for point in distinct(points, "method")})
    with ExitStack() as stack:
        if store:  # keep finished samples also after Ctrl-C, or if workers are lost
            stack.callback(store.save)
        warned = stack.enter_context(merge_warnings())
        meter = stack.enter_context(Meter(label, total, progress))
        # Closing the generator cancels pieces that have not begun.
        work = solve_spans(points, spans_of(missing), executor=executor, workers=workers)
        for span, table in stack.enter_context(closing(work)):
            if store:
                store.add(table)
            rows.add(table)
            # Several points have samples with equal numbers.
            warned += table.warned if len(points) == 1 else map(Warned.unnumbered, table.warned)
            meter.advance(span.samples)
            # If no sample succeeds from the start, later samples would
            # fail for the same reason.
            lost += len(table.failures)
            if lost >= min(MAX_FAILED_FROM_START, total) and not rows.done.any():
                failure = table.failures[0]
                texts = [f"{failure.name}: {text}" for text in failure.error.splitlines()]
                raise InputError(texts) if failure.input else RunError("\n".join(texts))


def gather(
    points: Sequence[Experiment],
    samples: int,
    attributes: Mapping[str, Any],
    axes: GridAxes = MappingProxyType({}),
    *,
    store: Store | None = None,
    elsewhere: NDArray[Any] | bool = False,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    pilot: bool = True,
) -> xr.Dataset:
    """Compute an ensemble at every sweep point.

    Stored samples are not computed again.

    Finished samples go to the `store`. `elsewhere`, with shape (points,
    samples), marks samples that a different job computes. See
    `monte_carlo` for the other arguments.

    Of eight samples, three are stored, one belongs to another job, and four
    fail.

    >>> from types import SimpleNamespace as Named
    >>> import stiction as st
    >>> from stiction.base.errors import collect_warnings
    >>> from stiction.base.variables import Variable
    >>> from stiction.ensemble.batches import Table
    >>> def results(first, count):
    ...     raise ArithmeticError("no root")
    >>> point = Named(
    ...     problem=Named(interface=st.Interface(0.1, 8)),
    ...     method=Named(label="criterion"),
    ...     random=0,
    ...     variables={"critical_stress": Variable("Pa", "stress")},
    ...     seed=9,
    ...     batch=300,
    ...     sample_bytes=8.0,
    ...     seconds=1.0,
    ...     results=results,
    ...     batches=lambda *span: [span],
    ...     prepare=lambda: None,
    ...     check_fields=lambda: None,
    ... )
    >>> columns = {"_point": np.zeros(3, int), "_sample": np.array([0, 3, 4])}
    >>> columns["critical_stress"] = np.array([5.0, 7.0, 6.0])
    >>> notes = []
    >>> store = Named(
    ...     resume=lambda rows: rows.add(Table(columns, (), 0.0, "")),
    ...     pilot={"pilot_bias": 0.5},
    ...     add=lambda table: None,
    ...     save=lambda: notes.append("saved"),
    ... )
    >>> elsewhere = np.arange(8) == 6
    >>> with collect_warnings() as texts:
    ...     found = gather(
    ...         [point], 8, {"seed": 9}, store=store, elsewhere=elsewhere, progress=False
    ...     )
    >>> found.critical_stress.values.tolist()
    [5.0, nan, nan, 7.0, 6.0, nan, nan, nan]
    >>> found.attrs["pilot_bias"], found.attrs["cut_short"], notes
    (0.5, '3 of 8 samples are done', ['saved'])
    >>> [str(text).partition("NaN")[0] for text in texts]
    ['4 of 8 samples could not be solved and are ']
    >>> str(texts[0]).count("no root"), str(texts[0])[-12:]
    (3, '| and 1 more')
    """
    rows, cores = Gathered(points, samples), workers or usable_cores()
    # Samples that are stored, or that another job computes, are not missing.
    if store:
        store.resume(rows)
    missing = ~(elsewhere | rows.done)
    if missing.any():
        check_run(points)
        if executor is None:
            _warn_if_long(points, missing, cores)
    complete(rows, missing, store=store, executor=executor, workers=cores, progress=progress)
    # A stored run is compared once, by the
    # first process that finishes its part.
    comparison = store.pilot if store else None
    if comparison is None and pilot:
        show = progress is True
        comparison = compare(points, rows.onsets, show, workers)
        where = " at the worst point of the sweep" if len(points) > 1 else ""
        if text := pilot_doubt(points[0], comparison, where):
            warn_accuracy(text)
        if store:
            store.note_pilot(comparison)
    result = rows.dataset({**attributes, **(comparison or {})}, axes)
    if failed := rows.failed:
        some = " | ".join(str(failure) for failure in failed[:MAX_SHOWN_FAILURES])
        if (hidden := len(failed) - MAX_SHOWN_FAILURES) > 0:
            some += f" | and {hidden} more"
        warn_accuracy(
            f"{len(failed)} of {rows.done.size} samples could not be solved and are NaN (the"
            f" attribute 'failed_samples' lists them): {some}"
        )
    return result


@checked
def monte_carlo(
    problem: Problem,
    random: AnyRandom,
    *,
    method: MethodObject,
    samples: Samples,
    seed: Number = 0,
    keep: Names = (),
    workers: Count | None = None,
    executor: Executor | None = None,
    progress: Progress = True,
    pilot: Flag = True,
) -> xr.Dataset:
    """Compute the onset of many random interfaces.

    Sample i depends only on (seed, i), not on the number of samples,
    the workers or the executor.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface, RandomField or list of them
        The random properties. A field alone is the peak strength, Pa.
        The members of a list are equally likely, and every sample uses
        one of them.
    method : LocalCriterion, Equilibrium or Rupture
    samples, seed : int
        Number of samples, and seed. `RandomField.sample` and
        `RandomInterface.profiles` draw sample i alone: ``first=i``.
    keep : str or tuple of str
        Random fields whose profiles are kept, such as ``"strength"``.
        Other profiles are kept by options of the method, such as
        ``slip=True`` in `Equilibrium`. To see the profiles of a few
        samples, repeat them: a call with the same seed and fewer
        samples gives the same samples.
    workers : int, optional
        Number of threads, by default one for each core. The compiled
        kernels release the interpreter lock.
    executor : concurrent.futures.Executor, optional
        Any object with a method `submit`, such as a process pool or a
        Dask executor, which replaces the threads.
    progress : bool or callable
        True shows progress on standard error after a second. A callable
        receives (done, total).
    pilot : bool
        Whether to check an approximate method with the first samples
        (32 on a line, 8 on a plane) and the weakest of the first
        thousand. If a quick test leaves a doubt, `Equilibrium` also
        solves these samples, and the difference is reported. The
        ensemble does not change.

    Returns
    -------
    xarray.Dataset
        Results of `onset` over 'sample'. The attributes contain the
        version, the study as JSON and the seed, so that the ensemble
        can be computed again. Samples that could not be solved are NaN.
        The attribute 'failed_samples' lists them (point, sample, seed,
        message, whether the sample does not fit the problem). If the
        pilot solved samples with `Equilibrium`, 'pilot_bias' and
        'pilot_scatter' are the mean and the standard deviation of the
        difference in `critical_stress`, relative to the mean from
        `Equilibrium`. For the weakest samples, these values are
        'pilot_weakest_bias' and 'pilot_weakest_scatter'.

    Raises
    ------
    InputError
        If any argument is invalid (the message lists every problem), or
        no sample is valid.
    RunError
        If the solver fails on all samples. The message names a sample
        with its seed.

    Warns
    -----
    AccuracyWarning
        If samples could not be solved, or the pilot differs from the
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
    experiment = Experiment(problem, random, method, keep, seed)
    about = study_attributes(
        problem=problem, random=experiment.given, method=experiment.method,
        samples=samples, seed=seed, keep=keep,
    )  # fmt: skip
    return gather(
        [experiment], samples, about | {"seed": seed}, workers=workers, executor=executor,
        progress=progress, pilot=pilot,
    )  # fmt: skip
