"""Steps of every call in this folder: budget, number of interfaces, checks and doubts."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from stiction.base.arrays import Array
from stiction.base.errors import (
    InputError,
    Warned,
    collect_warnings,
    merge_warnings,
    texts_of,
    warn_accuracy,
)
from stiction.base.model import Count, Real
from stiction.base.progress import Meter, Show
from stiction.base.units import in_words
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState
from stiction.ensemble.monte_carlo import check_fields
from stiction.methods.onset import exact_counterpart
from stiction.methods.protocol import optional_member, seconds_per_sample
from stiction.random.equally_likely import MAX_MEMBERS, drawn_from, specimens_of_fit
from stiction.reliability.answer import Answer
from stiction.reliability.tail import Tail, TailPoint

TargetCv: TypeAlias = Annotated[Real, Field(ge=1e-6, le=1)]
"""A smaller one would take more than 1e12 failures. A larger one is not
an estimate."""
Probability: TypeAlias = Annotated[Real, Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[Count, Field(ge=100)]

COUNTING_SECONDS, FEWEST_EVALUATIONS, MOST_EVALUATIONS = 100.0, 1_000, 2_000_000
"""Computing time of counting by a slow method, and fewest and most
evaluations by default."""
CHAIN_EVALUATIONS, PATIENCE_SECONDS = 20_000, 900.0
"""Evaluations of subset simulation for about P = 1e-4 with a cv of 0.1,
and longest time of evaluations on one core, s, unless `max_evaluations`
allows more."""
LIST_SHARE, SAMPLING_SHARE = 0.6, 0.8
"""Parts of the target for the errors by choice of interfaces and by sampling.

