"""Each algorithm's answer, from its runs to the result that is reported."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stiction.arrays import Array
from stiction.progress import TimeUp
from stiction.reliability.importance import Mixture, design_point
from stiction.reliability.limit_state import LimitState
from stiction.reliability.plain_monte_carlo import Count, count_failures, tally
from stiction.reliability.pooling import Tail, run_until_precise, weights
from stiction.reliability.request import Request, advice, cut_short, first_size, missed, short_of
from stiction.reliability.result import FailureProbability, distinct, profiles_of, say
from stiction.reliability.subset import MOST_LEVELS, Descent, descend
from stiction.reliability.two_level import Bridge, bridge
from stiction.reliability.uncertainty import (
    effective_size,
    generator,
    lognormal_interval,
)

SUBSET, SUBSET_MOST = 1_000, 5_000
"""Samples a level of the first run and of the largest."""
BRIDGE, BRIDGE_MOST = 200, 1_000
"""Exact samples of the first run over two levels and of the largest."""
IMPORTANCE, IMPORTANCE_MOST = 500, 1_000
SHOWN = 20
"""Failing profiles kept."""
FEWEST_FAMILIES = 5.0
FEWEST_WEIGHTS, LARGEST_SHARE = 10.0, 0.2
LEAST_SHARE = 0.02
"""Of the samples below the first stage's ceiling, those that fail: fewer, and it is no guide."""


def unknown(request: Request, reason: str, evaluations: int) -> FailureProbability:
    """The answer where the time was over before anything could be told."""
    text = f"nothing is known of the probability: {short_of(request.state, evaluations)}"
    return FailureProbability(
        probability=math.nan,
        coefficient_of_variation=math.inf,
        interval=(0.0, 1.0),
        evaluations=evaluations,
        stress=request.stress,
        lower_bound=request.state.bounds[0],
        algorithm="none",
        reason=reason,
        confidence=request.confidence,
        cut_short=True,
        warnings=say([text]),
    )


def by_counting(request: Request, reason: str) -> FailureProbability:
    """Plain Monte Carlo, with the samples after those that were looked at to choose it."""
    count, evaluations = count_failures(
        request.state,
        request.seed,
        request.stress,
        target_cv=request.target_cv,
        least=request.pilot,
        max_evaluations=request.budget,
        start=request.spent,
    )
    return counted(request, count, request.spent + evaluations, reason)


def counted(request: Request, count: Count, evaluations: int, reason: str) -> FailureProbability:
    """What a count says."""
    state, cv = request.state, count.coefficient_of_variation
    shown = [state.draws(request.seed, int(i), 1) for i in count.numbers[:SHOWN]]
    draws = np.concatenate(shown) if shown else np.empty((0, state.dimension))
    return FailureProbability(
        probability=count.probability,
        coefficient_of_variation=cv,
        interval=count.interval(request.confidence),
        evaluations=evaluations,
        stress=request.stress,
        lower_bound=state.bounds[0],
        algorithm="plain",
        reason=reason,
        confidence=request.confidence,
        failing_profiles=profiles_of(state, draws),
        diagnostics={"failures": count.failures, "samples": count.samples},
        cut_short=cut_short(request, cv),
        warnings=say(missed(request, cv, evaluations)),
    )


def subset_diagnostics(tail: Tail[Descent], stress: float) -> dict[str, float]:
    """How well the chains moved, and other estimates of the same error to compare with."""
    runs = tail.runs
    chain_based = sum(
        weight**2
        * sum(
            (1.0 - level.probability) / (level.probability * run.samples) * (1 + level.correlation)
            for level in run.levels
            if level.probability > 0.0  # a level of equal values, where a small run got stuck
        )
        for weight, run in zip(weights(runs), runs, strict=True)
    )
    variance = tail.coefficient_of_variation(stress) ** 2
    found = {
        "runs": len(runs),
        "samples_per_level": sum(run.samples for run in runs),
        "levels": max(len(run.levels) for run in runs),
        "lowest_acceptance": min(level.acceptance for run in runs for level in run.levels),
        "largest_chain_correlation": max(level.correlation for run in runs for level in run.levels),
        "chain_based_cv": math.sqrt(chain_based),
        "effective_families": 1.0 / variance if variance > 0.0 else math.inf,
    }
    if len(runs) > 3:
        values = np.array([run.probability(stress) for run in runs])
        share = np.array(weights(runs))
        spread = float(np.sum(share**2 * (values - tail.probability(stress)) ** 2))
        found["spread_of_runs_cv"] = math.sqrt(
            spread * len(runs) / (len(runs) - 1)
        ) / tail.probability(stress)
    return found


