"""Two levels: an inexpensive limit state leads into the tail, and the exact limit state follows.

Problem. Estimate P(E < s) for an exact stress E, which is expensive,
with the help of a guide, whose stress L is inexpensive. By the
definition of conditional probabilities, for any ceiling b,

    P(E < s) = P(L < b) P(E < s | L < b) / P(L < b | E < s).

If L follows E closely, the last factor is near
one and the middle factor is not small. Then a
few hundred exact evaluations replace thousands.

Source. Subset simulation with less expensive models on
its first levels is due to Ullmann and Papaioannou (2015),
Multilevel estimation of rare events. The choice of b and
the walks that measure the last factor are our own.

Steps:

1. Walk down by the guide alone (`subset.descend`), with `GUIDING` times
   as many samples per level. Each level is a candidate for L < b, and
   its probability P(L < b) is known.
2. Begin with the rarest level, and solve some of its samples exactly.
   The fraction with E < s is the middle factor. If a probability is
   requested, s is the quantile of E that gives this probability.
3. Start from failures among these samples, walk among the failures E <
   s (`subset.grow`), and discard the first `FORGOTTEN_STEPS` steps. The
   fraction of the later states with L < b is the last factor. `_covered`
   estimates its error, with one observation for each family of walkers.
4. Take this level if the last factor is at least `LAST_FACTOR`.
   Otherwise repeat from step 2 at the next, less rare level, until
   evaluations or levels with draws are used up.

Failures that L misses, and that no short walk reaches,
are never found. Therefore `stiction.reliability.tail`
first compares how L and E rank samples.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.reliability.subset import Descent, Function, Label, Population, descend, grow

GUIDING = 5
"""Samples of the guide per level for each exact sample of the middle factor."""
LAST_FACTOR = 0.95
"""Smallest last factor. Below it the walk must first find failures that
the guide misses."""
WALK_STEPS = 10
FORGOTTEN_STEPS = 5
"""Exact steps of each walk in the failure set, and number of discarded
steps."""
LEVEL_RATIO = 2.5
"""Least ratio of the probability of the guide's level to the requested
probability."""


def _covered(
    states: Array, guide: Function, ceiling: float, families: NDArray[np.int64], samples: int
) -> tuple[float, float]:
    """Return P(L < b | E < s) from walkers in the failure set, and its relative variance.

    Three walkers take two steps. Three of six states are covered by the
    level. The first two walkers are one family, so that the weights are
    w = 2/3 and 1/3, and the families are off by 1/3 and -1/3 of the mean.
    The variance 2/9 * 5/9 is divided by 0.197531, the sum of
    w^2 (1 - 2 w + 5/9).

    >>> states = np.array([[1.0], [1.0], [4.0], [2.0], [3.0], [4.0]])
    >>> last, variance = _covered(states, lambda z: z[:, 0], 3.0, np.array([7, 7, 2]), 8)
    >>> last, round(variance, 6)
    (0.5, 0.625)

    A single family tells nothing about the error, unless all states are
    covered. At least one of the samples counts.

    >>> _covered(states, lambda z: z[:, 0], 3.0, np.array([7, 7, 7]), 8)
    (0.5, inf)
    >>> _covered(states, lambda z: z[:, 0], 9.0, np.array([7, 7, 7]), 8)
    (1.0, 0.0)
    >>> _covered(states, lambda z: z[:, 0], 1.0, np.array([7, 7, 2]), 8)[0]
    0.125
    """
    walkers = families.size
    covered = (guide(states) < ceiling).reshape(-1, walkers)
    last = max(float(covered.mean()), 1.0 / samples)
    # Walkers of one ancestor are alike, so each family is one observation.
    _, group = np.unique(families, return_inverse=True)
    sums = np.bincount(group, weights=covered.mean(axis=0) - last) / (walkers * last)
    # A family of weight w pulls the mean: its square is (1 - 2 w + sum
    # w^2) of that about the truth.
    shares = np.bincount(group) / walkers
    squares = shares * shares
    kept = float(squares @ (1.0 - 2.0 * shares + squares.sum()))
    variance = float(sums @ sums * squares.sum())
    if kept > 1e-12:
        return last, variance / kept
    return last, math.inf if last < 1.0 else 0.0  # a single family


def bridge(
    guide: Function,
    exact: Function,
    dimension: int,
    *,
    samples: int,
    rng: np.random.Generator,
    max_evaluations: int,
    threshold: float = -math.inf,
    probability: float = 0.0,
    floor: float = -math.inf,
    label: Label = lambda draws: np.zeros(len(draws), np.int64),
) -> Descent:
    """Sample the exact lower tail near a threshold, or near a probability.

    `samples` is the number of exact evaluations for the middle factor.
    The walk among failures takes the same number again, and
    `max_evaluations` limits their sum. Without a failure the estimate
    is zero, because omitting this repetition would favour repetitions
    with a failure.

    The guide is x, and the exact function is x + 0.1 y, so that the probability
    of a value below -3 is Phi(-3/sqrt(1.01)) = 0.00142. The first levels of
    the guide have 5 * 100 samples.

    >>> from stiction.reliability.subset import generator
    >>> def exact(draws):
    ...     return draws[:, 0] + 0.1 * draws[:, 1]
    >>> def found(limit, function=exact, **goal):
    ...     rng = generator(0, 5)
    ...     return bridge(lambda draws: draws[:, 0], function, 2, samples=100, rng=rng,
    ...         max_evaluations=limit, **goal)
    >>> descent, without = found(900, threshold=-3.0), found(109, threshold=-3.0)
    >>> 0.5 < descent.probability(-3.0) / 0.00142 < 2.0, descent.complete
    (True, True)
    >>> [len(values) for values in (descent.populations[0].values, descent.walked[0].T)]
    [100, 2]

    Each failing sample walks 10 steps, of which the last 5 count for the
    guide. All end at failures.

    >>> walkers = int(np.sum(descent.populations[0].values < -3.0))
    >>> descent.evaluations == 100 + 10 * walkers, len(descent.walked[1]) == walkers
    (True, True)
    >>> descent.first_stage_evaluations == without.first_stage_evaluations + 5 * walkers
    True
    >>> np.array_equal(exact(descent.walked[0]), descent.walked[1])
    True
    >>> bool((descent.walked[1] < -3.0).all())
    True
    >>> found(150, threshold=-3.0).evaluations  # room for 5 walkers
    150

    At a requested probability, the limit is the quantile -2.577 of the exact function:

    >>> descent = found(900, probability=0.005)
    >>> round(descent.probability(descent.threshold), 4), abs(descent.threshold + 2.589) < 0.2
    (0.005, True)

    Without room for a walk there is no exact sample. If no exact
    sample fails, the probability is zero.

    >>> without.complete, without.evaluations, without.probability(-3.0)
    (False, 0, 0.0)
    >>> descent = found(900, lambda draws: np.ones(len(draws)), threshold=-3.0)
    >>> descent.complete, descent.probability(-3.0), descent.evaluations
    (True, 0.0, 100)

    A worse guide misses some failures at its rarest level, and P(x + y/2 < -3)
    is 0.00365.

    >>> descent = found(2000, lambda draws: draws[:, 0] + 0.5 * draws[:, 1], threshold=-3.0)
    >>> 0.5 < descent.probability(-3.0) / 0.00365 < 2.0, descent.last < 1.0
    (True, True)
    """
    # 1. levels of the guide
    descent = descend(
        guide, dimension, rng=rng, samples=GUIDING * samples, threshold=threshold,
        probability=LEVEL_RATIO * probability, floor=floor, label=label,
    )  # fmt: skip
    guided, spent, lowest = descent.evaluations, 0, descent.populations[-1]
    best: Descent | None = None
    for population in reversed(descent.populations):
        if not len(population.draws) or spent + samples + WALK_STEPS > max_evaluations:
            break
        # 2. exact values of a level
        looked = rng.permutation(population.values.size)[:samples]
        draws, families = population.draws[looked], population.ancestors[looked]
        values = exact(draws)
        spent += looked.size
        limit = threshold
        if probability:
            share = probability / math.exp(population.log_probability)
            limit = float(np.quantile(values, share)) if share < 1.0 else -math.inf
            if limit == floor:  # so many lie on it that the requested probability does, too
                limit = math.nextafter(floor, math.inf)
        failed = values < limit
        if not failed.any():
            if best is not None:
                break
            if probability:  # this level is rarer than the requested probability
                continue
        # 3. walks among failures
        last, last_variance = 1.0, 0.0
        walked = draws[failed], values[failed]
        if failed.any() and math.isfinite(population.ceiling):
            room = (max_evaluations - spent) // WALK_STEPS
            walkers = min(int(failed.sum()), max(16, samples // WALK_STEPS), room)
            seeds, seed_values = (part[:walkers] for part in walked)
            # The seeds themselves come first, and do not count.
            states, stresses, *_ = grow(
                exact, seeds, seed_values, limit, WALK_STEPS + 1, lowest.step, rng
            )
            spent += walkers * WALK_STEPS
            later = states[walkers * (1 + FORGOTTEN_STEPS) :]
            last, last_variance = _covered(
                later, guide, population.ceiling, families[failed][:walkers], samples
            )
            guided += later.shape[0]
            walked = states[-walkers:], stresses[-walkers:]
        exact_level = Population(
            math.inf, population.log_probability, values, families, population.members[looked]
        )
        best = Descent(
            samples, [exact_level], limit, spent, True, guided, last, last_variance, walked
        )
        # 4. the level is taken
        if last >= LAST_FACTOR:
            break
    if best is not None:  # a last look, in vain, counts as well
        return best._replace(evaluations=spent, first_stage_evaluations=guided)
    none, chance = np.zeros(0, np.int64), lowest.log_probability
    empty = Population(math.inf, chance, np.zeros(0), none, none)
    return Descent(samples, [empty], threshold, spent, False, guided)
