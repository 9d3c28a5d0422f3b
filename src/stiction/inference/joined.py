"""Profiles and peaks joined: equally likely interfaces, weighed by the peaks of repeated tests.

A list of interfaces that other evidence left equally likely is a prior over their number, and the
posterior is a weight for each, in proportion to the likelihood of the peaks (importance sampling;
Robert and Casella, 2004, section 3.3). The same samples serve all members.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import entropy

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.progress import Meter
from stiction.inference.agreement import agreement
from stiction.inference.grid import PosteriorGrid, grid_of
from stiction.inference.likelihood import Likelihood, make_likelihood, variable_of
from stiction.inference.peaks import Peaks
from stiction.inference.posterior import MEMBER, Posterior, posterior_of
from stiction.inference.prior import Prior, refuse_conditioned
from stiction.problem.problem import Problem
from stiction.random.equally_likely import EquallyLikely, Source, as_random
from stiction.random.fields import RandomInterface

FIRST, MOST = 300, 3_000
"""Members that are drawn from a source at first, and at most."""
ENOUGH, FEW = 100, 20
"""Members' worth of weight from which on no more are drawn, and below which a warning says so."""
SAMPLES = 500
BINS = 20
DOUBT = 0.05
"""P-value below which the list and the peaks are said to contradict each other."""


@dataclass(frozen=True, eq=False)
class Members(Prior):
    """Equally likely interfaces by number; what else differs between them follows from it."""

    likely: EquallyLikely

    @property
    def names(self) -> tuple[str, ...]:
        """The number among interfaces that differ, and what describes these."""
        return (MEMBER, *self._differing)

    @property
    def cells(self) -> int | None:
        """Number of members."""
        return len(self.likely.members)

    @property
    def ends(self) -> Array:
        """Least and greatest number and description, (2, columns)."""
        return np.stack([self.quantile(0.0), self.quantile(1.0)])

    @property
    def dimension(self) -> int:
        """One: which of them holds."""
        return 1

    @cached_property
    def different(self) -> list[RandomInterface]:
        """Interfaces of which no two are equal."""
        return list(dict.fromkeys(self.likely.members))

    @cached_property
    def places(self) -> Array:
        """Place of every member among those that differ, (members,)."""
        number = {one: place for place, one in enumerate(self.different)}
        return np.array([number[one] for one in self.likely.members], dtype=np.float64)

    def worth(self, mass: Array) -> float:
        """Return how many interfaces of equal weight tell as much; equal members are one."""
        return 1.0 / float(np.sum(np.bincount(self.places.astype(np.int64), mass) ** 2))

    @cached_property
    def _differing(self) -> dict[str, Array]:
        rows = [describing(one) for one in self.different]
        found = {name: np.array([row.get(name, np.nan) for row in rows]) for name in rows[0]}
        return {
            name: values
            for name, values in found.items()
            if np.ptp(values) > 1e-9 * np.abs(values).max()
        }

    def information(self, grid: PosteriorGrid) -> dict[str, float]:
        """Return the divergence of each column alone, by its ranks in equal shares, nats."""
        found, count = {MEMBER: grid.information(0)}, grid.mass.size
        ends, bins = np.arange(count + 1) / count, np.linspace(0.0, 1.0, min(BINS, count) + 1)
        every = self.theta((ends[1:] - 0.5 / count)[:, None])
        for name, values in zip(self.names[1:], every.T[1:], strict=True):
            ranked = np.append(0.0, np.cumsum(grid.mass[np.argsort(values, kind="stable")]))
            shares = np.diff(np.interp(bins, ends, ranked))
            found[name] = float(np.log(shares.size) - entropy(shares))
        return found

    def theta(self, u: Array) -> Array:
        """Return number and description at `u`, of which the first column alone counts."""
        count = self.places.size
        of = self.places[np.minimum((u[:, 0] * count).astype(np.int64), count - 1)]
        return np.column_stack(
            [of, *(v[of.astype(np.int64)] for v in self._differing.values())]
        )

    def u(self, theta: Array) -> Array:
        """Return a point of each number, (points, 1)."""
        first = [np.flatnonzero(self.places == number)[:1] for number in theta[:, 0]]
        found = [(own[0] + 0.5) / self.places.size if own.size else -1.0 for own in first]
        return np.array(found)[:, None]

    def quantile(self, share: float) -> Array:
        """Return the quantiles of number and description, each alone."""
        steps = (np.arange(self.places.size) + 0.5) / self.places.size
        return np.quantile(self.theta(steps[:, None]), share, axis=0)

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """Return the problem and the interface of one number."""
        return self.problem, self.different[int(theta[0])]

    def named(self, theta: Array) -> Any:
        """Begin the messages of errors of one number."""
        return prefixed(f"random: {MEMBER} {theta[0]:.0f}")


