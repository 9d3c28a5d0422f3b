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
    r"""A sweep point: its number, and the value of every swept key.

    Examples
    --------
    >>> print(Point(3, {"seed": 7, "random.mean": 0.25}), Point(0, {}), sep="\n")
    point 3 (seed = 7, random.mean = 0.25)
    point 0
    """

    number: int
    values: dict[str, Any]

    def __str__(self) -> str:
        values = ", ".join(f"{key} = {_text(value)}" for key, value in self.values.items())
        return f"point {self.number} ({values})" if values else f"point {self.number}"


def _values(key: str, given: Any) -> list[Any]:
    """Return the values of a key as a list of plain values.

    >>> _values("a", np.array([1, 2])), _values("a", (np.float64(0.5), np.array([3, 5]), "inf"))
    ([1, 2], [0.5, [3, 5], 'inf'])
    >>> for given in ([], 3.0, "inf"):
    ...     try:
    ...         _values("seed", given)
    ...     except InputError as error:
    ...         print(error)
    seed: must be a list of values, got []
    seed: must be a list of values, got 3.0
    seed: must be a list of values, got 'inf'
    """
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, list | tuple) or not given:
        raise InputError(f"{key}: must be a list of values, got {describe(given)}")
    return [one.tolist() if isinstance(one, np.generic | np.ndarray) else one for one in given]


def _axis(given: Any) -> Axis:
    """Return the keys that vary together, with their values.

    >>> _axis({"seed": [3, 5], "problem": {"mode": ["II", "inf"]}})
    {'seed': [3, 5], 'problem.mode': ['II', inf]}
    >>> _axis({})
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: must be a table of keys and their values, got {}
    >>> _axis({"seed": [3, 5], "method": [7]})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: keys of ... values (seed has 2, method has 1). To cross them...
    """
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

    >>> _flat({"a": {"b": [1, 2], "c": {"d": (3,)}}, "e": np.array([5])})
    {'a.b': [1, 2], 'a.c.d': (3,), 'e': array([5])}
    >>> _flat({"a": {"type": "band", "width": 2.0}})  # a table that is itself a value
    {'a': {'type': 'band', 'width': 2.0}}
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
    """Return a key with the beginning that keys of the strength may omit.

    >>> for key in ("marginal.mean", "correlation_length", "seed", "random.strength"):
    ...     print(_long(key))
    random.strength.marginal.mean
    random.strength.spectrum.correlation_length
    seed
    random.strength
    """
    return full_key(key) if key.split(".")[0] in SHORT_KEYS else key


def read_axes(given: Any) -> list[Axis]:
    """Return the axes of a sweep from tables in a study.

    >>> read_axes([{"marginal.mean": [2.0, 7.0]}, {"seed": [3, 5], "method": ["a", "b"]}])
    [{'random.strength.marginal.mean': [2.0, 7.0]}, {'seed': [3, 5], 'method': ['a', 'b']}]
    >>> for given in ({}, [{"seed": []}], [{"samples": [3]}, {"seed": [5], "seeds.a": [3]}]):
    ...     try:
    ...         read_axes(given)
    ...     except InputError as error:
    ...         print(error)
    must be a list of tables, each a [[sweep]], got {}
    [0]: seed: must be a list of values, got []
    samples: unknown 'samples' (valid: problem, random, method, seed)
    seeds.a: unknown 'seeds'; did you mean 'seed'? (valid: problem, random, method, seed)
    >>> read_axes([{"random.a": [3]}, {"random.a.b": [5], "random.ab": [7]}])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: random.a: is swept twice, by random.a and random.a.b
    >>> len(read_axes([{"seed": [*range(1000)]}, {"random.a": [0.5] * 100}]))
    2
    >>> read_axes([{"seed": [*range(77)]}, {"random.a": [0.5] * 1300}])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: makes 100100 points, more than the limit of 100000
    """
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
    """Return axes for a study file.

    >>> import stiction as st
    >>> _plain_axes([{"method": [st.LocalCriterion()], "a": [math.inf]}, {"seed": [3]}])
    [{'method': [{'type': 'local_criterion'}], 'a': ['inf']}, {'seed': [3]}]
    """

    def plain(value: Any) -> Any:
        if dataclasses.is_dataclass(value):
            return to_plain(value)
        return "inf" if value == math.inf else value

    return [{key: list(map(plain, values)) for key, values in axis.items()} for axis in axes]


