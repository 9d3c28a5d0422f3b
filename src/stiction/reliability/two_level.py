"""Two levels: a cheap limit state goes down the tail, the exact one is asked at the end only.

With L the cheap stress and E the exact one, for any ceiling b,

    P(E < s) = P(L < b) P(E < s | L < b) / P(L < b | E < s),

whatever L is. Where L follows E closely the last factor is near one and the middle one is not
small, so that a few hundred exact evaluations do what thousands would.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiction._typing import Array
from stiction.reliability.subset import (
    Descent,
    Function,
    Population,
    conditional_chains,
    descend,
)
from stiction.reliability.uncertainty import ancestral_variance

CHEAP = 5
"""Cheap samples a level for each exact one of the middle factor."""
COVERED = 0.8
"""Smallest last factor: below it the walk must first find what the cheap stress does not see."""
STEPS = 6
"""Exact steps of each walk in the failure set; the first third is forgotten."""


@dataclass(frozen=True, eq=False)
class Bridge:
    """One run over both levels.

    Attributes
    ----------
    samples : int
        Exact evaluations meant for the middle factor.
    probability : float
        Estimate of P(E < s).
    relative_variance : float
    evaluations : int
        Of the exact limit state.
    first_stage_evaluations : int
        Of the cheap one.
    ceiling : float
        b, Pa.
    middle, last : float
        P(E < s | L < b) and P(L < b | E < s).
    descent : Descent
        Of the cheap limit state.
    draws, values : arrays
        Failing samples, by the exact limit state.
    acceptance : float
        Share of steps accepted by the walks in the failure set.
    complete : bool
        Whether any failure was found.
    """

    samples: int
    probability: float
    relative_variance: float
    evaluations: int
    first_stage_evaluations: int
    ceiling: float
    middle: float
    last: float
    descent: Descent
    draws: Array
    values: Array
    acceptance: float
    complete: bool


def _few(population: Population, samples: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """A random part of a population, for the exact limit state to look at."""
    size = population.values.size
    return rng.permutation(size)[: min(samples, size)]


def bridge(
    cheap: Function,
    exact: Function,
    dimension: int,
    *,
    threshold: float,
    samples: int,
    rng: np.random.Generator,
    max_evaluations: int,
) -> Bridge:
    """Estimate P(exact < threshold) with a cheap limit state that resembles the exact one.

    Parameters
    ----------
    cheap, exact : callable
        From draws (k, dimension) to values (k,).
    dimension : int
    threshold : float
    samples : int
        Exact evaluations for the middle factor; as many again walk in the failure set.
    rng : numpy Generator
    max_evaluations : int
        Of the exact limit state.
    """
    just_below = float(np.nextafter(threshold, -math.inf))
    descent = descend(cheap, dimension, rng=rng, samples=CHEAP * samples, threshold=threshold)
    first_stage, spent = descent.evaluations, 0
    best: Bridge | None = None
    for population in reversed(descent.populations):
        if population.draws.shape[0] == 0 or spent + samples > max_evaluations:
            break
        looked = _few(population, samples, rng)
        draws, values = population.draws[looked], exact(population.draws[looked])
        spent += looked.size
        failed = values < threshold
        if not failed.any():
            continue
        middle = float(failed.mean())
        variance = ancestral_variance(population.ancestors[looked[failed]], looked.size)
        last, wobble, acceptance = 1.0, 0.0, 1.0
        kept_draws, kept = draws[failed], values[failed]
        if math.isfinite(population.ceiling):
            walkers = min(kept.size, max(8, samples // STEPS), (max_evaluations - spent) // STEPS)
            if walkers < 2:
                break
            states, found, acceptance, _ = conditional_chains(
                exact,
                kept_draws[:walkers],
                kept[:walkers],
                just_below,
                STEPS,
                descent.levels[-1].step,
                rng,
            )
            spent += states.shape[0]
            later = slice(walkers * (STEPS // 3), None)
            covered = (cheap(states[later]) <= population.ceiling).reshape(-1, walkers)
            first_stage += covered.size
            last = float(covered.mean())
            shares = covered.mean(axis=0)
            # Walkers of one ancestor are alike; take each family as one observation.
            families = population.ancestors[looked[failed]][:walkers]
            _, group = np.unique(families, return_inverse=True)
            sums = np.bincount(group, weights=shares - last)
            wobble = float(np.sum(sums * sums)) / walkers**2 / max(last, 1e-300) ** 2
            kept_draws, kept = states[-walkers:], found[-walkers:]
        probability = math.exp(population.log_probability) * middle / max(last, 1.0 / samples)
        best = Bridge(
            samples,
            probability,
            variance + wobble,
            spent,
            first_stage,
            population.ceiling,
            middle,
            last,
            descent,
            kept_draws,
            kept,
            acceptance,
            True,
        )
        if last >= COVERED:
            break
    if best is not None:
        return best
    empty = np.empty((0, dimension))
    return Bridge(
        samples,
        0.0,
        math.inf,
        spent,
        first_stage,
        -math.inf,
        0.0,
        0.0,
        descent,
        empty,
        np.empty(0),
        0.0,
        False,
    )
