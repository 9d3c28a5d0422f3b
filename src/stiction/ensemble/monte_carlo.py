"""Running an ensemble in memory: the same numbers whoever computes them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._checks import (
    check_count,
    check_progress,
    is_real,
    is_whole,
    refusals,
    too_many_samples,
)
from stiction.ensemble.assemble import Gathered, GridAxis
from stiction.ensemble.plan import Plan
from stiction.ensemble.points import differing_in
from stiction.ensemble.scheduler import Span, share_out, usable_cores
from stiction.ensemble.work import raise_failure
from stiction.errors import (
    InputError,
    collect_warnings,
    unknown_name,
    warn_accuracy,
    warn_user,
)
from stiction.methods import Method, check_method
from stiction.model import describe, names_to_keep, to_plain, whole
from stiction.problem import Problem
from stiction.progress import Meter, Show, check_time_limit
from stiction.random.coefficients import in_stress, mean_in_stress
from stiction.random.overlap import check_residual
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, as_random_interface
from stiction.random.resolution import warn_if_inaccurate
from stiction.sample import PROFILES

KEEP_LIMIT = 2.0**30
FEW = 4


def make_plan(
    problem: Problem,
    random: Any,
    method: Method,
    seed: int,
    keep: tuple[str, ...] = (),
    keep_samples: tuple[int, ...] | None = None,
) -> Plan:
    """The plan of these arguments, or one `InputError` with all that is wrong with them."""
    check_method(method)
    problems: list[str] = []
    if not isinstance(problem, Problem):
        problems.append(f"problem: must be a Problem, got {describe(problem)}")
    interface = None
    try:
        interface = as_random_interface(random)
        if isinstance(problem, Problem):
            interface = in_stress(problem, interface)
    except InputError as error:
        problems += error.problems
    number = whole(seed)
    if number is None or number < 0:
        problems.append(f"seed: must be a whole number >= 0, got {describe(seed)}")
    if isinstance(problem, Problem):
        problems += refusals(problem, method)
    if isinstance(problem, Problem) and interface is not None:
        for name, field in interface.properties.items():
            try:
                field.modes(problem.interface)
            except InputError as error:
                problems += [f"{name}: {text}" for text in error.problems]
        method, mistakes = _keep_of_method(problem, method, keep, set(interface.names))
        problems += mistakes
    if problems or interface is None or number is None:
        raise InputError(problems)
    return Plan(problem, interface, method, number, keep, keep_samples)


def _keep_of_method(
    problem: Problem, method: Any, keep: tuple[str, ...], random: set[str]
) -> tuple[Any, list[str]]:
    """The method with the options switched on that `keep` names, and what cannot be kept."""
    switches = {
        field.name
        for field in dataclasses.fields(method)
        if isinstance(getattr(method, field.name), bool)
    }

    def wide(name: str) -> bool:
        wider = dataclasses.replace(method, **{name: True}) if name in switches else method
        found = wider.variables(problem)
        return name in found and found[name].wide

    problems = []
    for name in keep:
        known = name in random or name in method.variables(problem)
        if not known and name in switches and wide(name):
            method = dataclasses.replace(method, **{name: True})
        elif not known and name in PROFILES:
            valid = ", ".join(sorted(random))
            problems.append(f"keep: {name!r} is not random here (valid: {valid})")
        elif not known:
            names = {n for n in switches | set(method.variables(problem)) if wide(n)}
            problems.append(unknown_name("keep", name, sorted(random | names)))
    return method, problems


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


def check_run(
    samples: Any, first: Any, workers: Any, executor: Any, time_limit: Any = None
) -> tuple[int, int, int | None]:
    """Samples, first and workers as ints; refuses what makes no sense, before any work is done."""
    samples, first = check_count("samples", samples, 1), check_count("first", first, 0)
    problems = too_many_samples(samples, first)
    if problems:
        raise InputError(problems)
    if workers is not None:
        workers = check_count("workers", workers, 1)
    if executor is not None and not hasattr(executor, "submit"):
        raise InputError(
            f"executor: must be a concurrent.futures executor, got {describe(executor)}"
        )
    problems = check_time_limit(time_limit)
    if problems:
        raise InputError(problems)
    return samples, first, workers


def wide_bytes(plan: Plan, samples: int, first: int = 0) -> float:
    """Bytes of what is kept along the interface."""
    kept = samples
    if plan.keep_samples is not None:
        kept = sum(first <= sample < first + samples for sample in plan.keep_samples)
    return 8.0 * plan.problem.interface.size * len(plan.wide) * kept


def check_size(needed: float, limit: float) -> None:
    """Refuse to keep more than the stated size."""
    if needed > limit:
        raise InputError(
            f"keep: what is kept along the interface takes {needed / 2**20:,.0f} MiB, more than"
            f" keep_limit = {limit / 2**20:,.0f} MiB; keep fewer variables, choose samples with"
            " keep_samples, or raise keep_limit (bytes)"
        )


def warn_of_fields(plans: Sequence[Plan]) -> None:
    """Warn of fields that do not go with the grid, the interface or their units, once each."""
    pairs = list(
        dict.fromkeys(
            (field, plan.problem.interface)
            for plan in differing_in(plans, "random", "problem.interface")
            for field in plan.random.properties.values()
        )
    )
    meter = Meter("checking the fields", len(pairs) + len(plans), unit="fields")
    with collect_warnings() as caught, meter:
        for field, interface in pairs:
            warn_if_inaccurate(field, interface)
            meter.advance()
        for plan in plans:
            problem, fields = plan.problem, plan.random.properties
            problem.warn_of_units(mean_in_stress(problem, fields, "strength"))
            check_residual(problem, fields)
            meter.advance()
    found_warnings = list(dict.fromkeys(caught))
    for text, category in found_warnings[:FEW]:
        warn_user(text, category)
    if len(found_warnings) > FEW:
        more = f"{len(found_warnings) - FEW} more warnings like these, at other points of the sweep"
        warn_accuracy(more)


def plan_attributes(plan: Plan, samples: int, first: int = 0) -> dict[str, Any]:
    """All it takes to run the plan again, as a study in plain form."""
    ensemble: dict[str, Any] = {"samples": samples, "seed": plan.seed, "first": first}
    ensemble["keep"] = list(plan.keep)
    if plan.keep_samples is not None:
        ensemble["keep_samples"] = list(plan.keep_samples)
    try:
        study: dict[str, Any] = {
            "problem": to_plain(plan.problem),
            "random": to_plain(plan.random),
            "method": to_plain(plan.method),
            "ensemble": ensemble,
        }
    except InputError as error:  # a function of the user's: the result says so and is still one
        return {"study_incomplete": str(error), "seed": plan.seed}
    return {"study": study, "seed": plan.seed}


def run_plans(
    plans: Sequence[Plan],
    samples: int,
    *,
    first: int = 0,
    axes: Sequence[GridAxis] = (),
    attributes: Mapping[str, Any],
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    time_limit: float | None = None,
) -> xr.Dataset:
    """Compute samples first .. first + samples - 1 of every plan; see `monte_carlo`."""
    samples, first, workers = check_run(samples, first, workers, executor, time_limit)
    warn_of_fields(plans)
    workers = usable_cores() if workers is None else workers
    gathered = Gathered(plans, samples, first)
    total = len(plans) * samples
    done = np.zeros((len(plans), samples), dtype=np.bool_)
    with Meter(method_name(plans), total, progress, time_limit=time_limit) as meter:
        spans = [Span(point, first, samples) for point in range(len(plans))]
        with closing(share_out(plans, spans, executor=executor, workers=workers)) as work:
            for outcome in work:
                if outcome is not None:
                    if outcome.failures:
                        raise_failure(outcome.failures[0])
                    gathered.add(outcome)
                    done[outcome.point, outcome.samples - first] = True
                    meter.advance(outcome.count)
                if meter.over:
                    break
    result = gathered.dataset(attributes, axes)
    return result if done.all() else _cut_short(result, done)


def _cut_short(result: xr.Dataset, done: NDArray[np.bool_]) -> xr.Dataset:
    """What there is when the time was over: the first samples, up to one that no point has."""
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


def method_name(plans: Sequence[Plan]) -> str:
    """For the progress bar."""
    names = {plan.method.label for plan in differing_in(plans, "method")}
    return str(names.pop()) if len(names) == 1 else "samples"


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

    Returns
    -------
    xarray.Dataset
        Over 'sample', as from `onset`. The attributes hold the version, the study as JSON and the
        seed: enough to run it again.

    Raises
    ------
    InputError
        Naming all that does not fit; a sample that does not fit is named with its seed.
    RuntimeError
        Naming the sample and the seed, if a solver fails.
    TimeoutError
        If not one sample was done within `time_limit`.

    Warns
    -----
    AccuracyWarning
        If the time limit was reached.

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
    check_progress(progress)
    samples, first, workers = check_run(samples, first, workers, executor, time_limit)
    plan = make_plan(problem, random, method, seed, names, chosen)
    check_size(wide_bytes(plan, samples, first), keep_limit)
    return run_plans(
        [plan],
        samples,
        first=first,
        attributes=plan_attributes(plan, samples, first),
        workers=workers,
        executor=executor,
        progress=progress,
        time_limit=time_limit,
    )
