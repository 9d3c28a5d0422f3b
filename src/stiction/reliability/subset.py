"""Subset simulation for any function of standard normal draws.

Problem. Estimate P(g(z) < y) for a function g of
many standard normal numbers z, where the probability
is so small that nearly no plain sample is below y.

Sources. The method follows Au and Beck (2001), Probabilistic
Engineering Mechanics 16, 263, with the conditional sampling of
Papaioannou, Betz, Zwirglmaier and Straub (2015). This is a
preconditioned Crank-Nicolson walk, whose acceptance does not fall with
the dimension. Chan and Lai (2013), Annals of Statistics 41, 2877, and
Lee and Whiteley (2018), Biometrika 105, 609, derive the variance of
chains from their genealogy.

Steps. A level is the set of z with g(z) below its ceiling.

1. Draw N samples and evaluate them. They form the first level, whose
   ceiling is infinite.
2. Keep the tenth of the N samples with the lowest values. The next
   ceiling is the lowest value that is not kept. If this value is below
   the requested threshold, take the threshold. If it is at the floor of
   g, take the number just above the floor.
3. The next level's probability is the probability of this level times the
   fraction of its samples strictly below the ceiling.
4. Stop if the threshold, the floor or the requested probability is
   reached. The walk is incomplete if it stops because no sample is
   kept, after `MOST_LEVELS` levels, or because the evaluations are used
   up.
5. Begin a chain at each kept sample, with about N states in total. A
   step moves z to z' = sqrt(1 - b^2) z + b w, with a standard normal w.
   This preserves the normal distribution. The chain stays at z if g(z')
   is not below the ceiling. After step t, b is multiplied by
   exp((fraction of accepted steps - `ACCEPTANCE`) / sqrt(t)), up to b =
   1. The states are the samples of the next level. Continue with step
   2.
6. P(g < y) is the probability of the rarest level whose ceiling is at
   least y, times the fraction of its samples below y. The error follows
   from their first ancestors (`ancestral_variance`).

Departures. Only samples strictly below the ceiling are kept. The
product of the fractions is then unbiased, although the levels are
chosen from the samples (Brehier, Gazeau, Goudenege, Lelievre and
Rousset, 2016). If the lowest values are all equal, the next higher
value is the ceiling. All chains move together, and the step size is
adapted to their acceptance at every step.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.model import check_memory

Function = Callable[[Array], Array]
Label = Callable[[Array], NDArray[np.int64]]

LEVEL_PROBABILITY = 0.1
"""Fraction of a level's samples that continue to the next."""
ACCEPTANCE = 0.37
"""Target fraction of accepted steps; from 0.25 to 0.44 efficiency
differs by 10 % at most."""
FIRST_STEP = 0.7
MOST_LEVELS = 40
KEPT_POPULATIONS = 3
"""Number of the last populations that keep their draws."""
NO_DRAWS = np.empty((0, 0))
STORED_COPIES = KEPT_POPULATIONS + 2  # the states of the chains and their noise
ADVICE = "Use fewer nodes, truncate the spectrum earlier, or use algorithm='plain'"


def ancestral_variance(ancestors: NDArray[np.int64], samples: int) -> float:
    """Return the squared cv of an estimate by subset simulation, from the ancestors of failures.

    Families that descend from different first samples evolve
    independently. There are N = `samples` first samples. The fractions w_i
    of the failures in each family therefore measure the error, v =
    sum (w_i - 1/N)^2. It is computed in three steps:

    1. Sum the squared fractions, and subtract 1/N.
    2. If all samples fail, v is zero. Use at least (2/N)^2, as if two
       more samples had not failed. This bounds the error as the
       binomial distribution does.
    3. With k families of equal size, v is 1/k, but the variance of a
       mean over k values needs 1/(k - 1). Therefore return v/(1 - v).

    Two families of equal size have v = 1/2 - 1/5, and a single family has
    1 - 1/5. If all four of 4 samples fail, v is (2/4)^2.

    >>> round(ancestral_variance(np.array([0, 2]), 5), 6)  # 0.3/0.7
    0.428571
    >>> round(ancestral_variance(np.array([3, 3, 3]), 5), 6)
    4.0
    >>> round(ancestral_variance(np.arange(4), 4), 6)
    0.333333
    >>> ancestral_variance(np.array([], int), 5), ancestral_variance(np.array([1]), 2)
    (inf, inf)
    """
    if ancestors.size == 0:
        return math.inf
    _, sizes = np.unique(ancestors, return_counts=True)
    shares = sizes / ancestors.size
    spread = max(float(np.sum(shares * shares)) - 1.0 / samples, (2.0 / samples) ** 2)
    return spread / (1.0 - spread) if spread < 1.0 else math.inf


