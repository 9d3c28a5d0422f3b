"""Marginal distributions: how strength is distributed at a point."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
import scipy.stats
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema, model_validator
from scipy.special import ndtr

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.model import Positive, Real, _number, model
from stiction.random.families import FAMILIES


@model(kw_only=True)
class Beta:
    """Beta distribution on [low, high].

    Parameters
    ----------
    alpha, beta : float
        Shape parameters, positive.
    low, high : float
        Bounds, Pa, low < high.

    Raises
    ------
    InputError
        If a shape is not positive or the bounds are not in order.

    Examples
    --------
    >>> import stiction as st
    >>> float(st.Beta(alpha=1.0, beta=1.0, low=1e6, high=2e6).distribution.mean())  # uniform
    1500000.0
    """

    alpha: Positive
    beta: Positive
    low: Real
    high: Real
    type: Literal["beta"] = "beta"

    @model_validator(mode="after")
    def _ordered(self) -> Beta:
        if not self.low < self.high:
            raise InputError(f"low must be below high, got low={self.low:g}, high={self.high:g}")
        return self

    @property
    def distribution(self) -> Any:
        """The same as a frozen `scipy.stats` distribution."""
        return _frozen_beta(self.alpha, self.beta, self.low, self.high)


@lru_cache(maxsize=64)
def _frozen_beta(alpha: float, beta: float, low: float, high: float) -> Any:
    """Kept, because to freeze a distribution takes scipy a millisecond, and a sweep has many."""
    return scipy.stats.beta(alpha, beta, low, high - low)


@dataclass(frozen=True)
class ScipyMarginal:
    """A continuous `scipy.stats` distribution, known by name and parameters.

    Attributes
    ----------
    type : str
        scipy's name.
    parameters : tuple of (str, float)
        Shapes, loc and scale that were given.
    """

    type: str
    parameters: tuple[tuple[str, float], ...]

    @cached_property
    def distribution(self) -> Any:
        """The frozen distribution."""
        return getattr(scipy.stats, self.type)(**dict(self.parameters))


@dataclass(frozen=True)
class PythonMarginal:
    """A distribution that scipy does not know by name: for Python only, equal to itself only.

    Attributes
    ----------
    distribution
        The frozen distribution.
    """

    distribution: Any


def _continuous_names() -> list[str]:
    return [
        name
        for name in dir(scipy.stats)
        if isinstance(getattr(scipy.stats, name), scipy.stats.rv_continuous)
    ]


def _parameter_names(family: Any) -> list[str]:
    shapes = family.shapes.replace(" ", "").split(",") if family.shapes else []
    return [*shapes, "loc", "scale"]


def scipy_marginal(name: str, parameters: dict[str, Any]) -> ScipyMarginal:
    """A distribution by scipy's name for it and its parameters, checked."""
    names = [*_continuous_names(), *FAMILIES]
    if name not in names:
        valid = ["beta", *FAMILIES, "lognorm", "weibull_min", "truncnorm", "uniform", "norm"]
        text = unknown_name("type", name, names).split(" (valid:")[0]
        raise InputError(f"{text} (valid: {', '.join(valid)} and scipy.stats' other continuous)")
    known = _parameter_names(getattr(scipy.stats, name))
    problems = [unknown_name(name, key, known) for key in parameters if key not in known]
    problems += [
        f"{name}.{key}: missing" for key in known[:-2] if key not in parameters and not problems
    ]
    for key, value in parameters.items():
        try:
            finite = bool(np.isfinite(_number(value)))
        except ValueError:
            finite = False
        if not finite:
            problems.append(f"{name}.{key}: must be a finite number, got {value!r}")
    if problems:
        raise InputError(problems)
    result = ScipyMarginal(name, tuple((k, float(v)) for k, v in parameters.items()))
    _check_moments(name, result.distribution, parameters)
    return result


def _check_moments(name: str, distribution: Any, parameters: Any) -> None:
    mean, deviation = distribution.mean(), distribution.std()
    if not (np.isfinite(mean) and np.isfinite(deviation) and deviation > 0.0):
        raise InputError(
            f"{name}: must have a finite mean and a positive, finite standard deviation,"
            f" got {mean:g} and {deviation:g} from {parameters}"
        )