Squares add up.
"""
REQUEST_MARGIN, CARRIED_SHARE = 1.2, 0.9
"""Margin on the wanted number of members, and fraction of the mean that
a warning reports."""
FRESH = 1.5
"""Least ratio of different members that makes a longer list worthwhile."""
UNDETERMINED, ODDS = 1.5, 20.0
"""Ratio of the stresses by family from which tests do not determine a
rare failure, and odds that tell families apart."""
EXACT_CHECKS = (8, 64)
"""Fewest and most samples of an approximate method that are solved
exactly as a check."""
CHECK_SECONDS = 10.0
"""Seconds of one core for the check by exact solutions."""
F = TypeVar("F", "Answer", TailPoint)


def prepare(
    experiment: Experiment,
    workers: int | None,
    meter: Meter,
    max_evaluations: int | None,
    *,
    algorithm: str = "subset",
    per_pressure: bool = False,
    executor: Executor | None = None,
    spent: int = 0,
) -> tuple[LimitState, int]:
    """Return the limit state and the allowed number of evaluations, unless a method is too slow."""
    threads = workers or usable_cores()
    state = LimitState(experiment, per_pressure, threads, meter, executor)
    problems = []
    if algorithm in ("subset", "two_level") and (slow := too_slow(experiment, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and isinstance(reason := state.guide, str):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    # Warnings come after errors: nobody needs a warning about a call
    # that is refused.
    check_fields([experiment])
    return state, allowed(experiment, max_evaluations) - spent


def exact_law(state: LimitState) -> Any:
    """Return the distribution of the onset if no samples are needed, else None."""
    experiment, law = state.experiment, getattr(state.experiment.random.source, "law", None)
    return law(experiment.problem, experiment.method) if law else None


def exact_tail(state: LimitState) -> Tail:
    """Return an empty tail with the reason why no samples are needed."""
    experiment = state.experiment
    reason = "specimens differ only as a whole, so the answer is an average over families"
    if experiment.problem != getattr(experiment.random.source, "problem", None):
        reason += (
            ". The joint differs from the specimens: the strength of a specimen is carried over,"
            f" and {experiment.method.label} computes the onset of the joint"
        )
    return Tail((), "exact", reason)


def undetermined(state: LimitState, law: Any, probability: float) -> list[str]:
    """Return a doubt if the distributions between specimens lead to very different stresses.

    The doubt states the number of specimens for which the likelihoods
    of the two families differ by `ODDS` on average. It follows from the
    divergence of one family from the other.
    """
    stresses = {name: law.quantile(probability, name) for name in law.families}
    low, high = (pick(stresses, key=stresses.__getitem__) for pick in (min, max))
    if stresses[high] < UNDETERMINED * stresses[low]:
        return []
    area = state.experiment.problem.area
    unit, scale = ("N", area) if area else ("Pa", 1.0)
    ends = [in_words(unit, scale * stresses[name]) for name in (high, low)]
    needed = math.ceil(math.log(ODDS) / law.divergence(low, high))
    return [
        f"the tests do not determine P = {probability:g}: the {high} family leads to"
        f" {ends[0]} and the {low} family to {ends[1]}. About {needed} specimens"
        f" would tell these two apart, with odds of {ODDS:g} to 1. Without a family about"
        f" {3.0 / probability:.0e} specimens are needed"
    ]


def allowed(experiment: Experiment, max_evaluations: int | None) -> int:
    """Return the most evaluations in all rounds of a call."""
    seconds = COUNTING_SECONDS if too_slow(experiment, max_evaluations) else PATIENCE_SECONDS
    return max_evaluations or int(
        min(MOST_EVALUATIONS, max(FEWEST_EVALUATIONS, seconds / experiment.seconds))
    )


def too_slow(experiment: Experiment, max_evaluations: int | None) -> str | None:
    """Return a message if chains of samples take too long with this method, or None."""
    seconds, method = CHAIN_EVALUATIONS * experiment.seconds, experiment.method
    fast = seconds <= PATIENCE_SECONDS and not optional_member(method, "counted_only")
    if fast or (max_evaluations or 0) >= CHAIN_EVALUATIONS:
        return None
    return (
        f"{CHAIN_EVALUATIONS:,} evaluations of subset simulation by {method.type!r} take about"
        f" {seconds / 3600.0:.1g} h. Allow so many with max_evaluations, or pass algorithm='plain'"
    )


def sampling_target(state: LimitState, target_cv: float) -> float:
    """Return the target that is left for the sampling error."""
    return target_cv * (SAMPLING_SHARE if state.several else 1.0)


def wanted_members(random: Any, cv: float, target_cv: float) -> int:
    """Return the number of members to draw from a source, 0 if there are enough."""
    least = cv / (LIST_SHARE * target_cv)  # the error falls with the root of the number
    count = len(random.members)
    if random.source is None or least <= 1.0 or count >= MAX_MEMBERS:
        return 0
    return int(min(max(REQUEST_MARGIN * count * least * least, 2 * count), MAX_MEMBERS))


def answered(
    experiment: Experiment,
    target_cv: float,
    name: str,
    progress: Show,
    max_evaluations: int | None,
    solve: Callable[[Experiment, Meter, int], Answer],
) -> Answer:
    """Return an answer, and its warnings, from as many members as the target needs."""
    with Meter(name, show=progress) as meter, merge_warnings() as warned:
        warn_of_field(experiment)
        experiment, answer, spent = with_enough_members(
            experiment, target_cv, meter, warned, max_evaluations, solve
        )
        for text in few_members(experiment.random, answer, target_cv):
            warn_accuracy(text)
    source = experiment.random.source
    return replace(
        answer,
        evaluations=spent,
        warnings=tuple(texts_of(warned)),
        doubts=(*getattr(source, "doubts", ()), *getattr(source, "notes", ())),
        specimens=getattr(source, "specimens", 0),
    )


def warn_of_field(experiment: Experiment) -> None:
    """Warn about the field of a fit in place of a fit with scatter between specimens."""
    if specimens_of_fit(experiment.random):
        warn_accuracy(
            "random: is the field of a fit, without the scatter between specimens. Pass the fit"
        )


def with_enough_members(
    experiment: Experiment,
    target_cv: float,
    meter: Meter,
    warned: list[Warned],
    max_evaluations: int | None,
    solve: Callable[[Experiment, Meter, int], F],
) -> tuple[Experiment, F, int]:
    """Return a solution with enough members for the error due to their choice, and all evaluations.

    A source draws more members until the error is small enough, or
    another round would need more evaluations than are left.
    """
    spent, budget = 0, allowed(experiment, max_evaluations)
    while True:
        solution, known = solve(experiment, meter, spent), experiment.random
        cost = solution.evaluations if isinstance(solution, Answer) else solution.tail.spent
        spent += cost
        count = wanted_members(known, solution.members_cv, target_cv)
        if not count or spent + cost > budget:
            return experiment, solution, spent
        meter.note = f"{count:,} interfaces, cv by their choice {solution.members_cv:.2g}"
        larger = drawn_from(known.source, count, experiment.seed)
        # A posterior over a list has hardly more different members,
        # however many are drawn.
        if larger.kinds.max() + 1 < FRESH * (known.kinds.max() + 1):
            return experiment, solution, spent
        experiment = replace(experiment, random=larger)
        warned.clear()  # the new solution warns again where it must


def few_members(random: Any, estimate: Answer | TailPoint, target_cv: float) -> list[str]:
    """Return a warning if the choice of interfaces leaves the estimate above `target_cv`."""
    by_list = estimate.members_cv
    if not (estimate.cv > target_cv and by_list > LIST_SHARE * target_cv):
        return []
    # Add up the probabilities of equal interfaces, the largest first.
    # None may be known.
    members = np.nan_to_num(estimate.members)
    shares = np.cumsum(np.sort(np.bincount(random.kinds, members))[::-1])
    count = 1 + int(np.searchsorted(shares, CARRIED_SHARE * shares[-1]))
    carried = f", and {count} of {shares.size} different ones carry {CARRIED_SHARE:.0%}"
    advice = "Pass the fit or posterior itself, which gives more interfaces, pass a longer list"
    if random.source is not None:
        advice = "Use more repetitions of the fit (bootstrap=)"
    return [
        f"the interfaces are a sample{f'{carried} of the mean' * bool(shares[-1])}. The"
        f" coefficient of variation is {estimate.cv:.2g} (target {target_cv:g}), of which this"
        f" choice makes {by_list:.2g}. {advice}, or measure more"
    ]


def imprecise(cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return a warning if the estimate is less precise than `target_cv`."""
    advice = "raise max_evaluations"
    if math.isfinite(cv):
        advice += f" to about {REQUEST_MARGIN * evaluations * (cv / target_cv) ** 2:.1g}"
    text = (
        f"the coefficient of variation by sampling is {cv:.3g} after {evaluations} evaluations, but"
        f" {target_cv:.3g} was wanted. To reach it, {advice}, or accept a larger target_cv"
    )
    return [text] if cv > target_cv else []


