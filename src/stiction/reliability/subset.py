"""Subset simulation: a rare event as a chain of less rare ones, sampled by preconditioned walks.

Works on any function of standard normal draws. Level after level keeps the lowest tenth of its
samples and grows them back to full number by Metropolis steps z' = sqrt(1 - b^2) z + b w, which
leave the normal distribution as it is and are rejected where they leave the level.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.model import check_memory
from stiction.reliability.uncertainty import ancestral_variance, chain_correlation

Integers = NDArray[np.int64]
Function = Callable[[Array], Array]

ACCEPTANCE = 0.37
"""Share of steps to accept; from 0.25 to 0.44 the efficiency is the same within a tenth."""
FIRST_STEP = 0.7
MOST_LEVELS = 40
KEEP = 3
"""How many of the last populations keep their draws."""
COPIES = KEEP + 2  # the states of the chains and their noise
ADVICE = "take fewer nodes, truncate the spectrum earlier, or use algorithm='plain'"


@dataclass(frozen=True)
class Level:
    """One level of a subset simulation.

    Attributes
    ----------
    threshold : float
        The next level holds the samples below it (the last level: the failures).
    probability : float
        Estimated share of this level that lies there.
    acceptance : float
        Share of Metropolis steps accepted; 1 at the first level, whose samples are independent.
    step : float
        b when the level was complete.
    correlation : float
        gamma of Au and Beck (2001).
    ancestors : int
        Distinct first-level ancestors among the samples that go on.
    """

    threshold: float
    probability: float
    acceptance: float
    step: float
    correlation: float
    ancestors: int


@dataclass(frozen=True, eq=False)
class Population:
    """Samples of one level: standard normal, given that the value is below `ceiling`.

    Attributes
    ----------
    ceiling : float
    log_probability : float
        Logarithm of the estimated probability of the level.
    values : (samples,) array
    ancestors : (samples,) int array
    chains : int
        Sample i belongs to chain i modulo this.
    draws : (about samples, dimension) array
        Empty for early levels.
    """

    ceiling: float
    log_probability: float
    values: Array
    ancestors: Integers
    chains: int
    draws: Array = field(repr=False)


@dataclass(frozen=True, eq=False)
class Descent:
    """A finished repetition: populations from all samples down to the rarest.

    Attributes
    ----------
    samples : int
        N, samples of the first level and, within a few, of each other.
    populations : tuple of Population
    levels : tuple of Level
    evaluations : int
        Calls of the function, counted by samples.
    complete : bool
        Whether it reached the threshold or the probability.
    """

    samples: int
    populations: tuple[Population, ...]
    levels: tuple[Level, ...]
    evaluations: int
    complete: bool

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest value seen."""
        return float(self.populations[-1].values.min()), float(self.populations[0].values.max())

    def light(self) -> Descent:
        """The same without draws, which take nearly all of the memory."""
        none = np.empty((0, 0))
        populations = tuple(replace(population, draws=none) for population in self.populations)
        return replace(self, populations=populations)

    def population(self, value: float) -> Population:
        """Return the rarest population that holds a value, with its draws if they are kept."""
        return self._below(value)[0]

    def _below(self, value: float) -> tuple[Population, NDArray[np.bool_]]:
        holder = self.populations[0]
        for population in self.populations[1:]:
            if population.ceiling < value:
                break
            holder = population
        return holder, holder.values < value

    def probability(self, value: float) -> float:
        """Estimate of P(function < value); zero where no sample went so low."""
        population, below = self._below(value)
        return math.exp(population.log_probability) * float(below.mean())

    def relative_variance(self, value: float) -> float:
        """Squared coefficient of variation of `probability(value)`, from ancestry."""
        population, below = self._below(value)
        return ancestral_variance(population.ancestors[below], self.samples)

    def ancestors(self, value: float) -> Integers:
        """First-level ancestors of the samples below a value."""
        population, below = self._below(value)
        return population.ancestors[below]


def _grow(
    function: Function,
    draws: Array,
    values: Array,
    ceiling: float,
    steps: int,
    step: float,
    rng: np.random.Generator,
) -> tuple[Array, Array, float, float]:
    """Chains of `steps` states from given seeds; states, values, acceptance, last step size.

    All chains move together, one call of the function a step; the step size follows the
    acceptance over all chains, ever more slowly.
    """
    chains, dimension = draws.shape
    states, found = np.empty((steps, chains, dimension)), np.empty((steps, chains))
    states[0], found[0] = draws, values
    accepted = 0.0
    for t in range(1, steps):
        noise = rng.standard_normal((chains, dimension))
        noise *= step
        candidate = math.sqrt(1.0 - step * step) * states[t - 1]
        candidate += noise
        outcome = function(candidate)
        taken = outcome < ceiling
        states[t] = np.where(taken[:, None], candidate, states[t - 1])
        found[t] = np.where(taken, outcome, found[t - 1])
        share = float(taken.mean())
        accepted += share
        step = min(1.0, step * math.exp((share - ACCEPTANCE) / math.sqrt(t)))
    acceptance = accepted / (steps - 1) if steps > 1 else 1.0
    return states.reshape(-1, dimension), found.ravel(), acceptance, step


