"""Sweeps over values of keys.

Axes are combined, and the keys on an axis vary together.
"""

import dataclasses
import math
import numbers
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer

from stiction.base.errors import InputError, prefixed, unknown_name
from stiction.base.model import describe, to_plain
from stiction.base.variables import UNITS, Variable, unit_of_key
from stiction.ensemble.dataset import Coordinates, GridAxes
from stiction.random.dotted_keys import SHORT_KEYS, full_key

SWEPT = "problem", "random", "method", "seed"
"""Keys of a study that a sweep may change, together with the keys below
them."""
MOST_POINTS = 100_000
SELECTION_KEYWORDS = ("method", "tolerance", "drop", "indexers", "missing_dims")
"""Keywords of xarray's `sel` and `isel`, which cannot be names of
dimensions."""

Axis: TypeAlias = dict[str, list[Any]]
"""Keys that vary together, each with a value for each step."""


class Point(NamedTuple):
    """A sweep point: its number, and the value of every swept key."""

    number: int
    values: dict[str, Any]

    def __str__(self) -> str:
        values = ", ".join(f"{key} = {_text(value)}" for key, value in self.values.items())
        return f"point {self.number} ({values})" if values else f"point {self.number}"


def _values(key: str, given: Any) -> list[Any]:
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, list | tuple) or not given:
        raise InputError(f"{key}: must be a list of values, got {describe(given)}")
    return [one.tolist() if isinstance(one, np.generic | np.ndarray) else one for one in given]


def _axis(given: Any) -> Axis:
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"must be a table of keys and their values, got {describe(given)}")
    axis = {
        key: [math.inf if one == "inf" else one for one in _values(key, values)]
        for key, values in _flat(given).items()
    }
    if len({len(values) for values in axis.values()}) > 1:
        named = ", ".join(f"{key} has {len(values)}" for key, values in axis.items())
        raise InputError(
            "keys of a [[sweep]] table vary together and need the same number of values"
            f" ({named}). To cross them, give each key its own [[sweep]]"
        )
    return axis


def _flat(given: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return a table with dotted keys.

    TOML reads an unquoted ``a.b = 1`` as nested tables.
    """
    result: dict[str, Any] = {}
    for key, value in given.items():
        inner = value.values() if isinstance(value, Mapping) else ()
        if any(isinstance(one, Mapping | list | tuple | np.ndarray) for one in inner):
            result |= _flat(value, f"{prefix}{key}.")
        else:
            result[f"{prefix}{key}"] = value
    return result


def _long(key: str) -> str:
    return full_key(key) if key.split(".")[0] in SHORT_KEYS else key


def read_axes(given: Any) -> list[Axis]:
    """Return the axes of a sweep from tables in a study."""
    if not isinstance(given, list | tuple):
        raise InputError(f"must be a list of tables, each a [[sweep]], got {describe(given)}")
    axes: list[Axis] = []
    for number, table in enumerate(given):
        with prefixed(f"[{number}]"):
            # Keys of the strength may omit their beginning, as in a prior.
            axes.append({_long(key): values for key, values in _axis(table).items()})
    keys = [key for axis in axes for key in axis]
    problems: dict[str, None] = {}
    for key in keys:
        table = key.split(".")[0]
        inside = [longer for longer in keys if f"{longer}.".startswith(f"{key}.")]
        if table not in SWEPT:
            problems[unknown_name(key, table, SWEPT)] = None
        elif len(inside) > 1:
            problems[f"{key}: is swept twice, by {' and '.join(inside)}"] = None
    points = math.prod(len(next(iter(axis.values()))) for axis in axes)
    if points > MOST_POINTS:
        problems[f"makes {points} points, more than the limit of {MOST_POINTS}"] = None
    if problems:
        raise InputError(problems)
    return axes


def _plain_axes(axes: Sequence[Axis]) -> list[Axis]:
    def plain(value: Any) -> Any:
        if dataclasses.is_dataclass(value):
            return to_plain(value)
        return "inf" if value == math.inf else value

    return [{key: list(map(plain, values)) for key, values in axis.items()} for axis in axes]


Sweep: TypeAlias = Annotated[Any, BeforeValidator(read_axes), PlainSerializer(_plain_axes)]
"""Axes that are crossed: tables of dotted keys that vary together, with
lists of values."""


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    kind = value.get("type") if isinstance(value, Mapping) else getattr(value, "type", None)
    return str(kind) if kind else describe(value)


def _unit(key: str, coefficients: Collection[str]) -> str:
    """Return the unit of the values of a key. Values of `coefficients` have no unit."""
    of_field = key.split(".")[1] if "." in key else ""
    return unit_of_key(key, "1" if of_field in coefficients else UNITS.get(of_field, "1"))


def grid_axes(
    axes: Sequence[Axis], taken: Collection[str], coefficients: Collection[str]
) -> GridAxes:
    """Return the axes as dimensions of a result.

    The name of an axis is the last part of its key, or the whole key if
    the last part is ambiguous or a keyword of xarray. The axis for the
    key 'method' is called 'onset_method'.
    """
    keys = [key for axis in axes for key in axis]
    last = {key: key.rpartition(".")[2] for key in keys}
    count = Counter([*last.values(), *taken, *(2 * SELECTION_KEYWORDS)])
    names = {
        key: key.replace(".", "_") if count[end] > 1 or ".correlation." in key else end
        for key, end in last.items()
    }
    names |= {key: f"onset_{key}" for key, name in names.items() if name in SELECTION_KEYWORDS}
    result: dict[str, Coordinates] = {}
    for axis in axes:
        dim = names[next(iter(axis))]
        coordinates = result[dim] = {}
        for key, values in axis.items():
            labels = _labels(values)
            number = labels.dtype.kind in "if"
            unit = _unit(key, coefficients) if number else "1"
            if unit != "1":  # to be shown in other units
                labels = labels.astype(float)
            coordinates[names[key]] = (labels, Variable(unit, key, (dim,)))
    return result


def _labels(values: Sequence[Any]) -> NDArray[Any]:
    """Return numbers unchanged, and names for other values.

    Repeated names get a number.
    """
    if all(isinstance(value, numbers.Real) and not isinstance(value, bool) for value in values):
        return np.array(values)
    texts = [value if isinstance(value, str) else _text(value) for value in values]
    if len(set(texts)) < len(texts):  # two tables of one type, say
        texts = [f"{number}: {text}" for number, text in enumerate(texts)]
    return np.array(texts, dtype=object)
