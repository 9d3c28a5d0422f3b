"""Count failures with many specimens for each solved field.

Problem. Estimate the lower tail of the onset T for specimens with strength m b
f(x). Here m is the mean, b the factor between specimens, and f the field within a
specimen. Only m and the distribution of b differ between equally likely interfaces
with the same field. If the onset is proportional to the strength, T is m b R(f),
and the solver is needed only for R.

Source. The method is conditional Monte Carlo (Hammersley, 1956, Journal of the ACM
3, 73; Asmussen and Glynn, Stochastic Simulation, 2007, section V.4).

Steps:

1. Draw plain samples, as `stiction.monte_carlo` does, and solve them.
2. Divide each onset by the factor and the mean in its sample.
3. Multiply it by means of other interfaces with the same field, evenly spread over
   these interfaces, and by factors at stratified quantiles of their distributions.
   This gives `SPECIMENS_PER_SAMPLE` specimens for each solved sample.
4. The specimens from one solved sample form a family. The error follows from the
   share of each family among the failures (`uncertainty.ancestral_variance`), as in
   subset simulation.
5. Solve more samples until the error is small enough.

Departures. Stratified sampling replaces the integral over b. If the onset is not
proportional to the strength, each sample has one specimen, and the method reduces
to plain counting.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.ensemble.limit_state import LimitState, scales_with_strength
from stiction.random.mapping import from_normal
from stiction.reliability.subset import Descent, Population
from stiction.reliability.tail import Goal, Tail
from stiction.reliability.uncertainty import generator

SPECIMENS_PER_SAMPLE = 128
"""Specimens for each solved sample."""
CHARACTERISTIC = 0.05
"""Share of the specimens below the characteristic value."""
FIRST_SAMPLES, MOST_STEP_SAMPLES = 500, 8_000
"""Samples that are solved at first, and most samples in a later step."""
COUNT_MARGIN = 1.1
"""Factor on the number of samples, because the error so far is itself an estimate."""
SUBSET_EVALUATIONS = 50.0
"""Evaluations of subset simulation for a coefficient of variation of 1, over log10(P)^2.
It was fitted to measured costs."""
LONG_LIST, LIST_COST = 100, 5.0
"""Number of interfaces above which a list is long, and cost of an evaluation in chains
over a long list, over the cost of an evaluation in counting."""


class Counts(NamedTuple):
    """Specimens by solved sample: onsets, interfaces and quantile levels of their factors."""

    state: LimitState
    values: Array  # (samples, specimens), Pa
    members: NDArray[np.int64]
    shares: Array  # NaN if the sample keeps its own factor

    @property
    def tail(self) -> Tail:
        """The lower tail. Each solved sample counts as one ancestor."""
        samples, specimens = self.values.shape
        ancestors = np.repeat(np.arange(samples), specimens)
        values, members = self.values.ravel(), self.members.ravel()
        level = Population(math.inf, 0.0, values, ancestors, members)
        descent = Descent(samples, [level], -math.inf, samples, complete=True)
        reason = f"counting takes fewer evaluations: {specimens} specimens of each sample"
        return Tail([descent], "plain", reason, samples)

    def draws(self, picks: NDArray[np.int64]) -> Array:
        """Return the draws of specimens with the given numbers."""
        state, specimens = self.state, self.values.shape[1]
        random, seed = state.experiment.random, state.experiment.seed
        rows = [state.draws(seed, int(pick) // specimens, 1) for pick in picks]
        draws = np.concatenate([np.empty((0, state.dimension)), *rows])
        shares = self.shares.ravel()[picks]
        new = np.isfinite(shares)
        if new.any():
            column = random.factor_column(state.experiment.problem.interface)
            draws[new, column] = ndtri(shares[new])
            random.select(draws, np.where(new)[0], self.members.ravel()[picks][new])
        return draws

    def characteristic(self, confidence: float) -> float:
        """Return the 5 % quantile, Pa, that a share `confidence` of the interfaces exceeds.

        The onsets of an interface are computed from the onsets in its group at a mean
        and a factor of 1. These are multiplied by its mean, and by factors at equal
        steps of probability.
        """
        random = self.state.experiment.random
        if not np.isfinite(self.shares).any():
            return float(np.quantile(self.values, CHARACTERISTIC))
        laws, law = random.factor_laws
        first = self.members[:, 0]
        ratios = self.values[:, 0] / random.means[first]
        for number in np.unique(law[first]):
            rows = np.flatnonzero(law[first] == number)
            ratios[rows] /= laws[number].distribution.ppf(self.shares[rows, 0])
        steps = (np.arange(SPECIMENS_PER_SAMPLE) + 0.5) / SPECIMENS_PER_SAMPLE
        factors = np.array([one.distribution.ppf(steps) for one in laws])
        quantiles = []
        for number, group in enumerate(random.groups):
            group_ratios = ratios[random.groups[first] == group]
            if group_ratios.size:
                values = random.means[number] * np.outer(group_ratios, factors[law[number]])
                quantiles.append(np.quantile(values, CHARACTERISTIC))
        return float(np.quantile(quantiles, 1.0 - confidence))

    def lowest(self, stress: float, count: int) -> tuple[Array, Array]:
        """Return the draws and onsets of the lowest specimens. Half of them are below a stress."""
        values = self.values.ravel()
        below = int(np.sum(values < stress))
        order = np.argpartition(values, min(2 * below, values.size - 1))[: 2 * below]
        picks = np.random.default_rng(0).permutation(order)[:count]
        return self.draws(picks), values[picks]

    def failing(self, stress: float, count: int) -> Array:
        """Return the draws of some specimens below a stress."""
        failed = np.flatnonzero(self.values.ravel() < stress)
        return self.draws(np.random.default_rng(1).permutation(failed)[:count])


def _expands(state: LimitState) -> bool:
    """Return whether each solved sample stands for many specimens."""
    experiment = state.experiment
    problem, random = experiment.problem, experiment.random
    return random.factor_column(problem.interface) is not None and scales_with_strength(
        problem, random, experiment.method
    )


def solve(state: LimitState, first: int, samples: int) -> Counts:
    """Solve samples `first`, ... and return the specimens from each sample (steps 1 to 3)."""
    experiment = state.experiment
    random, interface = experiment.random, experiment.problem.interface
    draws = state.draws(experiment.seed, first, samples)
    onsets, members = state(draws), state.member(draws)
    column = random.factor_column(interface)
    if not _expands(state):
        return Counts(state, onsets[:, None], members[:, None], np.full((samples, 1), np.nan))
    laws, law = random.factor_laws
    # 2.
    ratios = onsets / random.means[members]
    for number in np.unique(law[members]):
        rows = np.flatnonzero(law[members] == number)
        ratios[rows] /= from_normal(laws[number], draws[rows, column])
    # 3.
    rng = generator(experiment.seed, 5, first)
    steps = (
        np.arange(SPECIMENS_PER_SAMPLE) + rng.random((samples, SPECIMENS_PER_SAMPLE))
    ) / SPECIMENS_PER_SAMPLE
    chosen = np.empty((samples, SPECIMENS_PER_SAMPLE), np.int64)
    group = random.groups[members]
    for number in np.unique(group):
        alike, rows = np.flatnonzero(random.groups == number), np.flatnonzero(group == number)
        chosen[rows] = alike[(steps[rows] * alike.size).astype(np.int64)]
    shares = rng.permuted(
        (np.arange(SPECIMENS_PER_SAMPLE) + rng.random((samples, SPECIMENS_PER_SAMPLE)))
        / SPECIMENS_PER_SAMPLE,
        axis=1,
    )
    factors = np.empty(shares.shape)
    for number in np.unique(law[chosen]):
        of_law = law[chosen] == number
        factors[of_law] = laws[number].distribution.ppf(shares[of_law])
    return Counts(state, ratios[:, None] * random.means[chosen] * factors, chosen, shares)


def count_tail(state: LimitState, goal: Goal, budget: int) -> tuple[Counts, Tail] | None:
    """Count failures up to the goal (steps 4 and 5). Return None if chains cost less."""
    long_list = len(state.experiment.random.members) > LONG_LIST
    if state.may_survive or not (long_list or _expands(state)):
        return None
    counts = solve(state, 0, min(FIRST_SAMPLES, budget))
    while True:
        tail, samples = counts.tail, len(counts.values)
        stress = tail.quantile(goal.probability) if goal.probability else goal.stress
        chance, cv = goal.probability or tail.probability(stress), tail.cv(stress)
        if counts.values.shape[1] == 1 and goal.probability:  # the error of plain counting
            cv = max(cv, math.sqrt((1.0 - chance) / (chance * samples)))
        state.meter.note = f"c.o.v. {cv:.2g} (target {goal.cv:g})"
        if cv <= goal.cv or samples >= budget:
            return counts, tail
        wanted = COUNT_MARGIN * samples * (cv / goal.cv) ** 2 if math.isfinite(cv) else math.inf
        decades = max(-math.log10(chance), 1.0) if chance else math.inf
        price = (
            SUBSET_EVALUATIONS * (decades / goal.cv) ** 2 * (LIST_COST if long_list else 1.0)
        )
        if wanted > min(price, budget):
            return None
        size = int(
            min(max(wanted - samples, FIRST_SAMPLES), budget - samples, MOST_STEP_SAMPLES)
        )
        if size <= 0:
            return counts, tail
        more = solve(state, samples, size)
        counts = Counts(
            state, *(np.concatenate(pair) for pair in zip(counts[1:], more[1:], strict=True))
        )