def subset_doubts(tail: Tail[Descent], diagnostics: dict[str, float]) -> list[str]:
    """Why not to trust subset runs."""
    texts = []
    if diagnostics["effective_families"] < FEWEST_FAMILIES:
        texts.append(
            f"the failing samples descend from {diagnostics['effective_families']:.1f} independent"
            " ones only: the coefficient of variation is itself uncertain; lower target_cv"
        )
    if diagnostics["lowest_acceptance"] < 0.1:
        texts.append(
            f"only {diagnostics['lowest_acceptance']:.0%} of the steps of a level were accepted:"
            " its chains hardly moved"
        )
    return texts


def by_subset(request: Request, reason: str) -> FailureProbability:
    """Subset simulation."""
    state, stress = request.state, request.stress

    def make(samples: int, number: int, left: int) -> Descent:
        rng = generator(request.seed, 1, number)
        return descend(
            state, state.dimension, rng=rng, samples=samples, threshold=stress, max_evaluations=left
        )

    def judge(runs: Sequence[Descent]) -> float:
        return Tail(runs).coefficient_of_variation(stress)

    runs = run_until_precise(
        make,
        judge,
        target_cv=request.target_cv,
        first=first_size(SUBSET, request.budget),
        largest=SUBSET_MOST,
        max_evaluations=request.budget,
        meter=state.meter,
    )
    tail = Tail(runs)
    probability, cv = tail.probability(stress), tail.coefficient_of_variation(stress)
    evaluations = request.spent + sum(run.evaluations for run in runs)
    diagnostics = subset_diagnostics(tail, stress)
    interval = lognormal_interval(probability, cv, request.confidence)
    if all(len(run.levels) == 1 for run in runs) and runs[0].complete:
        # So likely that there was nothing to go down to: the samples are independent.
        count = tally(np.concatenate([run.populations[0].values for run in runs]), stress)
        cv, interval = count.coefficient_of_variation, count.interval(request.confidence)
    doubts = missed(request, cv, evaluations)
    if not runs[0].complete:
        lowest = runs[0].levels[-1].threshold
        deep = len(runs[0].levels) >= MOST_LEVELS
        rest = f"it stops after {MOST_LEVELS} levels" if deep else advice(state)
        reached = tail.probability(np.nextafter(lowest, math.inf))
        error = tail.coefficient_of_variation(np.nextafter(lowest, math.inf))
        interval = (0.0, lognormal_interval(reached, error, request.confidence)[1])
        doubts = [
            f"after {runs[0].evaluations} evaluations subset simulation had come down to"
            f" {lowest:.7g} Pa (P = {reached:.2g}) and not to {stress:.7g} Pa: the probability is"
            f" below that of the last level, which is all that the interval says; {rest}"
        ]
    else:
        doubts += subset_doubts(tail, diagnostics)
    last = runs[-1].populations[-1]
    failed = np.flatnonzero(last.values < stress)
    chosen = failed[distinct(last.values[failed], SHOWN, generator(request.seed, 2))]
    return FailureProbability(
        probability=probability,
        coefficient_of_variation=cv,
        interval=interval,
        evaluations=evaluations,
        stress=stress,
        lower_bound=state.bounds[0],
        algorithm="subset",
        reason=reason,
        confidence=request.confidence,
        levels=runs[0].levels,
        failing_profiles=profiles_of(state, last.draws[chosen]),
        diagnostics=diagnostics,
        cut_short=cut_short(request, cv),
        warnings=say(doubts),
    )


def by_two_levels(request: Request, cheap: LimitState, reason: str) -> FailureProbability:
    """Subset simulation by the local criterion, with the exact limit state at its end."""
    state, stress = request.state, request.stress

    def make(samples: int, number: int, left: int) -> Bridge:
        rng = generator(request.seed, 3, number)
        return bridge(
            cheap,
            state,
            state.dimension,
            threshold=stress,
            samples=samples,
            rng=rng,
            max_evaluations=left,
        )

    def judge(runs: Sequence[Bridge]) -> float:
        return Tail(runs).coefficient_of_variation(stress)

    runs = run_until_precise(
        make,
        judge,
        target_cv=request.target_cv,
        first=first_size(BRIDGE, request.budget),
        largest=BRIDGE_MOST,
        max_evaluations=request.budget,
        meter=state.meter,
    )
    tail = Tail(runs)
    probability, cv = tail.probability(stress), tail.coefficient_of_variation(stress)
    evaluations = request.spent + sum(run.evaluations for run in runs)
    doubts = missed(request, cv, evaluations)
    interval = lognormal_interval(probability, cv, request.confidence)
    if probability == 0.0:
        descent = runs[0].descent
        reached = math.exp(descent.populations[-1].log_probability)
        interval = (0.0, reached)
        doubts = [
            "no failure was found by the exact limit state; the interval says only that it is"
            " rarer than the last level by the local criterion: " + short_of(state, evaluations)
        ]
    last = min(run.last for run in runs)
    failures = sum(int(np.sum(run.values < stress)) for run in runs)
    share = failures / max(1, sum(run.values.size for run in runs))
    if last < 0.8 and probability > 0.0:
        doubts.append(
            f"the local criterion misses {1.0 - last:.0%} of the failures: the estimate may be low;"
            " compare with algorithm='subset'"
        )
    if probability > 0.0 and share < LEAST_SHARE:
        doubts.append(
            f"only {share:.1%} of what fails by the local criterion fails by equilibrium: it is a"
            " poor guide here, and failures that it does not see would be missed; compare with"
            " algorithm='subset'"
        )
    largest = max(runs, key=lambda run: run.samples)
    diagnostics = {
        "runs": len(runs),
        "middle_factor": share,
        "last_factor": last,
        "ceiling": largest.ceiling,
        "walk_acceptance": min(run.acceptance for run in runs),
        "effective_families": 1.0 / cv**2 if cv > 0.0 else math.inf,
    }
    chosen = distinct(largest.failing_values, SHOWN, generator(request.seed, 2))
    return FailureProbability(
        probability=probability,
        coefficient_of_variation=cv,
        interval=interval,
        evaluations=evaluations,
        first_stage_evaluations=sum(run.first_stage_evaluations for run in runs),
        stress=stress,
        lower_bound=state.bounds[0],
        algorithm="two_level",
        reason=reason,
        confidence=request.confidence,
        levels=largest.descent.levels,
        failing_profiles=profiles_of(state, largest.failing[chosen]),
        diagnostics=diagnostics,
        cut_short=cut_short(request, cv),
        warnings=say(doubts),
    )