def generator(seed: int, *key: int) -> np.random.Generator:
    """Return an independent generator for each key under one seed.

    The first number of the spawn key separates this generator from the
    streams of random fields.

    >>> first, again, second = generator(4, 1, 2), generator(4, 1, 2), generator(4, 2, 1)
    >>> number = first.random()
    >>> number == again.random(), number == second.random()
    (True, False)
    >>> sequence = np.random.SeedSequence(4, spawn_key=(7_000_000, 1, 2))
    >>> number == np.random.Generator(np.random.PCG64DXSM(sequence)).random()
    True
    """
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(7_000_000, *key))
    return np.random.Generator(np.random.PCG64DXSM(sequence))


class Population(NamedTuple):
    """Samples at one level: standard normal draws, given that the value is below `ceiling`."""

    ceiling: float
    log_probability: float  # of the level
    values: Array  # (samples,)
    ancestors: NDArray[np.int64]  # the sample of the first level that each descends from
    members: NDArray[np.int64]  # (samples,), number of the interface of each
    # (samples, dimension), or an object that draws them again. Empty for early levels.
    draws: Any = NO_DRAWS
    acceptance: float = 1.0  # fraction of Metropolis steps
    step: float = FIRST_STEP  # b at the end

    def light(self) -> Self:
        """Return the population without draws, which take nearly all memory."""
        return self._replace(draws=NO_DRAWS)


class Below(NamedTuple):
    """Samples below a value: the probability that each represents, their members and ancestors."""

    probability: float  # of each sample
    members: NDArray[np.int64]
    ancestors: NDArray[np.int64]
    drawn: NDArray[np.int64] | None = None  # members of all samples, if they are plain ones