def different(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions of distinct values, in random order."""
    _, first = np.unique(values, return_index=True)  # chains repeat states
    return rng.permutation(first)[:count]


def exact_doubts(point: TailPoint) -> list[str]:
    """Solve some samples exactly if the method is approximate.

    Warn if more or fewer samples fail.

    The checked samples are low samples on both sides of the stress.
    Failures are counted, because in a tail a small change of stress may
    multiply the probability.
    """
    state, stress = point.state, point.stress
    experiment, (population, near) = state.experiment, point.tail.repetitions[-1].around(stress)
    exact = exact_counterpart(experiment.problem, experiment.method)
    if exact is None or not near.size:
        return []
    seconds = seconds_per_sample(experiment.problem, exact)
    # Different values, because samples of a chain repeat.
    count = int(np.clip(CHECK_SECONDS / seconds, *EXACT_CHECKS))
    chosen = near[different(population.values[near], count, np.random.default_rng(0))]
    state.meter.note = f"checking by {exact.label}"
    with collect_warnings():
        fails_exactly = state.by(exact)(population.draws[chosen]) < stress
    fails = population.values[chosen] < stress
    failed, failed_exactly = int(fails.sum()), int(fails_exactly.sum())
    # If both methods are right on average, the samples that change
    # sides go both ways, and the difference of the counts has the
    # square root of their number as standard deviation.
    differing = int(np.sum(fails != fails_exactly))
    if abs(failed_exactly - failed) <= 2.0 * math.sqrt(max(differing, 1)):
        return []
    there = min(point.probability * max(failed_exactly, 1) / max(failed, 1), 1.0)
    return [
        f"of {chosen.size} samples in the tail {failed} fail by the {experiment.method.label} and"
        f" {failed_exactly} by {exact.label}. The probability by st.{type(exact).__name__}() is"
        f" {'about' if failed_exactly else 'below'} {there:.2g}, not {point.probability:.2g}."
        " Use the exact method"
    ]