def by_importance(request: Request, reason: str) -> FailureProbability:
    """Importance sampling around the design point at a random place."""
    state, stress = request.state, request.stress
    field, problem = state.random.strength, state.problem
    # The problem is uniform: stress = tau_i + load p and load = average of (tau_p - tau_i)/p.
    point = design_point(problem, field, stress)
    if float(state(np.zeros((1, state.dimension)))[0]) <= stress:
        text = (
            "the median interface already fails at this stress: there is nothing to shift, and"
            " this is plain Monte Carlo"
        )
        counted = by_counting(request, reason)
        return replace(counted, warnings=(*counted.warnings, *say([text])))
    modes = field.modes(problem.interface)
    mixture = Mixture(point.draws, problem.interface.shape, modes.numbers[:, 1:], field.mean_mode)
    rng = generator(request.seed, 4)
    found: list[Array] = []
    kept: list[Array] = []
    count, wanted = 0, float(IMPORTANCE)
    while True:
        size = int(min(max(wanted - count, IMPORTANCE), IMPORTANCE_MOST, request.budget - count))
        draws = mixture.sample(size, rng)
        try:
            values = state(draws)
        except TimeUp as up:
            values, draws = up.values, draws[: up.values.size]
            if count + values.size == 0:
                raise
        size, failed = values.size, values < stress
        weight = np.where(failed, np.exp(mixture.log_weights(draws)), 0.0)
        found.append(weight)
        kept.append(draws[failed][:SHOWN])
        count += size
        sample = np.concatenate(found)
        probability = min(float(sample.mean()), 1.0)
        cv = float(sample.std()) / probability / math.sqrt(count) if probability > 0.0 else math.inf
        if cv <= request.target_cv or count >= request.budget or state.meter.over:
            break
        factor = min((cv / request.target_cv) ** 2, 4.0)
        wanted = 1.05 * count * factor
        state.meter.expect(min(count * (cv / request.target_cv) ** 2, request.budget) - count)
    total = float(sample.sum())
    share = float(sample.max()) / total if total > 0.0 else 1.0
    size_of = effective_size(sample)
    doubts = missed(request, cv, count)
    if cv > 0.0 and (size_of < FEWEST_WEIGHTS or share > LARGEST_SHARE):
        doubts.append(
            f"the weights are worth {size_of:.0f} equal ones only, and the largest is"
            f" {share:.0%} of the sum: the shift does not suit the failures; use 'subset'"
        )
    if not point.converged:
        doubts.append("the search for the most likely weak spot did not settle")
    draws = np.concatenate(kept)
    chances = np.exp(mixture.log_weights(draws)) if draws.size else np.zeros(0)
    # A few of the failures, each as likely as its weight: what a weak interface looks like.
    order = np.argsort(-np.log(rng.random(chances.size)) / np.maximum(chances, 1e-300))
    return FailureProbability(
        probability=probability,
        coefficient_of_variation=cv,
        interval=lognormal_interval(probability, cv, request.confidence),
        evaluations=count,
        stress=stress,
        lower_bound=state.bounds[0],
        algorithm="importance",
        reason=reason,
        confidence=request.confidence,
        failing_profiles=profiles_of(state, draws[order[:SHOWN]]),
        diagnostics={
            "reliability_index": point.index,
            "failing_share": float(np.mean(sample > 0.0)),
            "effective_sample_size": size_of,
            "largest_weight_share": share,
        },
        cut_short=cut_short(request, cv),
        warnings=say(doubts),
    )
