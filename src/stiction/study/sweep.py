"""Sweeps: any key of a study takes several values; axes are crossed, keys of one axis zipped."""

import dataclasses
import json
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
from stiction.profiles.reading import is_profile, profile_in_file
from stiction.results import PROFILES, Variable

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


class Axis(NamedTuple):
    """Keys that vary together, each with one value for each step."""

    keys: tuple[str, ...]
    steps: tuple[tuple[Any, ...], ...]


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
    if isinstance(given, Mapping):
        return _range(key, given)
    if isinstance(given, np.ndarray):
        given = given.tolist()
    if not isinstance(given, list | tuple) or not given:
        raise InputError(
            f"{key}: must be a list of values or a range such as {{start = 1e-3, stop = 4e-3,"
            f" count = 4}}, got {describe(given)}"
        )
    return [_value(key, value, folder) for value in given]


def _value(key: str, value: Any, folder: Path | None) -> Any:
    """A value as it stands in TOML; a profile in a file is read."""
    file = isinstance(value, str) or (isinstance(value, Mapping) and "file" in value)
    if file and folder is not None and is_profile(key):
        with prefixed(key):
            value = profile_in_file(value, key, folder)
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _axis(number: int, given: Any, folder: Path | None) -> Axis:
    where = f"[{number}]"
    if isinstance(given, Axis):
        return given
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            f"{where}: must be a table of keys and their values, got {describe(given)}"
        )
    with prefixed(where, "."):
        columns = {key: _values(key, values, folder) for key, values in _flat(given).items()}
    lengths = {key: len(values) for key, values in columns.items()}
    if len(set(lengths.values())) > 1:
        named = ", ".join(f"{key} has {count}" for key, count in lengths.items())
        raise InputError(
            f"{where}: keys of one table vary together and need as many values each ({named});"
            " to cross them, give each a [[sweep]] of its own"
        )
    return Axis(tuple(columns), tuple(zip(*columns.values(), strict=True)))


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


def _axes(given: Any, info: pydantic.ValidationInfo) -> tuple[Axis, ...]:
    """Axes of a sweep from what was written: a list of tables, or one table of one key."""
    folder = (info.context or {}).get("folder")
    if isinstance(given, Mapping):
        if len(_flat(given)) > 1:
            raise InputError(
                "must be a list of tables: a [[sweep]] for each key crosses them, one [[sweep]]"
                " with several keys varies them together"
            )
        given = [given]
    if not isinstance(given, list | tuple):
        raise InputError(f"must be a list of tables, got {describe(given)}")
    problems: list[str] = []
    axes: list[Axis] = []
    for number, table in enumerate(given):
        try:
            axes.append(_axis(number, table, None if folder is None else Path(folder)))
        except InputError as error:
            problems += error.problems
    keys = [key for axis in axes for key in axis.keys]
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
    points = math.prod(len(axis.steps) for axis in axes)
    if points > MOST_POINTS:
        problems.append(f"makes {points} points, at most {MOST_POINTS} are allowed")
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return tuple(axes)


def _plain_value(value: Any) -> Any:
    return to_plain(value) if dataclasses.is_dataclass(value) else value


def _plain_axes(axes: tuple[Axis, ...]) -> list[dict[str, list[Any]]]:
    columns = [zip(axis.keys, zip(*axis.steps, strict=True), strict=True) for axis in axes]
    return [
        {key: [_plain_value(value) for value in values] for key, values in axis}
        for axis in columns
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
        for key, value in zip(axis.keys, axis.steps[0], strict=True):
            given = _with_default(given, key.split("."), value)
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
    """The axes as dimensions of a result, named by the ends of their keys."""
    keys = [key for axis in axes for key in axis.keys]
    names = _short_names(keys, taken)
    result = []
    for axis in axes:
        dim = names[axis.keys[0]]
        coordinates = {}
        for i, key in enumerate(axis.keys):
            values = _coordinate([step[i] for step in axis.steps])
            parts = key.split(".")
            unit = "1" if "correlation" in parts else _UNITS.get(parts[-1], "1")
            unit = unit if values.dtype.kind in "if" else "1"
            coordinates[names[key]] = (values, Variable(unit, key, (dim,)))
        result.append(GridAxis(dim, len(axis.steps), coordinates))
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
    if len(set(texts)) < len(texts):  # two tables of one type: write them out
        texts = [json.dumps(_plain_value(value)) for value in values]
    if len(set(texts)) < len(texts):
        texts = [f"{number}: {text}" for number, text in enumerate(texts)]
    return np.array(texts, dtype=object)
