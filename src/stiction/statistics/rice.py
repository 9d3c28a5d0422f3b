"""Distribution of the critical stress from crossing rates: the minimum of a stationary process."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from stiction.arrays import Array
from stiction.criterion.local import nucleation_stress
from stiction.errors import InputError
from stiction.jit import jit
from stiction.model import Count, Number, Numbers, brief, checked
from stiction.problem import Problem
from stiction.random.fields import RandomField
from stiction.statistics.moments import stationary

LEVELS = 1024
BATCH = 256
TRUSTED_PROBABILITY = 0.1
FEWEST_PROFILES = 10
MOST_BELOW = 0.04
MOST_DIPS = 1.1
MOST_NODES = 1 << 22
"""Number of nodes of all planes that are sampled at once."""
ENOUGH_POINTS = 32
"""Points in h_n at which crossings are counted; at 8, one in six of the rare ones is missed."""


@dataclass(frozen=True, eq=False)
class RiceDistribution:
    """Approximate distribution of the critical stress.

    Attributes
    ----------
    stress : (m,) array
        Levels x of the critical stress, tau_i + tau_0 p, Pa, rising.
    probability : (m,) array
        P(tau_cr <= x).
    crossing_rate : (m,) array
        Down-crossings of x per metre of interface; on a plane dips below x per m².
    point_survival : (m,) array
        P(the stress at a point exceeds x).
    relative_error : (m,) array
        Sampling error of the crossing rate: one over the root of the number of profiles that
        reach down to the level, as the crossings of one profile come in clusters.
    trusted : (m,) array of bool
        Where the approximation itself is good to about 5 %: P <= 0.1, at least 10 profiles
        that reach the level, and on a line `1 - point_survival` is at most 4 % of P, since P
        is too high by up to (1 - point_survival)/P if xi_0 is not short compared with the
        interface. On a plane there are at most 1.1 dips for each sample that has any. Above
        P = 0.1 P is too low, on a line by 4 to 9 % at the median.
    profiles : int
        Number of sampled profiles.
    """

    stress: Array
    probability: Array
    crossing_rate: Array
    point_survival: Array
    relative_error: Array
    trusted: NDArray[np.bool_]
    profiles: int

    __repr__ = brief

    def failure_probability(self, stress: Any) -> Any:
        """Return P(tau_cr <= stress) by interpolation, for a number or an array, Pa.

        Zero below the lowest value that was sampled: nothing is extrapolated.
        """
        result = np.interp(stress, self.stress, self.probability, left=0.0, right=1.0)
        return float(result) if np.ndim(stress) == 0 else result

    def quantile(self, probability: float) -> float:
        """Return the stress at which P(tau_cr <= stress) reaches `probability`, Pa."""
        if not 0.0 < probability < 1.0:
            raise InputError(f"probability: must be between 0 and 1, got {probability!r}")
        # Probabilities without repetition, each with the highest stress that has it.
        chance, last = np.unique(self.probability[::-1], return_index=True)
        return float(np.interp(probability, chance, self.stress[::-1][last]))


@checked
def rice_distribution(
    problem: Problem,
    strength: RandomField,
    *,
    profiles: Annotated[Count, Field(ge=16, le=10**7)] = 512,
    seed: Number = 0,
    stress: Numbers | None = None,
) -> RiceDistribution:
    """Approximate the distribution of the critical stress of the local criterion.

    P(tau_cr > x) ~ S(x) exp(-L nu(x)/S(x)): the stress at one point survives, and from
    there crossings of the level x come as a Poisson process at the rate nu (Rice, 1945;
    Cramer and Leadbetter, 1967). S and nu are pooled from sampled profiles of the
    nucleation stress, every position of which counts; so a few hundred profiles determine
    the lower tail as well as many more minima would. On a plane P(tau_cr > x) ~ exp(-chi(x)),
    with chi the expected Euler characteristic of what lies below x: the number of dips, as low
    ones have no holes (Adler, 1981).

    Parameters
    ----------
    problem : Problem
        With uniform weakening rate, load and initial stress.
    strength : RandomField
        Peak strength, Pa; or friction coefficients under a uniform normal pressure.
    profiles : int
        Number of profiles to sample, at least 16: samples 0, 1, ... of `seed`.
    seed : int
    stress : (m,) array, optional
        Levels of the critical stress, Pa, rising; by default 1024 over the sampled range.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> found = st.theory.rice_distribution(problem, strength, profiles=64)
    >>> bool(found.quantile(0.05) < found.quantile(0.5))
    True
    """
    unit, load, initial = stationary(problem, strength)
    if stress is not None and not (
        stress.ndim == 1 and stress.size and (np.diff(stress) > 0).all()
    ):
        raise InputError("stress: must be a (m,) array of rising levels, Pa")
    interface, plane, factor, together = problem.interface, problem.interface.is_plane, 1, BATCH
    if plane:  # the onset is at a node
        together = max(1, MOST_NODES // interface.size)
    else:  # a dip that only just reaches down between two nodes is a crossing as well
        factor = math.ceil(ENOUGH_POINTS * interface.spacing / problem.nucleation_length)
    points = factor * interface.size

    def batches() -> Iterator[Array]:
        for first in range(0, profiles, together):
            count = min(together, profiles - first)
            tau_p = unit * strength.sample(interface, samples=count, seed=seed, first=first)
            tau = initial + load * nucleation_stress(problem, tau_p)
            yield tau if factor == 1 else _refined(tau, points)

    levels = stress
    if levels is None:
        # Two passes over the same samples instead of keeping them: memory does not grow with them.
        ends = [(float(tau.min()), float(tau.max())) for tau in batches()]
        levels = np.linspace(min(low for low, _ in ends), max(high for _, high in ends), LEVELS)
    crossings, below, reached = np.zeros((3, levels.size + 1), dtype=np.int64)
    for tau in batches():
        if plane:
            _count_dips(np.searchsorted(levels, tau), crossings, below, reached)
        else:
            _count_crossings(tau, levels, crossings, below, reached)
    seen, samples = np.cumsum(crossings)[:-1], np.cumsum(reached)[:-1]
    survival = 1.0 - np.cumsum(below)[:-1] / (profiles * points)
    if plane:
        # High up, holes outnumber parts; but an interface is below a level if any node is.
        chance = np.maximum(-np.expm1(-np.maximum(seen, 0) / profiles), 1.0 - survival)
        good = seen <= MOST_DIPS * samples
    else:
        with np.errstate(divide="ignore", invalid="ignore"):
            exponent = np.where(survival > 0.0, seen / profiles / survival, np.inf)
        chance = 1.0 - np.clip(survival, 0.0, 1.0) * np.exp(-exponent)
        good = 1.0 - survival <= MOST_BELOW * np.maximum.accumulate(chance)
    chance = np.maximum.accumulate(chance)
    return RiceDistribution(
        stress=levels,
        probability=chance,
        crossing_rate=seen / (profiles * interface.extent),
        point_survival=survival,
        relative_error=1.0 / np.sqrt(np.maximum(samples, 1)),
        trusted=(chance <= TRUSTED_PROBABILITY) & (samples >= FEWEST_PROFILES) & good,
        profiles=profiles,
    )


@jit
def _count_dips(
    level: NDArray[np.int64],
    dips: NDArray[np.int64],
    below: NDArray[np.int64],
    reached: NDArray[np.int64],
) -> None:
    """Steps whose cumulative sums count dips, nodes and samples at or below each level.

    `level` is the number of the first level at or above the value of each node. `dips` is
    the Euler characteristic, nodes less edges plus faces of the periodic grid.
    """
    samples, nx, ny = level.shape
    for sample in range(samples):
        lowest = level[sample, 0, 0]
        for i in range(nx):
            for j in range(ny):
                here = level[sample, i, j]
                along = max(here, level[sample, (i + 1) % nx, j])
                across = max(here, level[sample, i, (j + 1) % ny])
                beyond = level[sample, (i + 1) % nx, (j + 1) % ny]
                dips[here] += 1
                dips[along] -= 1
                dips[across] -= 1
                dips[max(along, across, beyond)] += 1
                below[here] += 1
                lowest = min(lowest, here)
        reached[lowest] += 1


def _refined(rows: Array, points: int) -> Array:
    """Rows evaluated at more points, by their trigonometric interpolant."""
    spectrum = np.fft.rfft(rows, axis=1)
    spectrum[:, -1] *= 0.5  # the highest wave of an even grid stands for both of its signs
    result: Array = np.fft.irfft(spectrum, points, axis=1) * (points / rows.shape[1])
    return result


@jit
def _count_crossings(
    rows: Array,
    levels: Array,
    crossings: NDArray[np.int64],
    below: NDArray[np.int64],
    reached: NDArray[np.int64],
) -> None:
    """Steps whose cumulative sums count down-crossings of each level, and nodes and rows below."""
    for row in range(rows.shape[0]):
        lowest = levels.size
        before = rows[row, rows.shape[1] - 1]
        stop = np.searchsorted(levels, before)
        for i in range(rows.shape[1]):
            now = rows[row, i]
            # A fall crosses the levels from the first one at or above its end to that of its start.
            start = np.searchsorted(levels, now)
            below[start] += 1
            lowest = min(lowest, start)
            if now < before:
                crossings[start] += 1
                crossings[stop] -= 1
            before, stop = now, start
        reached[lowest] += 1
