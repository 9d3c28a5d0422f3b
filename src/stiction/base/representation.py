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

        The unit of the value suits the interval as well.

        >>> Row("load", 3123.4, (2900.0, 3400.0), "N", "mean").texts
        ('load', '3.12', '2.9 to 3.4', 'kN', 'mean')
        >>> Row("onset", "stable", (1.0, 2.0), "Pa").texts, Row("flag", True, (), "1").texts[1:4]
        (('onset', 'stable', '', 'Pa', ''), ('True', '', '1'))
        >>> Row("count", 7).texts, Row("modes", [3, 5]).texts[1]
        (('count', '7', '', '', ''), '[3, 5]')
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
        """Columns that are not empty: a heading, and the texts of at most thirty rows.

        >>> Summary("Fit", [Row("mean", 2.0, (), "m"), Row("tail", 5.0)]).columns
        [('', 'mean', 'tail'), ('value', '2', '5'), ('unit', 'm', '')]
        >>> rows = [Row("onset", "x", remark="first")] * 31
        >>> [(len(column), column[30:]) for column in Summary("", rows).columns]
        [(32, ('onset', 'and 1 more')), (32, ('x', '')), (32, ('first', ''))]
        >>> len(Summary("", rows[:30]).columns[0])
        31
        >>> Summary("", [Row("load", 1.5, (0, 2))], "95 %").columns[2]
        ('95 %', '0 to 2')
        """
        rows = [row.texts for row in self.rows[:MAX_ROWS]]
        if len(self.rows) > MAX_ROWS:
            rows.append((f"and {len(self.rows) - MAX_ROWS} more", "", "", "", ""))
        columns = zip(("", "value", self.interval, "unit", ""), *rows, strict=True)
        return [column for column in columns if any(column[1:])]

    @property
    def text(self) -> str:
        """The summary as lines.

        >>> rows = Row("mean", 2.0, (), "m"), Row("b", 5.25)
        >>> print(Summary("Fit", rows, notes=["by moments"]).text)
        Fit
                value  unit
          mean  2      m
          b     5.25
          by moments
        """
        padded = [
            [text.ljust(max(map(len, column))) for text in column] for column in self.columns
        ]
        lines = ["  ".join(row) for row in zip(*padded, strict=True)]
        return "\n".join(
            [self.title, *(f"  {line}".rstrip() for line in [*lines, *self.notes])]
        )


@cache
def _public_names(kind: Any) -> tuple[str, ...]:
    """Return the public fields of a dataclass or named tuple that are compared.

    >>> @dataclasses.dataclass
    ... class Fit:
    ...     mean: float
    ...     _cache: int = 0
    ...     note: str = dataclasses.field(default="", compare=False)
    >>> _public_names(Fit), _public_names(Row)[:2]
    (('mean',), ('name', 'value'))
    """
    if issubclass(kind, tuple):
        return tuple(kind._fields)
    names = (field.name for field in dataclasses.fields(kind) if field.compare)
    return tuple(name for name in names if name[0] != "_")


def _public(value: Any) -> dict[str, Any]:
    kind: Any = type(value)
    return {name: getattr(value, name) for name in _public_names(kind)}


def given_fields(value: Any) -> dict[str, Any]:
    """Return, by name, the fields of a dataclass that differ from their default.

    >>> @dataclasses.dataclass
    ... class Fit:
    ...     mean: float
    ...     count: int = 1
    ...     note: str = ""
    ...     seed: int = dataclasses.field(default=0, repr=False)
    >>> given_fields(Fit(2.0, 1, "long", seed=7)), given_fields(Fit(2.0, count=1.0))
    ({'mean': 2.0, 'note': 'long'}, {'mean': 2.0, 'count': 1.0})
    >>> brief(Fit(2.0, 1, "long"))
    "Fit(mean=2.0, note='long')"
    """
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
    """Return a value as text. For a long array, return the shape and the range.

    >>> shown(np.arange(10)), shown(np.arange(3.0, 14.0)), shown(np.float64(0.5))
    ('[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]', '<11 array, 3 to 13>', '0.5')
    >>> shown(np.array([[np.nan, 1.25, 7.0]] * 4)), shown(np.full((2, 6), True))
    ('<4 x 3 array, 1.25 to 7>', '<2 x 6 array>')
    >>> shown((1,) * 10), shown([1] * 11), shown("a" * 11)
    ('(1, 1, 1, 1, 1, 1, 1, 1, 1, 1)', '<11 values>', "'aaaaaaaaaaa'")
    """
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
    """Use as `__eq__`: objects of a class are equal if all public fields are equal.

    >>> @dataclasses.dataclass(eq=False)
    ... class Fit(Result):
    ...     values: object
    ...     note: str = dataclasses.field(default="", compare=False)
    >>> first, second = Fit(np.array([0.0, np.nan]), "a"), Fit(np.array([-0.0, np.nan]), "b")
    >>> first == second, first != second, hash(first) == hash(second), first == "Fit"
    (True, False, True, False)
    >>> first == Fit(np.array([[0.0, np.nan]])), Fit(1.0) == Fit(2.0)
    (False, False)
    """
    return _key(self) == _key(other) if type(self) is type(other) else NotImplemented


def hash_of(self: Any) -> int:
    """Use as `__hash__` with `equal`."""
    return hash(_key(self))


def _key(self: Any) -> tuple[Any, ...]:
    return tuple(map(_comparable, _public(self).values()))


def _comparable(value: Any) -> Any:
    """Return a form of a value for comparison and hashing, in which NaN equals itself.

    >>> _comparable({"b": float("nan"), "a": [1, (2.0, None)]})
    (('a', (1, (2.0, None))), ('b', 'nan'))
    >>> _comparable(np.array([[2.0], [3.0]])) == ((2, 1), np.array([2.0, 3.0]).tobytes())
    True
    >>> import xarray as xr
    >>> _comparable(xr.DataArray([7.0], attrs={"units": "m"}))[:70]
    "{'dims': ('dim_0',), 'attrs': {'units': 'm'}, 'data': [7.0], 'coords':"
    """
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
    """Base class of results: they show a summary, compare by value, and can be written as JSON.

    Examples
    --------
    >>> @dataclasses.dataclass(repr=False, eq=False)
    ... class Fit(Result):
    ...     correlation_length: float
    ...     values: object = None
    ...     _cache: int = 7
    >>> fit = Fit(0.012, np.array([1.0, np.nan]))
    >>> fit
    Fit
                          value       unit
      correlation_length  12          mm
      values              [1.0, nan]
    >>> list(fit.to_dict()), fit.to_dict()["values"] == [1.0, None]
    (['correlation_length', 'values'], True)
    >>> Fit(1.0, {"inner": Fit(2.0)}).to_dict()["values"]["inner"]["correlation_length"]
    2.0
    """

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
