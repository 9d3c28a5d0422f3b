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
    """Return the interval for a probability from independent samples (Clopper and Pearson).

    One-sided 95 % bounds are powers of 0.05 if all samples fail or hold.

    >>> low, high = binomial_interval(0, 5)
    >>> low, round(1.0 - high, 6) == round(0.05**0.2, 6)
    (0.0, True)
    >>> low, high = binomial_interval(5, 5)
    >>> round(low, 6) == round(0.05**0.2, 6), high
    (True, 1.0)
    >>> low, high = binomial_interval(1, 2)
    >>> round((1.0 - low) ** 2, 6), round(high**2, 6)
    (0.95, 0.95)
    """
    tail, held = 0.5 * (1.0 - CONFIDENCE), samples - failures
    low = betaincinv(failures, held + 1, tail) if failures else 0.0
    high = betaincinv(failures + 1, held, 1.0 - tail) if held else 1.0
    return float(low), float(high)


class Counted(NamedTuple):
    """Failures among samples, without the last failure if it ended the count.

    >>> plain = Counted(3, 10)
    >>> plain.probability, round(plain.cv**2, 6)  # 0.7/3
    (0.3, 0.233333)
    >>> ended = Counted(3, 11, until_failure=True)
    >>> ended.probability, round(ended.cv**2, 6)  # 2/10 and 0.8/2
    (0.2, 0.4)
    >>> Counted(0, 5).cv, Counted(1, 5, until_failure=True).cv, round(Counted(4, 4).cv ** 2, 6)
    (inf, inf, 0.05)

    The first failure at the fifth sample: with 95 % confidence, p is at
    least 1 - 0.95^(1/5), and at most 1 - 0.05^(1/4).

    >>> low, high = Counted(1, 5, until_failure=True).interval()
    >>> round((1.0 - low) ** 5, 6), round((1.0 - high) ** 4, 6)
    (0.95, 0.05)
    >>> Counted(1, 5).interval() == binomial_interval(1, 5)
    True
    """

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
    """Draws of plain samples from `first` on, which are drawn again to save memory.

    >>> from types import SimpleNamespace
    >>> state = SimpleNamespace()
    >>> state.draws = lambda seed, first, count: np.full((count, 2), [seed, first])
    >>> draws = Redrawn(state, seed=7, first=10, samples=5)
    >>> len(draws), draws[np.array([2, 0])].tolist()
    (5, [[7, 12], [7, 10]])
    """

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

    Here every fourth sample, 0, 4, ... fails at stresses above 0.5. A
    target of 0.5 needs 2 + 4 failures. The sixth is sample 20.

    >>> from types import SimpleNamespace
    >>> class State:
    ...     meter = SimpleNamespace()
    ...     def draws(self, seed, first, count):
    ...         return np.arange(first, first + count)[:, None] + seed
    ...     def member(self, draws):
    ...         return draws[:, 0] % 3
    ...     def __call__(self, draws):
    ...         return draws[:, 0] % 4 + 0.5
    >>> def count(stress=1.0, seed=0, **limits):
    ...     given = {"target_cv": 0.5, "least": 10, "max_evaluations": 60} | limits
    ...     counted, descent = count_failures(State(), seed, stress, **given)
    ...     members = descent.populations[0].members[:4].tolist()
    ...     return tuple(counted), descent.samples, members
    >>> count()  # 10, 10 and 4 samples with 3, 2 and 1 failures
    ((6, 21, True), 24, [0, 1, 2, 0])
    >>> limits = {"target_cv": 0.5, "least": 10, "max_evaluations": 60, "start": 5}
    >>> count_failures(State(), 3, 1.0, **limits)[1].populations[0].draws[np.array([2])].tolist()
    [[10]]
    >>> count(start=1)  # 4, ..., 24 are the samples 3, ..., 23 of 10 + 20
    ((6, 24, True), 30, [1, 2, 0, 1])

    The least number of samples is counted in any case, and the largest
    number ends a count. A value at the stress is no failure.

    >>> count(least=21)[0], count(least=20)[0]
    ((6, 21, False), (6, 21, True))
    >>> count(max_evaluations=14)[0], count(stress=0.5)[0]
    ((4, 14, False), (0, 60, False))
    >>> count(seed=2, max_evaluations=9)  # samples 2 and 6
    ((2, 9, False), 9, [2, 0, 1, 2])
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

    Three samples with two specimens each. The tail has one ancestor for
    each sample:

    >>> values = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    >>> members, shares = np.array([[0, 1], [1, 1], [0, 0]]), np.full((3, 2), np.nan)
    >>> counts = Counts(None, values, members, shares)
    >>> len(counts), counts.tail.reason
    (6, 'counting takes fewer evaluations, with 2 specimens of each sample')
    >>> below = counts.tail.repetitions[0].below(3.5)
    >>> below.ancestors.tolist(), below.members.tolist(), round(below.probability, 6)
    ([0, 0, 1], [0, 1, 1], 0.166667)
    >>> counts.tail.repetitions[0].samples, counts.tail.spent, counts.tail.algorithm
    (3, 3, 'plain')
    >>> Counts(None, values[:, :1], members[:, :1], shares[:, :1]).tail.reason
    'counting takes fewer evaluations'

    Draws of specimens 1 and 4: the first comes from sample 0 with another
    factor, at the quantile level 0.8413, and the second from sample 2 as it is.

    >>> from types import SimpleNamespace
    >>> def select(draws, rows, members):
    ...     draws[rows, 0] = 100 + members
    >>> random = SimpleNamespace(factor_column=lambda interface: 1, select=select)
    >>> problem = SimpleNamespace(interface=None)
    >>> state = SimpleNamespace(experiment=SimpleNamespace(random=random, problem=problem, seed=7))
    >>> state.draws = lambda seed, first, count: np.array([[10.0 * seed + first, 0.0]])
    >>> shares[0, 1] = 0.8413447
    >>> Counts(state, values, members, shares)[np.array([1, 4])].round(4).tolist()
    [[101.0, 1.0], [72.0, 0.0]]
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

        The sample of interface 1 has the factor 0.75, so that onset over mean
        and factor is 4. Factors at the 5 % quantile of 128 steps are 0.5 + f and
        1 + 2 f, with f = 6.85/128. This gives 12 (0.5 + f) Pa for interface 1, and
        8 (1 + 2 f) Pa for interface 0. No sample is in the group of interface 2.

        >>> from types import SimpleNamespace
        >>> from scipy.stats import uniform
        >>> laws = uniform(0.5, 1.0), uniform(1.0, 2.0)
        >>> laws = [SimpleNamespace(distribution=law) for law in laws]
        >>> random = SimpleNamespace(
        ...     factor_laws=(laws, np.array([1, 0, 1])), means=np.array([2.0, 3.0, 4.0]),
        ...     groups=np.array([0, 0, 1]),
        ... )
        >>> state = SimpleNamespace(experiment=SimpleNamespace(random=random))
        >>> members, shares = np.array([[1, 0]]), np.array([[0.25, np.nan]])
        >>> counts = Counts(state, np.array([[9.0, 5.0]]), members, shares)
        >>> f = 6.85 / 128
        >>> [round(counts.characteristic(level), 3) for level in (1.0, 0.75, 0.0)]
        [6.642, 7.196, 8.856]
        >>> round(12 * (0.5 + f), 3), round(8 * (1 + 2 * f), 3)
        (6.642, 8.856)

        Without factors, it is the quantile of all onsets:

        >>> plain = Counts(state, np.array([[4.0], [2.0], [7.0]]), None, np.full((3, 1), np.nan))
        >>> round(plain.characteristic(0.75), 6)  # a tenth of the way from 2 to 4
        2.2
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
    """Return the factors at quantile levels `shares` of the laws with numbers `law`.

    >>> from types import SimpleNamespace
    >>> from scipy.stats import uniform
    >>> laws = uniform(0.5, 1.0), uniform(1.0, 2.0)
    >>> laws = [SimpleNamespace(distribution=law) for law in laws]
    >>> _by_law(laws, np.array([1, 0, 1]), np.array([0.25, 0.5, 0.75])).tolist()
    [1.5, 1.0, 2.5]
    """
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
    """Solve samples `first`, ... and return the specimens from each sample (steps 4 to 6).

    Without factors between specimens, a sample is its own specimen:

    >>> from types import SimpleNamespace
    >>> class State:
    ...     def draws(self, seed, first, count):
    ...         return np.arange(first, first + count)[:, None] + seed
    ...     member = lambda self, draws: draws[:, 0] % 2
    ...     __call__ = lambda self, draws: 3.0 * draws[:, 0]
    >>> random = SimpleNamespace(factor_column=lambda interface: None)
    >>> problem = SimpleNamespace(interface=None)
    >>> state = State()
    >>> state.experiment = SimpleNamespace(seed=5, random=random, problem=problem, method=None)
    >>> counts = solve_specimens(state, 1, 3)
    >>> counts.values.tolist(), counts.members.tolist(), counts.shares.tolist()
    ([[18.0], [21.0], [24.0]], [[0], [1], [0]], [[nan], [nan], [nan]])

    With factors, onset over mean and factor is the same number R in all 128
    specimens of a sample. They are spread over the interfaces 0 and 1
    of the group of the sample, and each factor lies in a step of 1/128 of its own.

    >>> from scipy.special import ndtr
    >>> from scipy.stats import uniform
    >>> laws = uniform(0.5, 1.0), uniform(1.0, 2.0)
    >>> laws = [SimpleNamespace(distribution=law) for law in laws]
    >>> laws[0].of_normal = lambda z: 0.5 + ndtr(z)
    >>> laws[1].of_normal = lambda z: 1.0 + 2.0 * ndtr(z)
    >>> law, means = np.array([0, 1, 1]), np.array([2.0, 4.0, 10.0])
    >>> random = SimpleNamespace(
    ...     factor_column=lambda interface: 1, factor_laws=(laws, law), means=means,
    ...     groups=np.array([3, 3, 5]), varying={"strength"}, names=[],
    ... )
    >>> problem = SimpleNamespace(
    ...     interface=None, specimen=None, load_profile=np.ones(2),
    ...     load=SimpleNamespace(initial_stress=0.0),
    ...     friction=SimpleNamespace(weakening_rate=1.0, residual_strength=0.0),
    ... )
    >>> class State:
    ...     experiment = SimpleNamespace(
    ...         seed=5, random=random, problem=problem, method=SimpleNamespace(scaling="stretch")
    ...     )
    ...     def draws(self, seed, first, count):
    ...         return np.column_stack([np.arange(first, first + count), [-1.0, 0.5, 2.0]])
    ...     def member(self, draws):
    ...         return np.array([0, 1, 2])
    ...     def __call__(self, draws):  # R is 7, 8 and 9
    ...         factors = [laws[0].of_normal(-1.0), *laws[1].of_normal(draws[1:, 1])]
    ...         return draws[:, 0] * means * factors
    >>> counts = solve_specimens(State(), 7, 3)
    >>> factors = _by_law(laws, law[counts.members], counts.shares)
    >>> ratios = counts.values / means[counts.members] / factors
    >>> np.allclose(ratios, [[7.0], [8.0], [9.0]])
    True
    >>> [np.bincount(row, minlength=3).tolist() for row in counts.members]
    [[64, 64, 0], [64, 64, 0], [0, 0, 128]]
    >>> steps = (counts.shares * 128).astype(int)
    >>> bool((np.sort(steps) == np.arange(128)).all()), bool((steps == np.arange(128)).all())
    (True, False)
    """
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

    Here the onset of sample n is (37 n mod 100)/100, so that 31 % lie below
    0.305. 500 samples have the cv sqrt(0.69/0.31/500) = 0.067, and 1000 have
    0.047.

    >>> from types import SimpleNamespace
    >>> class State:
    ...     meter = SimpleNamespace()
    ...     def draws(self, seed, first, count):
    ...         return np.arange(first, first + count)[:, None]
    ...     member = lambda self, draws: draws[:, 0] % 2
    ...     __call__ = lambda self, draws: draws[:, 0] * 37 % 100 / 100
    >>> def count(goal, budget=10_000, members=101):
    ...     state, problem = State(), SimpleNamespace(interface=None)
    ...     random = SimpleNamespace(members=range(members), factor_column=lambda _: None)
    ...     experiment = {"seed": 0, "random": random, "problem": problem, "method": None}
    ...     state.experiment = SimpleNamespace(**experiment)
    ...     counts, enough = count_tail(state, goal, budget)
    ...     return len(counts or ()), enough
    >>> count(Goal(0.07, 0.305)), count(Goal(0.05, 0.305)), count(Goal(0.07, 0.305), members=100)
    ((500, True), (1000, True), (0, False))
    >>> count(Goal(0.07, 0.305), budget=200), count(Goal(0.05, 0.305), budget=800)
    ((200, True), (500, False))
    >>> count(Goal(0.063, 0.305), budget=700)  # 620 are wanted, in steps of 500 at least
    (700, True)

    At a probability of 31 %, the error of the fraction itself decides. No
    onset is below zero.

    >>> count(Goal(0.07, probability=0.305)), count(Goal(0.06, probability=0.305))
    ((500, True), (1000, True))
    >>> count(Goal(0.5, 0.0))
    (500, False)

    At P = 0.001 and a cv of 0.5, 1.1 * 999/0.25 samples are wanted, fewer than the
    250 (3/0.5)^2 of chains over a long list. At P = 0.0001, chains cost less.

    >>> count(Goal(0.5, probability=1e-3)), count(Goal(0.5, probability=1e-4), budget=90_000)
    ((4395, True), (500, False))
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
