"""Sweeps: any key of a study takes several values; axes are crossed, keys of one axis zipped."""

import dataclasses
import math
import numbers
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
import pydantic
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator

from stiction.ensemble.dataset import GridAxis
from stiction.errors import InputError, prefixed, unknown_name
from stiction.model import (
    Real,
    at_least,
    describe,
    explain,
    model,
    to_plain,
)
from stiction.profiles.reading import profile_in_file, quantity_of
from stiction.variables import PROFILES, QUANTITIES, Variable

MOST_POINTS = 100_000
_FIXED = (
    "ensemble",
    "ensemble.samples",
    "ensemble.first",
    "ensemble.keep",
    "title",
    "sweep",
)
_TABLES = ("problem", "random", "method", "ensemble", "save")
_UNITS = {name: variable.units for name, variable in PROFILES.items()} | {
    "length": "m",
    "correlation_length": "m",
    "shear_modulus": "Pa",
    "density": "kg m-3",
    "low": "Pa",
    "high": "Pa",
    "loc": "Pa",
    "scale": "Pa",
    "loading_rate": "Pa s-1",
}


Axis: TypeAlias = dict[str, list[Any]]
"""Keys that vary together, each with one value for each step."""


class Point(NamedTuple):
    """One combination of a sweep: its number and the value of every swept key."""

    number: int
    values: dict[str, Any]


@model(kw_only=True)
class _Range:
    """Values from start to stop, both included."""

    start: Real
    stop: Real
    count: Annotated[at_least(2), Field(le=MOST_POINTS)]  # type: ignore[valid-type]
    spacing: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _log_of_positive(self) -> "_Range":
        if self.spacing == "log" and min(self.start, self.stop) <= 0.0:
            ends = f"{self.start!r} and {self.stop!r}"
            raise InputError(f"a log range needs positive ends, got {ends}")
        return self


def _range(key: str, given: Mapping[str, Any]) -> list[Any]:
    try:
        found: _Range = pydantic.TypeAdapter(_Range).validate_python(given)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, key)) from None
    spread = np.geomspace if found.spacing == "log" else np.linspace
    values = spread(found.start, found.stop, found.count)
    whole = all(isinstance(given[name], numbers.Integral) for name in ("start", "stop"))
    if whole and np.all(values == np.round(values)):
        values = values.astype(np.int64)
    return values.tolist()


def _values(key: str, given: Any, folder: Path | None) -> list[Any]:
    """Return the values of a key; profiles in files are read."""
    if isinstance(given, Mapping):
        return _range(key, given)
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, list | tuple) or not given:
        raise InputError(
            f"{key}: must be a list of values or a range such as {{start = 1e-3, stop = 4e-3,"
            f" count = 4}}, got {describe(given)}"
        )
    found = []
    for value in given:
        file = isinstance(value, str) or (isinstance(value, Mapping) and "file" in value)
        if file and folder is not None and quantity_of(key) in QUANTITIES:
            with prefixed(key):
                value = profile_in_file(value, key, folder)
        found.append(value.tolist() if isinstance(value, np.generic | np.ndarray) else value)
    return found


def _axis(number: int, given: Any, folder: Path | None) -> Axis:
    where = f"[{number}]"
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            f"{where}: must be a table of keys and their values, got {describe(given)}"
        )
    with prefixed(where, "."):
        axis = {key: _values(key, values, folder) for key, values in _flat(given).items()}
    if len({len(values) for values in axis.values()}) > 1:
        named = ", ".join(f"{key} has {len(values)}" for key, values in axis.items())
        raise InputError(
            f"{where}: keys of one table vary together and need as many values each ({named});"
            " to cross them, give each a [[sweep]] of its own"
        )
    return axis