def _frozen(family: Any) -> Any:
    """A distribution without parameters, such as a histogram, as a frozen one; others are refused.

    A named family without its parameters would stand at 0 Pa with a width of 1 Pa.
    """
    name = str(getattr(family, "name", None) or type(family).__name__)
    known = type(family) is type(getattr(scipy.stats, name, None))
    if known or family.shapes:
        given = ", ".join(f"{key}=..." for key in _parameter_names(family))
        raise InputError(
            f"scipy.stats.{name} is a family without parameters; freeze it by giving them:"
            f" scipy.stats.{name}({given}), loc and scale in Pa"
        )
    return family()


def _marginal(value: Any) -> Any:
    if isinstance(value, (Beta, ScipyMarginal, PythonMarginal, *FAMILIES.values())):
        return value
    if isinstance(value, dict):
        given = dict(value)
        name = given.pop("type", None)
        if name is None:
            raise InputError("type: missing; name a distribution, such as type = 'beta'")
        if name == "beta" and not {"a", "b"} & set(given):
            return Beta(**given)
        if name in FAMILIES and not (name == "gamma" and {"a", "loc", "scale"} & set(given)):
            return FAMILIES[name](**given)
        return scipy_marginal(str(name), given)
    family = getattr(value, "dist", None)
    if isinstance(value, scipy.stats.rv_continuous):
        return _marginal(_frozen(value))
    if not isinstance(family, scipy.stats.rv_continuous):
        raise InputError(
            "must be st.Beta(...), st.Lognormal(...) or a frozen continuous scipy.stats"
            f" distribution such as scipy.stats.lognorm(0.3, scale=1e6), got {type(value).__name__}"
        )
    name = str(getattr(family, "name", ""))
    if type(family) is not type(getattr(scipy.stats, name, None)):
        _check_moments(type(family).__name__, value, value.args)
        return PythonMarginal(value)
    parameters = dict(zip(_parameter_names(family), value.args, strict=False)) | value.kwds
    return scipy_marginal(name, parameters)


def _serialise(value: Any) -> Any:
    if isinstance(value, PythonMarginal):
        name = type(value.distribution.dist).__name__
        raise ValueError(f"marginal is the Python distribution {name!r}; use one that scipy names")
    if isinstance(value, (Beta, *FAMILIES.values())):
        own: Any = value
        known = {field.name: getattr(own, field.name) for field in fields(own)}
        return {name: one for name, one in known.items() if one is not None}
    return {"type": value.type, **dict(value.parameters)}


Marginal: TypeAlias = Annotated[
    Any,
    BeforeValidator(_marginal),
    PlainSerializer(_serialise),
    WithJsonSchema(
        {
            "type": "object",
            "description": "type = 'beta' with alpha, beta, low, high; 'lognormal', 'weibull',"
            " 'gamma' or 'truncated_normal' with mean, cv and low; or the name of a continuous"
            " scipy.stats distribution with its shapes, loc and scale",
            "properties": {"type": {"type": "string"}},
            "required": ["type"],
        }
    ),
]
"""`Beta`, `Lognormal` and the like, or any frozen continuous `scipy.stats` distribution."""


def quantile_of_normal(distribution: Any, z: Array) -> Array:
    """F^-1(Phi(z)) by scipy, through the survival function above the median.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution
    z : array

    Returns
    -------
    array of the shape of `z`

    Notes
    -----
    Grigoriu (1995): translation process. Phi(z) rounds to 1 long before z = 8; the upper tail
    keeps its digits only through 1 - Phi(z) = Phi(-z), and only where scipy computes the inverse
    survival function of the family directly.
    """
    z = np.asarray(z, dtype=np.float64)
    tail = ndtr(-np.abs(z))
    lower = distribution.ppf(np.where(z < 0.0, tail, 0.5))
    upper = distribution.isf(np.where(z < 0.0, 0.5, tail))
    result: Array = np.where(z < 0.0, lower, upper)
    return result
