"""Parameters and their values by dotted keys, such as ``random.strength.marginal.low``."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.stats

from stiction.base.errors import InputError
from stiction.base.model import check, describe, is_finite
from stiction.base.variables import PROFILES
from stiction.random.marginals import Marginal, MarginalObject, ScipyMarginal

INTERFACE_KEYS = (*PROFILES, "correlation", "between")
FIELD_KEYS = ("marginal", "spectrum", "anisotropy", "conditions")
"""Keys of a random interface, and of a field."""
SHORT_KEYS = (*INTERFACE_KEYS, *FIELD_KEYS, "correlation_length", "exponent")
"""Beginnings of keys that may omit ``random`` or ``random.strength``."""
MARGINAL_KEYS = ("mean", "cv", "low", "high", "scale", "alpha", "beta")
"""Parameters of a marginal, whose keys begin with its name."""


def with_values(owner: Any, values: Mapping[str, Any], path: str = "") -> Any:
    """Copy a model object, or a list of model objects, and set values by dotted keys.

    Messages begin with `path`, the dotted key that leads to the object.
    Raises an `InputError` if a value is invalid, or if a key does not
    exist. The message then names the nearest valid key.

    >>> import stiction as st
    >>> field = st.RandomField(st.Lognormal(mean=2e6, cv=0.25), st.PowerLawSpectrum(0.01))
    >>> values = {
    ...     "marginal.cv": 0.5,
    ...     "spectrum.exponent": 3.0,
    ...     "marginal.low": 1e6,
    ...     "anisotropy": 7.0,
    ... }
    >>> changed = with_values(field, values)
    >>> changed.marginal, changed.anisotropy
    (Lognormal(mean=2000000.0, cv=0.5, low=1000000.0), 7.0)
    >>> changed.spectrum
    PowerLawSpectrum(correlation_length=0.01, exponent=3.0)
    >>> with_values([{"a": 1, "b": {"c": 2}}, {"a": 3}], {"b.c": 4, "b.d.e": 5})
    [{'a': 1, 'b': {'c': 4, 'd': {'e': 5}}}, {'a': 3, 'b': {'c': 4, 'd': {'e': 5}}}]
    >>> with_values(ScipyMarginal("norm", (("loc", 2.0), ("scale", 0.5))), {"scale": 0.25})
    {'type': 'norm', 'loc': 2.0, 'scale': 0.25}
    >>> def message(owner, values, path=""):
    ...     try:
    ...         with_values(owner, values, path)
    ...     except InputError as error:
    ...         return str(error)
    >>> message(field, {"spectrum.exponent": 99.0})
    'spectrum.exponent: must be less than or equal to 64, got 99.0'
    >>> message(field, {"spectrum.exponent": 99.0}, "random.strength")
    'random.strength.spectrum.exponent: must be less than or equal to 64, got 99.0'
    >>> message(field, {"anisotropy": -1.0})
    'anisotropy: must be greater than 0, got -1.0'
    """
    if isinstance(owner, list):
        return [with_values(member, values, path) for member in owner]
    changes: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        name, _, rest = key.partition(".")
        if rest:
            inside.setdefault(name, {})[rest] = value
        else:
            changes[name] = value
    if isinstance(owner, ScipyMarginal):
        owner = {"type": owner.type, **dict(owner.parameters)}
    table = isinstance(owner, Mapping)
    if not table and not (dataclasses.is_dataclass(owner) and not isinstance(owner, type)):
        raise InputError(f"{path}: has no keys, because it is {describe(owner)}")
    # Values below a key replace the object there, from the inside outwards.
    for name, below in inside.items():
        inner = owner.get(name) if table else getattr(owner, name, None)
        place = f"{path}.{name}".removeprefix(".")
        changes[name] = with_values({} if inner is None else inner, below, place)
    if table:
        return {**owner, **changes}
    try:
        return dataclasses.replace(owner, **changes)
    except InputError as error:
        # The path replaces the name of the class, which a user of keys
        # does not know.
        kind, begin = type(owner).__name__, path or "sweep"
        texts = (text.replace(kind, begin, 1) for text in error.problems)
        raise InputError([text.removeprefix("sweep.") for text in texts]) from None


def value_at(owner: Any, key: str) -> Any:
    """Return the value at a dotted key of a model object, or None.

    >>> import stiction as st
    >>> field = st.RandomField(st.Lognormal(mean=2e6, cv=0.25), st.PowerLawSpectrum(0.01))
    >>> value_at(field, "marginal.cv"), value_at(field, "marginal"), value_at(field, "a.cv")
    (0.25, Lognormal(mean=2000000.0, cv=0.25), None)
    """
    for name in key.split("."):
        owner = getattr(owner, name, None)
    return owner


def full_key(key: str) -> str:
    """Return the full key, as in a sweep.

    Keys that belong to the strength may omit the prefix.

    >>> full_key("problem.friction.critical_slip"), full_key("random.between.strength")
    ('problem.friction.critical_slip', 'random.between.strength')
    >>> full_key("residual_strength.marginal.low"), full_key("between.strength.cv")
    ('random.residual_strength.marginal.low', 'random.between.strength.cv')
    >>> full_key("marginal.low"), full_key("correlation.strength.critical_slip")
    ('random.strength.marginal.low', 'random.correlation.strength.critical_slip')
    >>> {full_key("exponent"), full_key("spectrum.exponent")}
    {'random.strength.spectrum.exponent'}
    >>> full_key("anisotropy"), full_key("conditions.noise")
    ('random.strength.anisotropy', 'random.strength.conditions.noise')
    >>> full_key("low")
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: unknown 'low'; did you mean 'marginal.low'?
    """
    first = key.split(".")[0]
    if first in ("problem", "random"):
        return key
    if first in INTERFACE_KEYS:
        return f"random.{key}"
    if first in FIELD_KEYS:
        return f"random.strength.{key}"
    if first in MARGINAL_KEYS:
        raise InputError(f"unknown {key!r}; did you mean 'marginal.{key}'?")
    return f"random.strength.spectrum.{key}"


def short_key(key: str) -> str:
    """Return the key under which a parameter is printed. `full_key` is its inverse.

    >>> short_key("random.strength.spectrum.exponent"), short_key("correlation_length")
    ('exponent', 'correlation_length')
    >>> (
    ...     short_key("random.strength.marginal.cv"),
    ...     short_key("random.residual_strength.marginal.cv"),
    ... )
    ('marginal.cv', 'residual_strength.marginal.cv')
    >>> short_key("random.strength"), short_key("problem.load.normal_pressure")
    ('strength', 'problem.load.normal_pressure')
    """
    short = full_key(key).removeprefix("random.")
    for begin in ("strength.spectrum.", "strength."):
        rest = short.removeprefix(begin)
        if rest != short and full_key(rest) == full_key(key):
            return rest
    return short


def distributions_of(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return frozen distributions by short key, or raise an `InputError` with all mistakes.

    >>> laws = distributions_of(
    ...     {"exponent": [1.0, 3.0], "random.strength.anisotropy": (2.0, 7.0)}
    ... )
    >>> [(name, float(law.mean())) for name, law in laws.items()]
    [('exponent', 2.0), ('anisotropy', 4.5)]
    >>> try:
    ...     distributions_of(
    ...         {"exponent": (1.0, 3.0), "spectrum.exponent": (1.0, 2.0), "cv": 3.0}
    ...     )
    ... except InputError as error:
    ...     print(error)
    spectrum.exponent is given twice, under two names. Leave either out
    unknown 'cv'; did you mean 'marginal.cv'?
    """
    problems: list[str] = []
    distributions: dict[str, Any] = {}
    for key, value in given.items():
        try:
            # A name and its full key are the same parameter.
            name = short_key(str(key))
            if name in distributions:
                problems.append(f"{key} is given twice, under two names. Leave either out")
            distributions[name] = distribution_of(str(key), value)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return distributions


