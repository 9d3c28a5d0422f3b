"""The prior: which parameters are not known, and what is thought of each before the tests."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import scipy.stats

from stiction.arrays import Array
from stiction.ensemble.dotted_keys import with_values
from stiction.errors import InputError
from stiction.model import describe, is_finite
from stiction.problem import Problem
from stiction.random.marginals import marginal_of
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, as_random_interface

TAIL = 1e-4
"""Probability that is cut from either end of a prior without bounds."""
MOST = 8
"""Parameters; a prior of more than these is a prior of nothing."""
_RANGE = ("low", "high", "spacing")


@dataclass(frozen=True, eq=False)
class Prior:
    """Independent priors of some parameters of a problem and of what is random on it.

    Points are known by `u`, numbers in [0, 1], one for each parameter: the prior is uniform in
    them. All functions here take (points, parameters) arrays.

    Attributes
    ----------
    problem : Problem
    random : RandomInterface
        With values for all that is known; those of unknown parameters are replaced.
    distributions : dict
        Frozen `scipy.stats` distributions by the keys that the user gave.
    """

    problem: Problem
    random: RandomInterface
    distributions: dict[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """The keys, in order."""
        return tuple(self.distributions)

    @property
    def dimension(self) -> int:
        """Number of parameters."""
        return len(self.distributions)

    def theta(self, u: Array) -> Array:
        """Parameters at `u`, by the inverse distribution functions."""
        result = np.empty_like(u)
        for i, distribution in enumerate(self.distributions.values()):
            low, high = _tails(distribution)
            result[:, i] = distribution.ppf(low + (high - low) * u[:, i])
        return result

    def u(self, theta: Array) -> Array:
        """The inverse of `theta`; outside [0, 1] is outside the prior."""
        result = np.empty_like(theta)
        for i, distribution in enumerate(self.distributions.values()):
            low, high = _tails(distribution)
            result[:, i] = (distribution.cdf(theta[:, i]) - low) / (high - low)
            ends = self.theta(np.array([[0.0] * self.dimension, [1.0] * self.dimension]))[:, i]
            result[theta[:, i] < ends[0], i] = -1.0
            result[theta[:, i] > ends[1], i] = 2.0
        return result

    def at(self, theta: Array) -> tuple[Problem, RandomInterface]:
        """The problem and what is random at one point (parameters,)."""
        return with_parameters(self.problem, self.random, self.names, theta)

    def text(self, theta: Array) -> str:
        """A point for people."""
        pairs = zip(self.names, theta, strict=True)
        return ", ".join(f"{name} = {value:.6g}" for name, value in pairs)

    def corners(self) -> Array:
        """The corners of the box of all priors, as `u`."""
        return np.array(list(itertools.product((0.0, 1.0), repeat=self.dimension)))


def with_parameters(
    problem: Problem, random: RandomInterface, names: Sequence[str], values: Array
) -> tuple[Problem, RandomInterface]:
    """The problem and what is random with some parameters replaced, by the keys of a prior."""
    replaced = {full_key(name): float(value) for name, value in zip(names, values, strict=True)}
    parts: dict[str, Any] = {"problem": problem, "random": random}
    for part, owner in parts.items():
        own = {
            key.removeprefix(f"{part}."): value
            for key, value in replaced.items()
            if key.startswith(f"{part}.")
        }
        if own:
            parts[part] = with_values(owner, own)
    return parts["problem"], parts["random"]


def _tails(distribution: Any) -> tuple[float, float]:
    low, high = distribution.support()
    return (0.0 if np.isfinite(low) else TAIL), (1.0 if np.isfinite(high) else 1.0 - TAIL)


def full_key(key: str) -> str:
    """A key as in a sweep: those of the strength may be given without where they stand."""
    first = key.split(".")[0]
    if first in ("problem", "random"):
        return key
    if first in {field.name for field in fields(RandomInterface)}:
        return f"random.{key}"
    if first in {field.name for field in fields(RandomField)}:
        return f"random.strength.{key}"
    return f"random.strength.spectrum.{key}"


def distribution_of(key: str, value: Any) -> Any:
    """A frozen distribution from one, from two ends, or from a table.

    Tables are {low, high, spacing}, or {type, ...} with scipy's name and parameters.
    """
    if hasattr(value, "ppf") and hasattr(value, "support"):
        if not hasattr(value, "args"):
            raise InputError(
                f"prior: {key}: must be a frozen distribution such as scipy.stats.uniform(1e-3,"
                f" 9e-3), got a family without parameters, {type(value).__name__}"
            )
        if isinstance(getattr(value, "dist", None), scipy.stats.rv_discrete):
            raise InputError(f"prior: {key}: must be a continuous distribution, got a discrete one")
        return value
    spacing = "linear"
    if isinstance(value, Mapping) and "type" in value:
        try:
            return marginal_of(dict(value)).distribution
        except InputError as error:
            raise InputError([f"prior: {key}: {text}" for text in error.problems]) from None
    if isinstance(value, Mapping):
        unknown = [name for name in value if name not in _RANGE]
        if unknown or not {"low", "high"} <= set(value):
            raise InputError(
                f"prior: {key}: a range is {{low = ..., high = ..., spacing = 'linear' or 'log'}},"
                f" got {describe(dict(value))}"
            )
        spacing, value = value.get("spacing", "linear"), (value["low"], value["high"])
    pair = isinstance(value, list | tuple) and len(value) == 2 and all(map(is_finite, value))
    if not pair or not value[0] < value[1]:
        raise InputError(
            f"prior: {key}: must be a frozen scipy.stats distribution or a range (low, high) with"
            f" low < high, got {describe(value)}"
        )
    low, high = map(float, value)
    if spacing == "linear":
        return scipy.stats.uniform(low, high - low)
    if spacing != "log" or low <= 0.0:
        raise InputError(
            f"prior: {key}: spacing must be 'linear', or 'log' of a positive range, got"
            f" {describe(spacing)} of {low:g} to {high:g}"
        )
    return scipy.stats.loguniform(low, high)


def make_prior(problem: Problem, random: Any, given: Any) -> Prior:
    """The prior of these arguments, or one `InputError` with all that is wrong with them."""
    if not isinstance(problem, Problem):
        raise InputError(f"problem: must be a Problem, got {describe(problem)}")
    random = as_random_interface(random)
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "prior: must map parameters to distributions or ranges, such as"
            f" {{'correlation_length': (1e-3, 1e-2)}}, got {describe(given)}"
        )
    if len(given) > MOST:
        raise InputError(f"prior: at most {MOST} parameters can be inferred, got {len(given)}")
    problems: list[str] = []
    found: dict[str, Any] = {}
    for key, value in given.items():
        if not isinstance(key, str):
            problems.append(f"prior: {describe(key)}: must be the name of a parameter")
            continue
        twice = [other for other in found if full_key(other) == full_key(key)]
        if twice:
            problems.append(f"prior: {key} and {twice[0]} are the same parameter")
        try:
            found[key] = distribution_of(key, value)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    prior = Prior(problem, random, found)
    ends = prior.theta(np.array([[0.0] * prior.dimension, [1.0] * prior.dimension]))
    for name, (low, high) in zip(prior.names, ends.T, strict=True):
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            problems.append(f"prior: {name}: is no distribution over a range, {low:g} to {high:g}")
    if problems:
        raise InputError(problems)
    for theta in prior.theta(prior.corners()):
        try:
            prior.at(theta)
        except InputError as error:
            raise InputError(
                [f"prior: at {prior.text(theta)}: {text}" for text in error.problems]
            ) from None
    return prior
