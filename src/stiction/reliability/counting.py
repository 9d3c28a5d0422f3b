"""Count failures among samples of the onset, or among many specimens for each solved field.

Problem. Estimate P(T < s) for the onset T from independent samples. The
coefficient of variation must not exceed a target. Specimens may have the
strength m b f(x). Here m is the mean, b the factor between specimens,
and f the field within a specimen. Only m and the distribution of b
differ between equally likely interfaces with the same field. If the
onset is proportional to the strength, T is m b R(f), and the solver is
needed only for R.

Sources. Haldane (1945), Biometrika 33, 222, introduced inverse binomial
sampling. Girshick, Mosteller and Savage (1946), Annals of Mathematical
Statistics 17, 13, added limits on the number of samples. The intervals
follow Clopper and Pearson (1934), Biometrika 26, 404. Many specimens for
each field are conditional Monte Carlo (Hammersley, 1956, Journal of the
ACM 3, 73; Asmussen and Glynn, Stochastic Simulation, 2007, section V.4).

Steps for samples (`count_failures`):

1. Fix the number r of failures from the target: the error is
   proportional to 1/sqrt(r - 1). A rule that stopped when the estimate
   looks precise would favour early failures.
2. Draw samples until there are r failures, within the limits on samples.
3. If the last failure ended the count, the unbiased estimate is (r -
   1)/(n - 1) for n samples up to this failure. Otherwise it is the
   fraction of failures.

Steps for specimens (`count_tail`):

4. Draw plain samples, as `stiction.monte_carlo` does, and solve them.
5. Divide each onset by the factor and the mean in its sample.
6. Multiply it by means of other interfaces with the same field, evenly
   spread over these interfaces, and by factors at stratified quantiles
   of their distributions. This gives `SPECIMENS_PER_SAMPLE` specimens
   for each solved sample.
7. Treat the specimens from one solved sample as a family. Compute the
   error from the fraction of each family among the failures
   (`subset.ancestral_variance`), as in subset simulation.
8. Solve more samples until the error is small enough.

Departures. Stratified sampling replaces the integral over b. If the
onset is not proportional to the strength, each sample has one specimen,
and the method reduces to plain counting.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtri

from stiction.base.arrays import Array
from stiction.ensemble.limit_state import LimitState, scales_with_strength
from stiction.random.mapping import from_normal
from stiction.reliability.subset import Descent, Population, generator
from stiction.reliability.tail import CONFIDENCE, Goal, Tail

COUNT_BATCH = 1024
"""Most samples that are solved before failures are counted again."""
SPECIMENS_PER_SAMPLE = 128
"""Specimens for each solved sample."""
CHARACTERISTIC = 0.05
"""Fraction of the specimens below the characteristic value."""
FIRST_SAMPLES, MOST_STEP_SAMPLES = 500, 8_000
"""Number of samples that are solved at first, and largest number in a
later step."""
COUNT_MARGIN = 1.1
"""Factor on the number of samples, because the error so far is itself
an estimate."""
SUBSET_EVALUATIONS = 50.0
"""Evaluations of subset simulation for a coefficient of variation of 1,
over log10(P)^2, fitted to measured costs."""
LONG_LIST, LIST_COST = 100, 5.0
"""Number of interfaces above which a list is long, and cost of an
evaluation in chains over a long list, over the cost of an evaluation in
counting."""


def binomial_interval(failures: int, samples: int) -> tuple[float, float]:
    """Return the interval for a probability from independent samples (Clopper and Pearson)."""
    tail, held = 0.5 * (1.0 - CONFIDENCE), samples - failures
    low = betaincinv(failures, held + 1, tail) if failures else 0.0
    high = betaincinv(failures + 1, held, 1.0 - tail) if held else 1.0
    return float(low), float(high)


class Counted(NamedTuple):
    """Failures among samples, without the last failure if it ended the count."""

    failures: int
    samples: int
    until_failure: bool = False

    @property
    def probability(self) -> float:
        """Unbiased estimate of the probability (step 3)."""
        last = int(self.until_failure)
        return (self.failures - last) / (self.samples - last)

    @property
    def cv(self) -> float:
        """Standard error of the estimate, divided by the estimate."""
        last = int(self.until_failure)
        if self.failures <= last:
            return math.inf
        # If all samples failed, count one more that holds, because no
        # count is certain.
        held = max(1.0 - self.probability, 1.0 / (self.samples + 1.0))
        return math.sqrt(held / (self.failures - last))

    def interval(self) -> tuple[float, float]:
        """Return the interval of Clopper and Pearson, or the negative binomial interval."""
        low, high = binomial_interval(self.failures, self.samples)
        if self.until_failure:
            # At least n samples before failure r are at most r - 1
            # failures in n - 1 samples.
            high = binomial_interval(self.failures - 1, self.samples - 1)[1]
        return low, high


@dataclass(frozen=True)
class Redrawn:
    """Draws of plain samples from `first` on, which are drawn again to save memory."""

    state: LimitState
    seed: int
    first: int
    samples: int

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, rows: NDArray[np.int64]) -> Array:
        """Return the draws (rows, dimension) of some of the samples."""
        draws = [self.state.draws(self.seed, self.first + row, 1) for row in rows.tolist()]
        return np.concatenate(draws)


def count_failures(
    state: LimitState,
    seed: int,
    stress: float,
    *,
    target_cv: float,
    least: int,
    max_evaluations: int,
    start: int = 0,
) -> tuple[Counted, Descent]:
    """Count until there are enough failures, and at least `least` samples from `start` on.

    Samples after the last counted failure are also returned.
    """
    # 1. Two more than the square of 1/target, since the error falls
    # like 1/sqrt(r - 1).
    wanted = 2 + math.ceil(1.0 / (target_cv * target_cv))
    least = min(least, max_evaluations)
    parts: list[Array] = []
    members: list[NDArray[np.int64]] = []
    done = failures = 0
    # 2.
    while done < least or (failures < wanted and done < max_evaluations):
        size = least - done
        if size <= 0:
            # As many as should hold the missing failures.
            size = math.ceil((wanted - failures) * done / failures) if failures else COUNT_BATCH
        size = min(size, COUNT_BATCH, max_evaluations - done)
        draws = state.draws(seed, start + done, size)
        parts.append(state(draws))
        members.append(state.member(draws))
        done, failures = done + size, failures + int(np.sum(parts[-1] < stress))
        state.meter.note = f"{failures:,} failures of {wanted:,} wanted"
    values = np.concatenate(parts)
    count = Counted(failures, done)
    # 3. The first `least` samples are always counted, whether or not
    # they hold r failures.
    if failures >= wanted:
        last = int(np.flatnonzero(values < stress)[wanted - 1])
        if last >= least:
            count = Counted(wanted, last + 1, until_failure=True)
    level = Population(
        math.inf, 0.0, values, np.arange(done), np.concatenate(members),
        Redrawn(state, seed, start, done),
    )  # fmt: skip
    return count, Descent(done, [level], stress, done, complete=True)


# -- many specimens for each solved field -------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Counts:
    """Specimens by solved sample: onsets, interfaces and quantile levels of their factors.

    ``counts[numbers]`` and ``len(counts)`` give the draws and the
    number of specimens.
    """

    state: LimitState
    values: Array  # (samples, specimens), Pa
    members: NDArray[np.int64]
    shares: Array  # NaN if the sample keeps its own factor

    def __len__(self) -> int:
        return self.values.size

    def __getitem__(self, numbers: NDArray[np.int64]) -> Array:
        """Return the draws of the specimens with given numbers."""
        experiment, (samples, specimens) = self.state.experiment, self.values.shape
        plain = Redrawn(self.state, experiment.seed, 0, samples)
        draws, shares = plain[numbers // specimens], self.shares.ravel()[numbers]
        new = np.flatnonzero(np.isfinite(shares))
        if new.size:
            column = experiment.random.factor_column(experiment.problem.interface)
            draws[new, column] = ndtri(shares[new])
            experiment.random.select(draws, new, self.members.ravel()[numbers][new])
        return draws

    @cached_property
    def tail(self) -> Tail:
        """The lower tail. Each solved sample counts as one ancestor (step 7)."""
        samples, specimens = self.values.shape
        ancestors = np.repeat(np.arange(samples), specimens)
        values, members = self.values.ravel(), self.members.ravel()
        level = Population(math.inf, 0.0, values, ancestors, members, self)
        descent = Descent(samples, [level], -math.inf, samples, complete=True)
        reason = "counting takes fewer evaluations"
        reason += f", with {specimens} specimens of each sample" * (specimens > 1)
        return Tail([descent], "plain", reason, samples)

    def characteristic(self, confidence: float) -> float:
        """Return the 5 % quantile, Pa, that a fraction `confidence` of the interfaces exceeds.

        The onsets of an interface are computed from the onsets in its
        group at a mean and a factor of 1. These are multiplied by its
        mean, and by factors at equal steps of probability.
        """
        random = self.state.experiment.random
        if not np.isfinite(self.shares).any():
            return float(np.quantile(self.values, CHARACTERISTIC))
        laws, law = random.factor_laws
        first = self.members[:, 0]
        factor = _by_law(laws, law[first], self.shares[:, 0])
        ratios = self.values[:, 0] / random.means[first] / factor
        steps = (np.arange(SPECIMENS_PER_SAMPLE) + 0.5) / SPECIMENS_PER_SAMPLE
        factors = np.array([marginal.distribution.ppf(steps) for marginal in laws])
        quantiles = []
        for number, group in enumerate(random.groups):
            group_ratios = ratios[random.groups[first] == group]
            if group_ratios.size:
                values = random.means[number] * np.outer(group_ratios, factors[law[number]])
                quantiles.append(np.quantile(values, CHARACTERISTIC))
        return float(np.quantile(quantiles, 1.0 - confidence))


def _by_law(laws: Sequence[Any], law: NDArray[np.int64], shares: Array) -> Array:
    """Return the factors at quantile levels `shares` of the laws with numbers `law`."""
    factors = np.empty(shares.shape)
    for number in np.unique(law):
        of_law = law == number
        factors[of_law] = laws[number].distribution.ppf(shares[of_law])
    return factors


def _expands(state: LimitState) -> bool:
    """Return whether each solved sample represents many specimens."""
    experiment = state.experiment
    problem, random = experiment.problem, experiment.random
    has_factor = random.factor_column(problem.interface) is not None
    return has_factor and scales_with_strength(problem, random, experiment.method)


def solve_specimens(state: LimitState, first: int, samples: int) -> Counts:
    """Solve samples `first`, ... and return the specimens from each sample (steps 4 to 6)."""
    experiment = state.experiment
    random, interface = experiment.random, experiment.problem.interface
    # 4.
    draws = state.draws(experiment.seed, first, samples)
    onsets, members = state(draws), state.member(draws)
    if not _expands(state):
        return Counts(state, onsets[:, None], members[:, None], np.full((samples, 1), np.nan))
    laws, law = random.factor_laws
    # 5. The ratio of onset and strength depends on the field alone.
    ratios = onsets / random.means[members]
    own_factor = draws[:, random.factor_column(interface)]
    for number in np.unique(law[members]):
        rows = np.flatnonzero(law[members] == number)
        ratios[rows] /= from_normal(laws[number], own_factor[rows])
    # 6. A random place in each of equal steps: in order for the
    # interfaces of a group, and permuted for the factors, which are
    # independent of the interfaces.
    rng, shape = generator(experiment.seed, 5, first), (samples, SPECIMENS_PER_SAMPLE)
    steps = (np.arange(SPECIMENS_PER_SAMPLE) + rng.random(shape)) / SPECIMENS_PER_SAMPLE
    chosen, group = np.empty(shape, np.int64), random.groups[members]
    for number in np.unique(group):
        alike, rows = np.flatnonzero(random.groups == number), np.flatnonzero(group == number)
        chosen[rows] = alike[(steps[rows] * alike.size).astype(np.int64)]
    shares = (np.arange(SPECIMENS_PER_SAMPLE) + rng.random(shape)) / SPECIMENS_PER_SAMPLE
    shares = rng.permuted(shares, axis=1)
    factors = _by_law(laws, law[chosen], shares)
    return Counts(state, ratios[:, None] * random.means[chosen] * factors, chosen, shares)


def count_tail(state: LimitState, goal: Goal, budget: int) -> tuple[Counts | None, bool]:
    """Count failures up to the goal (steps 7 and 8), and return whether the count is enough.

    The count is not enough if chains cost less. Without a long list and
    factors nothing is counted.
    """
    long_list = len(state.experiment.random.members) > LONG_LIST
    if not (long_list or _expands(state)):
        return None, False
    counts = solve_specimens(state, 0, min(FIRST_SAMPLES, budget))
    while True:
        tail, samples = counts.tail, len(counts.values)
        stress = tail.quantile(goal.probability) if goal.probability else goal.stress
        chance, cv = goal.probability or tail.probability(stress), tail.cv(stress)
        # At a quantile, the fraction of plain samples below it is given.
        # Its error is not in the families, since each family has a
        # single specimen.
        if counts.values.shape[1] == 1 and goal.probability:
            cv = max(cv, math.sqrt((1.0 - chance) / (chance * samples)))
        state.meter.note = f"cv {cv:.2g} (target {goal.cv:g})"
        if cv <= goal.cv or samples >= budget:
            return counts, True
        # 8. Compare the costs of counting to
        # the target and of subset simulation.
        wanted = COUNT_MARGIN * samples * (cv / goal.cv) ** 2
        decades = max(-math.log10(chance), 1.0) if chance else math.inf
        price = SUBSET_EVALUATIONS * (decades / goal.cv) ** 2
        if wanted > min(price * (LIST_COST if long_list else 1.0), budget):
            return counts, False
        size = int(min(max(wanted - samples, FIRST_SAMPLES), MOST_STEP_SAMPLES))
        more = solve_specimens(state, samples, min(size, budget - samples))
        counts = Counts(
            state,
            np.concatenate([counts.values, more.values]),
            np.concatenate([counts.members, more.members]),
            np.concatenate([counts.shares, more.shares]),
        )