Sweep: TypeAlias = Annotated[Any, BeforeValidator(read_axes), PlainSerializer(_plain_axes)]
"""Axes that are crossed: tables of dotted keys that vary together, with
lists of values."""


def _text(value: Any) -> str:
    """Return a value in a few letters.

    >>> import stiction as st
    >>> [_text(value) for value in (0.25, 2e6, {"type": "band"}, st.LocalCriterion(), "II", 7)]
    ['0.25', '2e+06', 'band', 'local_criterion', "'II'", '7']
    """
    if isinstance(value, float):
        return f"{value:g}"
    kind = value.get("type") if isinstance(value, Mapping) else getattr(value, "type", None)
    return str(kind) if kind else describe(value)


def _unit(key: str, coefficients: Collection[str]) -> str:
    """Return the unit of the values of a key. Values of `coefficients` have no unit.

    >>> mean = "random.strength.marginal.mean"
    >>> _unit(mean, []), _unit(mean, ["strength"])
    ('Pa', '1')
    >>> _unit("problem.interface.length", []), _unit("seed", ["seed"]), _unit("random.a.noise", ())
    ('m', '1', '1')
    """
    of_field = key.split(".")[1] if "." in key else ""
    return unit_of_key(key, "1" if of_field in coefficients else UNITS.get(of_field, "1"))


def grid_axes(
    axes: Sequence[Axis], taken: Collection[str], coefficients: Collection[str]
) -> GridAxes:
    """Return the axes as dimensions of a result.

    The name of an axis is the last part of its key, or the whole key if
    the last part is ambiguous or a keyword of xarray. The axis for the
    key 'method' is called 'onset_method'.

    >>> mean, length = "random.strength.marginal.mean", "problem.interface.length"
    >>> axes = [{mean: [1, 2], "method": ["a", "b"]}, {length: [0.5]}, {"problem.load.mean": [3]}]
    >>> for dim, coordinates in grid_axes(axes, ["length"], []).items():
    ...     for name, (labels, variable) in coordinates.items():
    ...         print(dim, name, labels.tolist(), variable.units, variable.long_name == name)
    random_strength_marginal_mean random_strength_marginal_mean [1.0, 2.0] Pa False
    random_strength_marginal_mean onset_method ['a', 'b'] 1 False
    problem_interface_length problem_interface_length [0.5] m False
    problem_load_mean problem_load_mean [3] 1 False
    >>> axes = [{"random.correlation.slip": [0.5]}, {mean: [3]}, {"seed": [7]}]
    >>> [(dim, *map(str, axis)) for dim, axis in grid_axes(axes, [], ["strength"]).items()]
    [('random_correlation_slip', 'random_correlation_slip'), ('mean', 'mean'), ('seed', 'seed')]
    >>> grid_axes([{"seed": [7], mean: [3]}], [], [])["seed"]["mean"][1].dims
    ('seed',)
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

    >>> _labels([3, 5]).tolist(), _labels([3, 0.5]).tolist(), _labels([True, 3]).tolist()
    ([3, 5], [3.0, 0.5], ['True', '3'])
    >>> _labels(["II", {"type": "band"}]).tolist(), _labels([{"type": "band"}] * 2).tolist()
    (['II', 'band'], ['0: band', '1: band'])
    """
    if all(isinstance(value, numbers.Real) and not isinstance(value, bool) for value in values):
        return np.array(values)
    texts = [value if isinstance(value, str) else _text(value) for value in values]
    if len(set(texts)) < len(texts):  # two tables of one type, say
        texts = [f"{number}: {text}" for number, text in enumerate(texts)]
    return np.array(texts, dtype=object)
