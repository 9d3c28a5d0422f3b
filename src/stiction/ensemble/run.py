"""Running an ensemble: chunks through any executor, the same numbers whoever computes them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from typing import Any

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from stiction._model import describe, to_plain
from stiction._progress import progress_bar
from stiction.ensemble.plan import STREAMS, Plan, chunks, compute
from stiction.errors import InputError
from stiction.fields.random_field import RandomField, warn_if_inaccurate
from stiction.methods import Method, Values, check_method, label
from stiction.problem import Problem
from stiction.results import Variable

CHUNK = 256


def chunk_size(method: Any) -> int:
    """Samples in a chunk: a few tens of milliseconds of work, where the method says so."""
    return int(getattr(method, "chunk_size", CHUNK))


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def results(
    plan: Plan,
    pieces: Iterable[tuple[int, int]],
    *,
    executor: Executor | None = None,
    workers: int = 1,
) -> Iterator[tuple[int, Values]]:
    """Compute pieces (first, samples) and yield (first, values) as they are done.

    No more than two pieces a worker are under way at once, so that memory stays bounded whatever
    the number of samples. Leaving the iteration early cancels what has not begun.
    """
    with ExitStack() as stack:
        # The kernels are the parallel part; threads of BLAS below them only get in the way.
        stack.enter_context(threadpool_limits(limits=1, user_api="blas"))
        if executor is None and workers == 1:
            for first, samples in pieces:
                yield first, compute(plan, first, samples)
            return
        if executor is None:
            executor = stack.enter_context(ThreadPoolExecutor(workers))
        limit = 2 * max(workers, int(getattr(executor, "_max_workers", 0) or workers))
        waiting = iter(pieces)
        running: dict[Future[Values], int] = {}
        try:
            while True:
                for first, samples in waiting:
                    running[executor.submit(compute, plan, first, samples)] = first
                    if len(running) >= limit:
                        break
                if not running:
                    return
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield running.pop(future), future.result()
        finally:
            for future in running:
                future.cancel()


def make_plan(
    problem: Problem,
    strength: RandomField,
    method: Method,
    seed: int,
    fields: Mapping[str, RandomField | None],
    keep: tuple[str, ...] = (),
) -> Plan:
    """The plan of these arguments, or one `InputError` with all that is wrong with them."""
    check_method(method)
    problems = []
    if not isinstance(problem, Problem):
        problems.append(f"problem: must be a Problem, got {describe(problem)}")
    for name, field in {"strength": strength, **fields}.items():
        if field is None and name != "strength":
            continue
        if not isinstance(field, RandomField):
            problems.append(f"{name}: must be a RandomField, got {describe(field)}")
        elif isinstance(problem, Problem):
            try:
                field.modes(problem.interface)
            except InputError as error:
                problems += [f"{name}: {text}" for text in error.problems]
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        problems.append(f"seed: must be a whole number >= 0, got {describe(seed)}")
    random = tuple((name, field) for name, field in fields.items() if field is not None)
    known = {"strength", *(name for name, _ in random)}
    problems += [
        f"keep: {name!r} is not random here (valid: {', '.join(sorted(known))})"
        for name in keep
        if name not in known
    ]
    if problems:
        raise InputError(problems)
    return Plan(problem, strength, method, int(seed), random, keep)


def _check_count(name: str, value: Any, smallest: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < smallest:
        raise InputError(f"{name}: must be a whole number >= {smallest}, got {describe(value)}")


KEPT: dict[str, Variable] = {
    "strength": Variable("Pa", "peak strength", ("sample", "x")),
    "residual_strength": Variable("Pa", "residual strength", ("sample", "x")),
    "initial_stress": Variable("Pa", "initial stress", ("sample", "x")),
    "weakening_rate": Variable("Pa m-1", "weakening rate", ("sample", "x")),
}


def plan_attributes(plan: Plan, samples: int, first: int = 0) -> dict[str, Any]:
    """All it takes to run the plan again, as a study in plain form."""
    ensemble = {"samples": samples, "seed": plan.seed, "first": first, "keep": list(plan.keep)}
    try:
        study: dict[str, Any] = {
            "problem": to_plain(plan.problem),
            "strength": to_plain(plan.strength),
            "method": to_plain(plan.method),
            "ensemble": ensemble,
        }
        study |= {name: to_plain(field) for name, field in plan.fields}
    except InputError as error:  # a function of the user's: the result says so and is still one
        return {"study_incomplete": str(error), "seed": plan.seed}
    return {"study": study, "seed": plan.seed}


def run_plan(
    plan: Plan,
    samples: int,
    *,
    first: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: bool | Callable[[int, int], None] = False,
) -> xr.Dataset:
    """Compute samples first .. first + samples - 1 of a plan; see `monte_carlo`."""
    _check_count("samples", samples, 1)
    _check_count("first", first, 0)
    if workers is not None:
        _check_count("workers", workers, 1)
    if executor is not None and not hasattr(executor, "submit"):
        raise InputError(
            f"executor: must be a concurrent.futures executor, got {describe(executor)}"
        )
    for _, field in (("strength", plan.strength), *plan.fields):
        warn_if_inaccurate(field, plan.problem.interface)
    workers = usable_cores() if workers is None else workers
    collected: dict[str, Any] = {}
    pieces = chunks(samples, chunk_size(plan.method), first)
    with progress_bar(samples, plan.method.type, progress) as report:
        for start, values in results(plan, pieces, executor=executor, workers=workers):
            count = 0
            for name, value in values.items():
                if name not in collected:
                    collected[name] = np.empty((samples, *value.shape[1:]), dtype=value.dtype)
                count = len(value)
                collected[name][start - first : start - first + count] = value
            report(count)
    attributes = plan_attributes(plan, samples, first)
    return label(plan.problem, plan.method, collected, first + np.arange(samples), attributes, KEPT)


def monte_carlo(
    problem: Problem,
    strength: RandomField,
    *,
    method: Method,
    samples: int,
    seed: int = 0,
    first: int = 0,
    residual_strength: RandomField | None = None,
    initial_stress: RandomField | None = None,
    weakening_rate: RandomField | None = None,
    keep: tuple[str, ...] = (),
    workers: int | None = None,
    executor: Executor | None = None,
    progress: bool | Callable[[int, int], None] = False,
) -> xr.Dataset:
    """Onset of many random interfaces.

    Sample i depends on (seed, i) only: not on the number of samples, the workers or the executor.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    samples : int
        Number of samples.
    seed : int
        Not negative.
    first : int
        Number of the first sample, to continue an ensemble.
    residual_strength, initial_stress, weakening_rate : RandomField, optional
        What is random besides the strength, Pa or Pa/m, independent of it.
    keep : tuple of str
        Random fields whose sampled profiles are kept, such as ``("strength",)``.
    workers : int, optional
        Threads; all cores by default. The compiled kernels release the interpreter lock.
    executor : concurrent.futures.Executor, optional
        Anything that has `submit`: processes, a Dask client's executor, ... instead of threads.
    progress : bool or callable
        True shows a bar on a terminal; a callable gets (done, total).

    Returns
    -------
    xarray.Dataset
        Over 'sample', as from `onset`. The attributes hold the version, the study as JSON and the
        seed: enough to run it again.

    Raises
    ------
    InputError
        Naming all that does not fit.
    """
    fields = {
        "residual_strength": residual_strength,
        "initial_stress": initial_stress,
        "weakening_rate": weakening_rate,
    }
    assert fields.keys() == STREAMS.keys()
    plan = make_plan(problem, strength, method, seed, fields, tuple(keep))
    return run_plan(
        plan, samples, first=first, workers=workers, executor=executor, progress=progress
    )