def describing(random: RandomInterface) -> dict[str, float]:
    """Return the numbers that describe each property, by keys like those of a prior."""
    found = {}
    for name, field in random.properties.items():
        found[f"{name}.mean"] = field.mean
        found[f"{name}.standard_deviation"] = field.standard_deviation
        found[f"{name}.efolding_length"] = field.spectrum.efolding_length
    for name, factor in (random.between or {}).items():
        found[f"between.{name}"] = float(factor.distribution.std())
    return found


def members_of(problem: Problem, likely: Any) -> Members:
    """Return the prior of a list, or raise an `InputError` where it cannot be weighed."""
    refuse_conditioned(likely.members)
    if len(set(likely.members)) < 2:
        raise InputError(
            "prior: is left out, so `random` must hold several interfaces that differ, such as a"
            " fit; give a single field a prior={...} for its unknown parameters"
        )
    return Members(problem, likely.members[0], {}, likely)


def join(
    problem: Problem, random: Any, measured: Peaks, *, samples: int | None, meter: Meter,
    seed: int, **options: Any,
) -> Posterior:  # fmt: skip
    """Return the posterior of equally likely interfaces, or of as many as a source needs."""
    source = random if isinstance(random, Source) else None
    likely = as_random(source.interfaces(FIRST, seed) if source else random)
    while True:
        prior = members_of(problem, likely)
        likelihood = make_likelihood(
            prior, samples=samples or SAMPLES, lengths=measured.lengths, seed=seed, meter=meter,
            variable=variable_of(prior, measured.unit), **options,
        ).of(measured.values)  # fmt: skip
        grid = grid_of(likelihood, prior.whole, cells=prior.cells)
        worth = 0.0 if grid is None else prior.worth(grid.mass)
        drawn, count = len(likely.members), len(prior.different)
        if source is None or worth >= ENOUGH or drawn >= MOST:
            break
        wanted = min(MOST, int(np.clip(1.5 * ENOUGH / max(worth, 1.0), 2.0, 10.0) * drawn))
        likely = EquallyLikely(tuple(source.interfaces(wanted, seed)))
        if len(set(likely.members)) == count:  # the source has no others
            break
    notes = [f"{count} interfaces, weighed by the peaks, are worth {worth:.0f}"]
    chance, possible = _chance(likelihood, measured, seed)
    if grid is None or not possible:
        raise InputError(
            f"peaks: contradict the interfaces: none of these {count} gives such peaks (p ="
            f" {chance:.2g} of their agreement); check the unit of both, the method, and whether"
            " tests and profiles are of the same surfaces; give the load-cell error if peaks are"
            " not exact"
        )
    warnings = []
    if chance < DOUBT:
        warnings.append(
            f"the peaks contradict the interfaces, p = {chance:.2g} of their agreement: one of the"
            " two, or the model, misses something, and so would a design by both"
        )
    if worth < FEW:
        warnings.append(
            f"the peaks leave the weight of only {worth:.1f} of {count} interfaces; "
            + (
                "give more `bootstrap` repetitions of the fit"
                if source
                else "give a longer list"
            )
        )
    for text in warnings:
        warn_accuracy(text)
    tests = sum(map(np.size, measured.values))
    error = float(np.sqrt(tests / likelihood.samples + 1.0 / worth))
    return posterior_of(likelihood, grid, measured, error, [*notes, *warnings], seed)


def _chance(likelihood: Likelihood, measured: Peaks, seed: int) -> tuple[float, bool]:
    """Return the p-value of peaks under the list alone, and whether it may be chance at all."""
    none = measured._replace(values=tuple(np.empty(0) for _ in measured.values))
    before = likelihood.of(none.values)
    grid = grid_of(before, likelihood.box, cells=before.prior.cells)
    assert grid is not None
    prediction = posterior_of(before, grid, none, 0.0, [], seed)
    found = agreement(prediction, measured, seed=seed)
    chance = min(found.p_values.values())
    return chance, chance > 1.5e-3
