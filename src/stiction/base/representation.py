"""How objects are shown, compared and converted to JSON.

A model shows its fields. A result shows the
requested number with its interval and unit, and its
basis (`Summary`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from pydantic_core import to_jsonable_python

from stiction.base.units import as_texts
from stiction.base.variables import UNITS

MAX_NUMBERS, MAX_ROWS = 10, 30
"""Numbers of an array, and rows of a table, that are shown in full."""


class Row(NamedTuple):
    """Row of a summary: a value in SI, its interval and unit, and a remark."""

    name: str
    value: Any
    interval: Sequence[float] = ()
    unit: str = ""
    remark: str = ""

    @property
    def texts(self) -> tuple[str, str, str, str, str]:
        """Return name, value, interval, unit and remark as text.

        The unit suits the value.
        """
        if not isinstance(self.value, int | float | np.number) or isinstance(self.value, bool):
            text = self.value if isinstance(self.value, str) else shown(self.value)
            return self.name, text, "", self.unit, self.remark
        (value, *ends), unit = as_texts(self.unit, [float(self.value), *self.interval])
        return self.name, value, " to ".join(ends), unit, self.remark


class Summary(NamedTuple):
    """Summary of an object: a title, rows, the meaning of their intervals, and notes."""

    title: str
    rows: Sequence[Row]
    interval: str = "interval"
    notes: Sequence[str] = ()

    @property
    def columns(self) -> list[tuple[str, ...]]:
        """Columns that are not empty: a heading, and the texts of at most thirty rows."""
        rows = [row.texts for row in self.rows[:MAX_ROWS]]
        if len(self.rows) > MAX_ROWS:
            rows.append((f"and {len(self.rows) - MAX_ROWS} more", "", "", "", ""))
        columns = zip(("", "value", self.interval, "unit", ""), *rows, strict=True)
        return [column for column in columns if any(column[1:])]

    @property
    def text(self) -> str:
        """The summary as lines."""
        padded = [
            [text.ljust(max(map(len, column))) for text in column] for column in self.columns
        ]
        lines = ["  ".join(row) for row in zip(*padded, strict=True)]
        return "\n".join(
            [self.title, *(f"  {line}".rstrip() for line in [*lines, *self.notes])]
        )


@cache
def _public_names(kind: Any) -> tuple[str, ...]:
    """Return the public fields of a dataclass or named tuple that are compared."""
    if issubclass(kind, tuple):
        return tuple(kind._fields)
    names = (field.name for field in dataclasses.fields(kind) if field.compare)
    return tuple(name for name in names if name[0] != "_")


def _public(value: Any) -> dict[str, Any]:
    kind: Any = type(value)
    return {name: getattr(value, name) for name in _public_names(kind)}


def given_fields(value: Any) -> dict[str, Any]:
    """Return, by name, the fields of a dataclass that differ from their default."""
    given = {}
    for field in dataclasses.fields(value):
        entry = getattr(value, field.name)
        default = type(entry) is type(field.default) and entry == field.default
        if field.repr and not default:
            given[field.name] = entry
    return given


def brief(self: Any) -> str:
    """Use as `__repr__` of a dataclass: show fields that differ from their default, shortened."""
    parts = [f"{name}={shown(value)}" for name, value in given_fields(self).items()]
    return f"{type(self).__name__}({', '.join(parts)})"


def shown(value: Any) -> str:
    """Return a value as text. For a long array, return the shape and the range."""
    if isinstance(value, np.ndarray):
        if value.size <= MAX_NUMBERS:
            return str(value.tolist())
        shape = " x ".join(str(size) for size in value.shape)
        if value.dtype.kind not in "fiu":
            return f"<{shape} array>"
        return f"<{shape} array, {np.nanmin(value):.6g} to {np.nanmax(value):.6g}>"
    if isinstance(value, list | tuple) and len(value) > MAX_NUMBERS:
        return f"<{len(value)} values>"
    return repr(float(value) if isinstance(value, np.floating) else value)


def equal(self: Any, other: object) -> bool:
    """Use as `__eq__`: objects of a class are equal if all public fields are equal."""
    return _key(self) == _key(other) if type(self) is type(other) else NotImplemented


def hash_of(self: Any) -> int:
    """Use as `__hash__` with `equal`."""
    return hash(_key(self))


def _key(self: Any) -> tuple[Any, ...]:
    return tuple(map(_comparable, _public(self).values()))


def _comparable(value: Any) -> Any:
    """Return a form of a value for comparison and hashing, in which NaN equals itself."""
    if value is None or isinstance(value, str | float):
        return value if value == value else "nan"  # most are, and many calls contain hashes
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0.0).tobytes()  # zeros of both signs are equal
    if hasattr(value, "identical"):  # labelled arrays
        return str(value.to_dict())
    if isinstance(value, dict):
        return tuple((key, _comparable(value[key])) for key in sorted(value))
    return tuple(map(_comparable, value)) if isinstance(value, list | tuple) else value


class Result:
    """Base class of results: they show a summary, compare by value, and can be written as JSON."""

    def _summary(self) -> Summary:
        given = given_fields(self)
        rows = [Row(name, entry, (), UNITS.get(name, "")) for name, entry in given.items()]
        return Summary(type(self).__name__, rows)

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        return self._summary().text

    def to_dict(self) -> dict[str, Any]:
        """Return the public fields as dicts, lists and numbers for JSON.

        NaN becomes None.
        """
        return to_jsonable_python(_public(self), inf_nan_mode="null", fallback=_plain)

    __eq__, __hash__ = equal, hash_of

    def __ne__(self, other: object) -> bool:  # else a named tuple has its own
        return not self == other


def _plain(value: Any) -> Any:
    return value.to_dict() if hasattr(value, "to_dict") else value.tolist()