class Descent(NamedTuple):
    """A finished repetition: populations, from all samples down to the rarest level.

    A repetition is complete if it reached the threshold or the
    requested probability. With two levels, it has one population: the
    samples to which the guide leads, with their exact values. `last`
    and `walked` describe walks among failures (see `two_level`).

    The second level has the probability 0.4. The guide leads to 80 % of the
    failures.

    >>> top = Population(
    ...     math.inf, 0.0, np.array([5.0, 1.0, 3.0, math.inf, 2.0]), np.arange(5),
    ...     np.array([0, 1, 0, 1, 1]), np.ones((5, 2)),
    ... )
    >>> rare = Population(
    ...     3.0, math.log(0.4), np.array([1.0, 2.0, 0.5, 0.5]), np.array([1, 4, 1, 1]),
    ...     np.array([1, 1, 0, 0]), np.zeros((4, 2)),
    ... )
    >>> descent = Descent(5, [top, rare], 0.75, 9, complete=True, last=0.8, last_variance=0.1)
    >>> descent.extent, descent.survived
    ((0.5, 5.0), 0.2)
    >>> Descent(1, [top._replace(values=np.array([math.inf]))], 0.75, 1, complete=False).extent
    (inf, -inf)

    The ceiling itself belongs to the second level:

    >>> [round(descent.probability(value), 6) for value in (3.5, 3.0, 1.0, 0.5)]
    [0.75, 0.5, 0.25, 0.0]
    >>> descent.below(3.0).members.size
    4
    >>> round(descent.relative_variance(1.5), 6), round(descent.relative_variance(2.5), 6)
    (4.1, 0.83913)
    >>> below = descent.below(1.5)
    >>> round(below.probability, 6), below.members.tolist(), below.ancestors.tolist()
    (0.125, [1, 0, 0], [1, 1, 1])
    >>> below.drawn is None
    True
    >>> below = descent.below(4.0)
    >>> round(below.probability, 6), below.members.tolist(), below.ancestors.tolist()
    (0.25, [1, 0, 1], [1, 2, 4])
    >>> below.drawn.tolist()
    [0, 1, 0, 1, 1]
    >>> descent.failing[1].tolist(), descent.failing[0].shape
    ([1.0, 2.0, 0.5, 0.5], (4, 2))
    >>> descent._replace(walked=(np.ones((1, 2)), np.array([0.6]))).failing[1].tolist()
    [0.6]
    >>> [len(level.draws) for level in descent.light().populations]
    [0, 0]
    """

    samples: int  # N, of the first level and, within a few, of each other
    populations: list[Population]
    threshold: float
    evaluations: int
    complete: bool
    first_stage_evaluations: int = 0
    last: float = 1.0  # fraction of the failures to which the guide leads
    last_variance: float = 0.0  # squared coefficient of variation of its estimate
    walked: tuple[Array, Array] | None = None  # draws and values of failures

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest finite value, or plus and minus infinity if no value is finite."""
        lowest, plain = self.populations[-1].values, self.populations[0].values
        low = float(lowest.min(initial=math.inf))
        return low, float(plain.max(where=plain < math.inf, initial=-math.inf))

    @property
    def survived(self) -> float:
        """Fraction of infinite values among plain samples."""
        return _share(np.isinf(self.populations[0].values))

    def light(self) -> Self:
        """Return the same repetition without draws."""
        return self._replace(populations=[level.light() for level in self.populations])

    def _holders(self, value: float) -> list[Population]:
        """Return the populations that contain a value. The rarest is last."""
        return [level for level in self.populations if level.ceiling >= value]

    def probability(self, value: float) -> float:
        """Return the estimate of P(function < value) (step 6), zero without a sample below."""
        rarest = self._holders(value)[-1]
        return math.exp(rarest.log_probability) * _share(rarest.values < value) / self.last

    def below(self, value: float) -> Below:
        """Return the samples below a value."""
        rarest = self._holders(value)[-1]
        probability = math.exp(rarest.log_probability) / max(rarest.values.size, 1) / self.last
        failed = rarest.values < value
        drawn = rarest.members if rarest.log_probability == 0.0 else None
        return Below(probability, rarest.members[failed], rarest.ancestors[failed], drawn)

    def relative_variance(self, value: float) -> float:
        """Return the squared cv of `probability(value)`, from ancestry."""
        rarest = self._holders(value)[-1]
        family = rarest.ancestors[rarest.values < value]
        return ancestral_variance(family, self.samples) + self.last_variance

    @property
    def failing(self) -> tuple[Any, Array]:
        """Draws and values of the last population, or of the failures that walks reached."""
        last = self.populations[-1]
        return self.walked or (last.draws, last.values)

    def around(self, value: float) -> tuple[Population, NDArray[np.int64]]:
        """Return a population, and its samples on both sides of a value, in correct proportions.

        The samples are the lowest of the population, twice as many as
        lie below the value. If more than half of a population lies
        below the value, a less rare population is used.

        Half of the second level is below 0.75, and three of four samples are
        below 1.5. The first level has one sample below 1.5.

        >>> none, draws = np.zeros(0, int), np.zeros((5, 1))
        >>> top = Population(math.inf, 0.0, np.array([5.0, 1.0, 3.0, 4.0, 2.0]), none, none, draws)
        >>> rare = Population(3.0, -1.0, np.array([1.0, 2.0, 0.5, 0.5]), none, none, draws[:4])
        >>> for value, first in (0.75, top), (1.5, top), (1.5, top.light()):
        ...     holder, numbers = Descent(5, [first, rare], 0.75, 9, complete=True).around(value)
        ...     print(holder.ceiling, numbers.tolist())
        3.0 [2, 3, 0, 1]
        inf [1, 4]
        3.0 [2, 3, 0, 1]
        """
        holders = self._holders(value)
        while True:
            holder = holders.pop()
            below = int(np.sum(holder.values < value))
            if 2 * below <= holder.values.size or not (holders and len(holders[-1].draws)):
                break
        order = np.argsort(holder.values, kind="stable")
        return holder, order[: min(2 * below, len(holder.draws))]


def _share(which: NDArray[np.bool_]) -> float:
    """Return the fraction of true values, or zero without values.

    >>> _share(np.array([True, False, False, False])), _share(np.zeros(0, bool))
    (0.25, 0.0)
    """
    return float(which.sum() / max(which.size, 1))


def grow(
    function: Function,
    draws: Array,
    values: Array,
    ceiling: float,
    steps: int,
    step: float,
    rng: np.random.Generator,
) -> tuple[Array, Array, float, float]:
    """Return states and values of chains (given states first), acceptance and last step size.

    All chains move together (step 5). The step size is adapted to their
    acceptance, with smaller and smaller changes.

    Here the noise is always 0.5. With b = 0.6 the first candidates are
    0.8 z + 0.3. The first chain moves, and the second one stays. b
    is then 0.6 exp(0.13/sqrt(1)), and at last this times exp(0.13/sqrt(2)).

    >>> from types import SimpleNamespace
    >>> rng = SimpleNamespace(standard_normal=lambda shape: np.full(shape, 0.5))
    >>> draws, values = np.array([[0.0], [2.0]]), np.array([0.0, 4.0])
    >>> given = (lambda draws: draws[:, 0] * 2.0), draws, values
    >>> states, values, acceptance, step = grow(*given, 2.0, 3, 0.6, rng)
    >>> states[:, 0].round(4).tolist(), values.round(4).tolist()
    ([0.0, 2.0, 0.3, 2.0, 0.5607, 2.0], [0.0, 4.0, 0.6, 4.0, 1.1214, 4.0])
    >>> acceptance, round(step / 0.6, 6) == round(math.exp(0.13 + 0.13 / math.sqrt(2.0)), 6)
    (0.5, True)

    At a ceiling of 1 the second step to 1.1214 is refused, and the first chain
    stays at 0.3.

    >>> states, values, _, _ = grow(*given, 1.0, 3, 0.6, rng)
    >>> states[4:, 0].round(4).tolist(), values[4:].round(4).tolist()
    ([0.3, 2.0], [0.6, 4.0])

    If all candidates are accepted, b grows up to 1. A value at the ceiling
    is not below it.

    >>> grow(*given, 9.0, 2, 0.95, rng)[2:]
    (1.0, 1.0)
    >>> grow(*given, 0.6, 2, 0.6, rng)[2]
    0.0
    """
    chains, dimension = draws.shape
    states, chain_values = np.empty((steps, chains, dimension)), np.empty((steps, chains))
    states[0], chain_values[0] = draws, values
    accepted = 0.0
    for t in range(1, steps):
        noise = rng.standard_normal((chains, dimension))
        noise *= step
        candidate = math.sqrt(1.0 - step * step) * states[t - 1]
        candidate += noise
        outcome = function(candidate)
        taken = outcome < ceiling
        states[t] = np.where(taken[:, None], candidate, states[t - 1])
        chain_values[t] = np.where(taken, outcome, chain_values[t - 1])
        share = float(taken.mean())
        accepted += share
        step = min(1.0, step * math.exp((share - ACCEPTANCE) / math.sqrt(t)))
    return states.reshape(-1, dimension), chain_values.ravel(), accepted / (steps - 1), step


def descend(
    function: Function,
    dimension: int,
    *,
    rng: np.random.Generator,
    samples: int,
    threshold: float = -math.inf,
    probability: float = 0.0,
    floor: float = -math.inf,
    max_evaluations: float = math.inf,
    label: Label = lambda draws: np.zeros(len(draws), np.int64),
) -> Descent:
    """Walk down to a threshold or a probability, whichever comes first.

    `function` maps draws (k, dimension) to values (k,). Low values are
    rare, and no value is below `floor`. Each level has `samples`
    samples. A level begins only if it does not exceed
    `max_evaluations`. `label` returns, for each sample, the number of
    its equally likely interface.

    Here the draws are the regular numbers -1.9, -1.7, ... 1.9, and the
    lowest tenth lies below -1.5. The numbers of levels and evaluations
    show how the walk ends: at a threshold, at a floor and at a
    probability.

    >>> from types import SimpleNamespace
    >>> rng = SimpleNamespace(permutation=lambda numbers: numbers)
    >>> rng.standard_normal = lambda shape: np.linspace(-1.9, 1.9, shape[0])[:, None]
    >>> def end(function, **goal):
    ...     found = descend(function, 1, rng=rng, samples=20, **goal)
    ...     levels, stress = len(found.populations), round(found.threshold, 6)
    ...     return levels, stress, found.evaluations, found.complete
    >>> end(lambda draws: draws[:, 0], threshold=-1.0)
    (1, -1.0, 20, True)
    >>> end(lambda draws: draws[:, 0].clip(-1.5), floor=-1.5)
    (1, -1.5, 20, True)
    >>> end(lambda draws: draws[:, 0], probability=0.1)
    (1, -1.5, 20, True)

    The second level costs 18 evaluations. Equal values end the walk. If
    the lowest values are equal, the ceiling is the next higher value.

    >>> end(lambda draws: draws[:, 0], threshold=-1.6, max_evaluations=37)
    (1, -1.5, 20, False)
    >>> end(lambda draws: draws[:, 0], threshold=-1.6, max_evaluations=38)
    (2, -1.6, 38, True)
    >>> lowest = float(np.linspace(-1.9, 1.9, 20)[2])  # a threshold at the next ceiling
    >>> end(lambda draws: draws[:, 0], threshold=lowest, max_evaluations=37)[3]
    False
    >>> end(lambda draws: np.full(len(draws), 3.0))
    (1, 3.0, 20, False)
    >>> end(lambda draws: draws[:, 0].round(), probability=0.2)  # -2, -2, -2, -1, ...
    (1, -1.0, 20, True)

    Two chains of 10 states descend from samples 0 and 1. Only the last three
    levels keep their draws.

    >>> found = descend(lambda draws: draws[:, 0], 1, rng=rng, samples=20, threshold=-1.6)
    >>> found.populations[1].ancestors.tolist() == 10 * [0, 1]
    True
    >>> round(found.probability(-1.6), 6), round(found.populations[1].ceiling, 6)
    (0.1, -1.5)
    >>> found = descend(
    ...     lambda draws: draws[:, 0], 1, rng=generator(0), samples=100, probability=1e-5,
    ...     label=lambda draws: (draws[:, 0] < -2.0).astype(int),
    ... )
    >>> [len(level.draws) > 0 for level in found.populations[-5:]]
    [False, False, True, True, True]
    >>> first, last = found.populations[0], found.populations[-1]
    >>> set(last.ancestors.tolist()) <= set(np.argsort(first.values)[:10].tolist())
    True
    >>> 0.3 < math.exp(last.log_probability) / 1e-5 < 30.0
    True
    >>> [bool(np.all(level.members == (level.values < -2.0))) for level in (first, last)]
    [True, True]
    """
    count = max(2, round(samples * LEVEL_PROBABILITY))
    samples = count * max(2, round(samples / count))
    check_memory("algorithm 'subset'", STORED_COPIES * 8.0 * samples * dimension, ADVICE)
    # 1. plain samples
    draws = rng.standard_normal((samples, dimension))
    level = Population(math.inf, 0.0, function(draws), np.arange(samples), label(draws), draws)
    populations = [level]
    evaluations = samples
    while True:
        here = populations[-1]
        values = here.values
        if len(populations) > KEPT_POPULATIONS:
            populations[-KEPT_POPULATIONS - 1] = populations[-KEPT_POPULATIONS - 1].light()
        # 2. the next ceiling: the value after the lowest tenth
        lowest = float(np.partition(values, count)[count])
        final, bottom = lowest < threshold, lowest <= floor
        if final:
            lowest = threshold
        elif bottom:
            lowest = float(np.nextafter(floor, math.inf))
        elif lowest == values.min() < values.max():
            lowest = float(values[values > lowest].min())
        # 3. the probability of the next level. States repeat along
        # chains: with ties at the ceiling a few fewer go on.
        chosen = values < lowest
        share = float(chosen.mean())
        reached = here.log_probability + math.log(share) if share else -math.inf
        # 4. the end
        enough = reached <= math.log(max(probability, 1e-300))
        complete = share > 0.0 and (final or bottom or enough)
        seeds = rng.permutation(np.flatnonzero(chosen))
        steps = max(2, round(samples / max(seeds.size, 1)))
        cost = seeds.size * (steps - 1)
        stuck = share == 0.0 or len(populations) >= MOST_LEVELS
        if complete or stuck or evaluations + cost > max_evaluations:
            return Descent(samples, populations, lowest, evaluations, complete)
        # 5. back to full number
        states, values, acceptance, step = grow(
            function, here.draws[seeds], values[seeds], lowest, steps, here.step, rng
        )
        family, members = np.tile(here.ancestors[seeds], steps), label(states)
        level = Population(lowest, reached, values, family, members, states, acceptance, step)
        populations.append(level)
        evaluations += cost
