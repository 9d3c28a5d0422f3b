"""The prior: unknown parameters and their distributions before the tests."""

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
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import distributions_of, full_key, short_key, with_values
from stiction.random.fields import RandomField, RandomInterface, as_random_interface

TAIL_PROBABILITY = 1e-4
"""Probability that is cut off at an end of a prior if its density is zero there."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Independent priors for some parameters of a problem and its random interface.

    `distributions` maps the user's keys to frozen distributions of
    `scipy.stats`. A point is given by `u`, which holds a number in [0,
    1] for each parameter. The prior is uniform in `u`. Arrays have
    shape (points, parameters). The parameters replace values in
    `problem` and `random`.
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
        """Medians of the parameters."""
        return self.theta(np.full((1, self.dimension), 0.5))[0]

    @property
    def whole(self) -> Array:
        """Lower and upper corner of the unit cube, with shape (2, parameters)."""
        return np.repeat([[0.0], [1.0]], self.dimension, axis=1)

    @property
    def ends(self) -> Array:
        """Least and greatest values, with shape (2, parameters)."""
        return self.theta(self.whole)

    def theta(self, u: Array) -> Array:
        """Return the parameters at `u`, from inverse distribution functions."""
        result = np.empty_like(u)
        for i, distribution in enumerate(self.distributions.values()):
            # An infinite end, or an end without density, cannot be simulated.
            low, high = _tails(distribution)
            result[:, i] = distribution.ppf(low + (high - low) * u[:, i])
        return result

    def u(self, theta: Array) -> Array:
        """Return the inverse of `theta`. A point outside the prior is outside [0, 1]."""
        result = np.empty_like(theta)
        for i, distribution in enumerate(self.distributions.values()):
            low, high = _tails(distribution)
            result[:, i] = (distribution.cdf(theta[:, i]) - low) / (high - low)
        low, high = self.ends
        return np.where((theta < low) | (theta > high), -1.0, result)

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a point (parameters,)."""
        with self.named(theta):
            return with_parameters(self.problem, self.random, self.names, theta)

    @contextmanager
    def named(self, theta: Array) -> Iterator[None]:
        """Let messages of errors that are raised meanwhile begin with the point (parameters,)."""
        pairs = zip(self.names, theta, strict=True)
        with prefixed("prior: at " + ", ".join(f"{name} = {v:.4g}" for name, v in pairs)):
            yield


def with_parameters(
    problem: Problem, random: RandomInterface, names: Sequence[str], values: Array
) -> tuple[Problem, RandomInterface]:
    """Return the problem and the random interface, with parameters replaced by keys of a prior."""
    keys = dict(zip(map(full_key, names), values.tolist(), strict=True))
    both = with_values({"problem": problem, "random": random}, keys)
    return both["problem"], both["random"]


def refuse_conditioned(interfaces: Iterable[RandomInterface]) -> None:
    """Refuse fields that are conditioned on the measured values of one specimen."""
    for interface in interfaces:
        for name, field in interface.properties.items():
            if field.conditions is not None:
                raise InputError(
                    f"random: {name} is conditioned on another specimen. Pass it without `given`"
                )


@lru_cache(maxsize=64)
def _tails(distribution: Any) -> tuple[float, float]:
    """Return the probabilities between which a prior is used."""
    low, high = (
        0.0 if np.isfinite(end) and distribution.pdf(end) > 0.0 else TAIL_PROBABILITY
        for end in distribution.support()
    )
    return low, 1.0 - high


def make_prior(problem: Problem, random: Any, given: Any) -> Prior:
    """Return the prior for these arguments, or raise an `InputError` that lists all mistakes."""
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "prior: must map parameters to distributions or ranges, such as"
            f" {{'correlation_length': (1e-3, 1e-2)}}. Got {describe(given)}"
        )
    with prefixed("prior"):
        distributions = distributions_of(given)
    if not isinstance(random, RandomField | RandomInterface):
        raise InputError(
            "prior: needs one random field or interface. Leave it out with a fit or a list"
        )
    random = as_random_interface(random)
    refuse_conditioned([random])
    distributions = {short_key(key): law for key, law in distributions.items()}
    prior = Prior(problem, random, distributions)
    # Parameters that are valid at all corners are valid between them.
    for corner in itertools.product(*prior.ends.T):
        prior.at(np.array(corner))
    return prior