def distribution_of(key: str, value: Any) -> Any:
    """Return a frozen distribution, given a distribution, two ends or a table {low, high, spacing}.

    A marginal of a field, or its table, is also accepted.

    >>> law = distribution_of("anisotropy", (2.0, 8.0))
    >>> float(law.mean()), distribution_of("anisotropy", law) is law
    (5.0, True)
    >>> law = distribution_of("anisotropy", {"low": 2.0, "high": 8.0, "spacing": "log"})
    >>> round(float(law.median()), 9)
    4.0
    >>> table = {"type": "beta", "alpha": 1.0, "beta": 3.0, "low": 2.0, "high": 6.0}
    >>> float(distribution_of("between.strength", table).mean())
    3.0
    >>> float(distribution_of("anisotropy", {"low": 0.0, "high": 8.0}).mean())
    4.0
    >>> distribution_of("anisotropy", (2.0, 2.0))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: anisotropy: must be a range ... {'low': 2.0, 'high': 2.0}
    >>> distribution_of(
    ...     "anisotropy", {"low": 2.0, "high": 8.0, "step": 1.0}
    ... )  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: anisotropy: must be a range (low, high)... 'step': 1.0}
    """
    if isinstance(value, Marginal) or (isinstance(value, Mapping) and "type" in value):
        return check(key, value, MarginalObject).distribution
    if isinstance(getattr(value, "dist", None), scipy.stats.rv_continuous):
        return value
    if isinstance(value, list | tuple) and len(value) == 2:
        value = {"low": value[0], "high": value[1]}
    table = {"spacing": "linear"} | dict(value) if isinstance(value, Mapping) else {}
    low, high, spacing = (table.get(name, np.nan) for name in ("low", "high", "spacing"))
    valid = len(table) == 3 and is_finite(low) and is_finite(high) and low < high
    if valid and spacing == "linear":
        return scipy.stats.uniform(low, high - low)
    if valid and spacing == "log" and low > 0.0:
        return scipy.stats.loguniform(low, high)
    raise InputError(
        f"{key}: must be a range (low, high), a frozen scipy.stats distribution, or a table {{low,"
        f" high, spacing = 'linear' or 'log'}} or {{type, mean, cv, ...}}, got {describe(value)}"
    )
