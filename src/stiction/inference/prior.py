"""The prior: the unknown parameters, and their distributions before the tests."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed
from stiction.base.model import describe
from stiction.inference.grid import PosteriorGrid
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import distributions_of, full_key, with_values
from stiction.random.fields import RandomField, RandomInterface, as_random_interface

TAIL_PROBABILITY = 1e-4
"""Probability that is cut from either end of a prior whose density is zero there."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Independent priors of some parameters of a problem and of what is random on it.

    Frozen `scipy.stats` distributions by the keys that the user gave. Points are given by `u`, one
    number in [0, 1] for each parameter: the prior is uniform in them. Arrays have shape (points,
    parameters). The values that `problem` and `random` hold for these parameters are replaced.
    """

    problem: Problem
    random: RandomInterface
    distributions: dict[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Keys of the parameters, in order."""
        return tuple(self.distributions)

    @property
    def dimension(self) -> int:
        """Number of parameters."""
        return len(self.distributions)

    @property
    def middle(self) -> Array:
        """Medians, (parameters,)."""
        return self.theta(np.full((1, self.dimension), 0.5))[0]

    @property
    def whole(self) -> Array:
        """The unit cube: its lower and upper corner, (2, parameters)."""
        return np.repeat([[0.0], [1.0]], self.dimension, axis=1)

    @property
    def ends(self) -> Array:
        """Least and greatest values, (2, parameters)."""
        return self.theta(self.whole)

    def quantile(self, share: float) -> Array:
        """Return a quantile of each parameter, (parameters,)."""
        return self.theta(np.full((1, self.dimension), share))[0]

    def information(self, grid: PosteriorGrid) -> dict[str, float]:
        """Return the divergence of the posterior of each parameter alone from its prior, nats."""
        return {name: grid.information(i) for i, name in enumerate(self.names)}

    def theta(self, u: Array) -> Array:
        """Return the parameters at `u`, by the inverse distribution functions."""
        result = np.empty_like(u)
        for i, distribution in enumerate(self.distributions.values()):
            low, high = _tails(distribution)
            result[:, i] = distribution.ppf(low + (high - low) * u[:, i])
        return result

    def u(self, theta: Array) -> Array:
        """Return the inverse of `theta`; outside [0, 1] is outside the prior."""
        result = np.empty_like(theta)
        for i, distribution in enumerate(self.distributions.values()):
            low, high = _tails(distribution)
            result[:, i] = (distribution.cdf(theta[:, i]) - low) / (high - low)
        low, high = self.ends
        return np.where((theta < low) | (theta > high), -1.0, result)

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """Return the problem and what is random at one point (parameters,)."""
        with self.named(theta):
            return with_parameters(self.problem, self.random, self.names, theta)

    @contextmanager
    def named(self, theta: Array) -> Iterator[None]:
        """Begin the messages of errors raised meanwhile with the point (parameters,)."""
        pairs = zip(self.names, theta, strict=True)
        with prefixed("prior: at " + ", ".join(f"{name} = {v:.4g}" for name, v in pairs)):
            yield


def with_parameters(
    problem: Problem, random: RandomInterface, names: Sequence[str], values: Array
) -> tuple[Problem, RandomInterface]:
    """Return both with some parameters replaced, by the keys of a prior."""
    keys = dict(zip(map(full_key, names), values.tolist(), strict=True))
    both = with_values({"problem": problem, "random": random}, keys)
    return both["problem"], both["random"]


def refuse_conditioned(interfaces: Iterable[RandomInterface]) -> None:
    """Refuse fields that are conditioned on what was measured of one specimen."""
    for interface in interfaces:
        for name, field in interface.properties.items():
            if field.conditions is not None:
                raise InputError(
                    f"random: {name} is conditioned on one specimen, but the peaks are of others;"
                    " pass it without `given`"
                )


@lru_cache(maxsize=64)
def _tails(distribution: Any) -> tuple[float, float]:
    low, high = (
        0.0 if np.isfinite(end) and distribution.pdf(end) > 0.0 else TAIL_PROBABILITY
        for end in distribution.support()
    )
    return low, 1.0 - high


def make_prior(problem: Problem, random: Any, given: Any) -> Prior:
    """Return the prior of these arguments, or raise one `InputError` with all that is wrong."""
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "prior: must map parameters to distributions or ranges, such as"
            f" {{'correlation_length': (1e-3, 1e-2)}}, got {describe(given)}"
        )
    with prefixed("prior"):
        distributions = distributions_of(given)
    if not isinstance(random, RandomField | RandomInterface):
        raise InputError(
            "prior: is of one random field or interface; leave it out where a fit or a list of"
            " interfaces holds what is known already"
        )
    random = as_random_interface(random)
    refuse_conditioned([random])
    prior = Prior(problem, random, distributions)
    for corner in itertools.product(*prior.ends.T):
        prior.at(np.array(corner))
    return prior