def _flat(given: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted keys of a table: TOML reads an unquoted ``a.b = 1`` as nested tables."""
    result: dict[str, Any] = {}
    for key, value in given.items():
        name = f"{prefix}.{key}" if prefix else str(key)
        if isinstance(value, Mapping) and not {"start", "stop", "count"} & set(value):
            result |= _flat(value, name)
        else:
            result[name] = value
    return result


def size_of(axis: Axis) -> int:
    """Return the number of steps of an axis."""
    return len(next(iter(axis.values())))


def _axes(given: Any, info: pydantic.ValidationInfo) -> list[Axis]:
    """Return the axes of a sweep from what was written."""
    folder = (info.context or {}).get("folder")
    if not isinstance(given, list | tuple):
        raise InputError(f"must be a list of tables, each a [[sweep]], got {describe(given)}")
    problems: list[str] = []
    axes: list[Axis] = []
    for number, table in enumerate(given):
        try:
            axes.append(_axis(number, table, folder))
        except InputError as error:
            problems += error.problems
    keys = [key for axis in axes for key in axis]
    for key in sorted(keys):
        table = key.split(".")[0]
        if key in _FIXED:
            problems.append(f"{key}: cannot be swept")
        elif table not in _TABLES:
            problems.append(unknown_name(key, table, _TABLES))
        if keys.count(key) > 1:
            problems.append(f"{key}: is swept twice")
        inner = [other for other in keys if other.startswith(f"{key}.")]
        problems += [f"{other}: is part of {key}, which is swept too" for other in inner]
    points = math.prod(map(size_of, axes))
    if points > MOST_POINTS:
        problems.append(f"makes {points} points, at most {MOST_POINTS} are allowed")
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return axes


def _plain_axes(axes: Sequence[Axis]) -> list[Axis]:
    return [
        {
            key: [to_plain(one) if dataclasses.is_dataclass(one) else one for one in values]
            for key, values in axis.items()
        }
        for axis in axes
    ]


Sweep: TypeAlias = Annotated[
    Any,
    BeforeValidator(_axes),
    PlainSerializer(_plain_axes),
    WithJsonSchema(
        {
            "type": "array",
            "description": "axes that are crossed; each a table of dotted keys that vary together,"
            " with lists of values or {start, stop, count, spacing}",
            "items": {"type": "object"},
        }
    ),
]
"""A list of tables of dotted keys and their values."""


def with_first_values(given: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return a study in plain form, each swept key without a value with the first of its sweep.

    A sweep that is not valid is left to the validation of the whole.
    """
    context = {"folder": folder}
    try:
        axes = pydantic.TypeAdapter(Sweep).validate_python(
            given.get("sweep", ()), context=context
        )
    except pydantic.ValidationError:
        return given
    for axis in axes:
        for key, values in axis.items():
            given = _with_default(given, key.split("."), values[0])
    return given


def _with_default(table: dict[str, Any], steps: list[str], value: Any) -> dict[str, Any]:
    name, *rest = steps
    inner = table.get(name, {})
    if rest and isinstance(inner, dict):
        return table | {name: _with_default(inner, rest, value)}
    return table if rest or name in table else table | {name: value}


def name_point(point: Point) -> str:
    """For messages: 'point 3 (problem.interface.nodes = 512)'."""
    values = ", ".join(f"{key} = {_text(value)}" for key, value in point.values.items())
    return f"point {point.number} ({values})" if values else f"point {point.number}"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    kind = value.get("type") if isinstance(value, Mapping) else getattr(value, "type", None)
    return str(kind) if kind else describe(value)


def grid_axes(axes: Sequence[Axis], taken: Sequence[str]) -> list[GridAxis]:
    """Return the axes as dimensions of a result, named by the ends of their keys."""
    names = _short_names([key for axis in axes for key in axis], taken)
    result = []
    for axis in axes:
        dim = names[next(iter(axis))]
        coordinates = {}
        for key, values in axis.items():
            labels, parts = _coordinate(values), key.split(".")
            number = labels.dtype.kind in "if" and "correlation" not in parts
            unit = _UNITS.get(parts[-1], "1") if number else "1"
            coordinates[names[key]] = (labels, Variable(unit, key, (dim,)))
        result.append(GridAxis(dim, size_of(axis), coordinates))
    return result


def _short_names(keys: Sequence[str], taken: Sequence[str]) -> dict[str, str]:
    names: dict[str, str] = {}
    for key in keys:
        parts = key.split(".")
        fewest = parts[::-1].index("correlation") + 1 if "correlation" in parts else 1
        for count in range(fewest, len(parts) + 1):
            name = "_".join(parts[-count:])
            alike = [other for other in keys if other.split(".")[-count:] == parts[-count:]]
            if len(alike) == 1 and name not in taken:
                break
        names[key] = name if name not in taken else f"swept_{name}"
    return names


def _coordinate(values: Sequence[Any]) -> np.ndarray[Any, Any]:
    if all(isinstance(value, numbers.Real) and not isinstance(value, bool) for value in values):
        whole = all(isinstance(value, numbers.Integral) for value in values)
        return np.array(values, dtype=np.int64 if whole else np.float64)
    texts = [value if isinstance(value, str) else _text(value) for value in values]
    if len(set(texts)) < len(texts):  # two tables of one type, say
        texts = [f"{number}: {text}" for number, text in enumerate(texts)]
    return np.array(texts, dtype=object)