def conditional_chains(
    function: Function,
    draws: Array,
    values: Array,
    ceiling: float,
    steps: int,
    step: float,
    rng: np.random.Generator,
) -> tuple[Array, Array, float, float]:
    """The same with the seeds left out: shape (steps * chains, ...), step after step."""
    chains = draws.shape[0]
    states, found, acceptance, step = _grow(function, draws, values, ceiling, steps + 1, step, rng)
    return states[chains:], found[chains:], acceptance, step


def descend(
    function: Function,
    dimension: int,
    *,
    rng: np.random.Generator,
    samples: int,
    threshold: float = -math.inf,
    probability: float = 0.0,
    floor: float = -math.inf,
    level_probability: float = 0.1,
    max_evaluations: int | None = None,
) -> Descent:
    """Subset simulation down to a threshold or a probability, whichever comes first.

    Parameters
    ----------
    function : callable
        From draws (k, dimension) to values (k,), whose low values are rare.
    dimension : int
    rng : numpy Generator
    samples : int
        N of each level; ``samples * level_probability`` chains walk side by side.
    threshold : float
        Failure is a value below it; levels stop there.
    probability : float
        Or stop when a level's lowest share reaches this probability.
    floor : float
        No value is below it. Where the lowest share of a level lies on it, it is complete:
        there is nothing further down.
    level_probability : float
        Share p_0 of samples that go on.
    max_evaluations : int, optional
        No level is begun that would exceed it.

    Returns
    -------
    Descent

    Notes
    -----
    Au and Beck (2001) with the conditional sampling of Papaioannou, Betz, Zwirglmaier and Straub
    (2015), a preconditioned Crank-Nicolson walk whose acceptance does not fall with the dimension.

    The threshold of a level is the lowest value that does *not* go on, and only samples strictly
    below it do: then the product of the shares is unbiased although the levels are chosen from
    the samples (Brehier, Gazeau, Goudenege, Lelievre and Rousset, 2016). With the highest value
    that goes on as the threshold, each level would add one part in N p_0 to the estimate. Where
    the lowest values are all equal, none is strictly below: the next higher value is the threshold.
    """
    count = max(2, round(samples * level_probability))
    samples = count * max(2, round(samples / count))
    check_memory("algorithm 'subset'", COPIES * 8.0 * samples * dimension, ADVICE)
    draws = rng.standard_normal((samples, dimension))
    values = function(draws)
    ancestors, chains = np.arange(samples), samples
    ceiling, log_probability = math.inf, 0.0
    step, acceptance, evaluations = FIRST_STEP, 1.0, samples
    populations: list[Population] = []
    levels: list[Level] = []
    complete = False
    while True:
        populations.append(Population(ceiling, log_probability, values, ancestors, chains, draws))
        if len(populations) > KEEP:
            old = populations[-KEEP - 1]
            populations[-KEEP - 1] = replace(old, draws=np.empty((0, dimension)))
        lowest = float(np.partition(values, count)[count])
        final, bottom = lowest < threshold, lowest <= floor
        if final:
            lowest = threshold
        elif bottom:
            lowest = float(np.nextafter(floor, math.inf))
        elif lowest == values.min() < values.max():
            lowest = float(values[values > lowest].min())
        # States repeat along chains: with ties at the threshold a few fewer go on.
        chosen = values < lowest
        share = float(chosen.mean())
        shaped = chosen.reshape(-1, chains)
        levels.append(
            Level(
                threshold=lowest,
                probability=share,
                acceptance=acceptance,
                step=step,
                correlation=chain_correlation(shaped) if len(levels) else 0.0,
                ancestors=int(np.unique(ancestors[chosen]).size),
            )
        )
        stuck = share == 0.0 or len(levels) >= MOST_LEVELS
        if share > 0.0:
            reached = log_probability + math.log(share)
            complete = final or bottom or reached <= math.log(max(probability, 1e-300))
        seeds = rng.permutation(np.flatnonzero(chosen))
        steps = max(2, round(samples / max(seeds.size, 1)))
        cost = seeds.size * (steps - 1)
        over = max_evaluations is not None and evaluations + cost > max_evaluations
        if complete or stuck or over:
            break
        log_probability += math.log(share)
        ceiling = lowest
        family = ancestors[seeds]
        draws, values, acceptance, step = _grow(
            function, draws[seeds], values[seeds], ceiling, steps, step, rng
        )
        ancestors, chains = np.tile(family, steps), seeds.size
        evaluations += cost
    return Descent(samples, tuple(populations), tuple(levels), evaluations, complete)
