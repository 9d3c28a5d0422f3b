"""Representations that fit on a screen, as text and as HTML: arrays by shape and range."""

from __future__ import annotations

import contextlib
import dataclasses
import html
import inspect
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

_LONG = 6
_MOST = 300
"""Characters of a value in HTML."""


def brief(self: Any) -> str:
    """Use as `__repr__` of a dataclass: its fields that are not at their default, shortened."""
    parts = []
    for field in dataclasses.fields(self):
        value = getattr(self, field.name)
        if field.repr and not _is_default(value, field.default):
            parts.append(f"{field.name}={_text(value)}")
    return f"{type(self).__name__}({', '.join(parts)})"


def _is_default(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return bool(value == default)


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        shape = " x ".join(str(size) for size in value.shape)
        if value.dtype.kind not in "fiub" or value.size == 0:
            return f"<{shape} array>"
        if value.dtype.kind == "b":
            return f"<{shape} array, {int(value.sum())} true>"
        return f"<{shape} array, {np.nanmin(value):.6g} to {np.nanmax(value):.6g}>"
    if isinstance(value, list | tuple) and len(value) > _LONG:
        return f"<{len(value)} values>"
    if isinstance(value, float):
        return f"{float(value)!r}"  # numpy's own says np.float64(...)
    return repr(value)


_UNIT = re.compile(
    r"(?:^|[ ,])(Pa/m|Pa/s|Pa\^2|Pa|kg/m3|J/m\^?2|J/m|rad/m|1/m|m/s|m)(?=[.,;:)]|$| \()"
)
_CELL = 'style="text-align: left; vertical-align: top"'


def brief_html(self: Any) -> str:
    """Use as `_repr_html_` of a dataclass: a row for each field and each number derived from them.

    Units and meanings are those of the docstrings.
    """
    return _table(type(self).__name__, list(_rows(self)))


def _rows(self: Any) -> Iterator[tuple[str, str, str]]:
    """Name, value as HTML and meaning."""
    told = _described(type(self))
    for field in dataclasses.fields(self):
        value = getattr(self, field.name)
        shown = field.repr or hasattr(value, "sizes")  # datasets by their sizes
        if shown and field.name != "type" and value is not None:
            meaning = told.get(field.name, "")
            yield field.name, _html(value, _unit(meaning)), meaning
    for name, derived in inspect.getmembers(type(self), lambda one: isinstance(one, property)):
        getter: Any = derived.fget  # a property without one does not exist here
        if name.startswith("_") or getter.__annotations__.get("return") != "float":
            continue
        meaning = told.get(name) or (inspect.getdoc(getter) or "").partition("\n")[0]
        with contextlib.suppress(ValueError):  # an InputError: there is no such number here
            yield name, _html(getattr(self, name), _unit(meaning)), meaning


def _described(cls: type) -> dict[str, str]:
    """What the docstring says of each parameter or attribute, on one line."""
    text = inspect.getdoc(cls) or ""
    found: dict[str, str] = {}
    entry = re.compile(r"^(?P<names>[\w, ]+) : .+\n(?P<meaning>(?:    .+\n?)*)", re.MULTILINE)
    for match in entry.finditer(text):
        meaning = " ".join(match["meaning"].split())
        found |= {name: meaning for name in match["names"].split(", ")}
    return found


def _unit(meaning: str) -> str:
    found = _UNIT.search(meaning)
    return found[1] if found else ""


def _html(value: Any, unit: str) -> str:
    """A value; objects of this package as tables that unfold."""
    show = getattr(type(value), "_repr_html_", None)
    if show is brief_html:
        name = type(value).__name__
        return f"<details><summary>{name}</summary>{_table('', list(_rows(value)))}</details>"
    if isinstance(value, float):
        text = f"{value:.6g}"
    elif isinstance(value, tuple) and value and all(isinstance(one, float) for one in value):
        text = _text(value) if len(value) > _LONG else " to ".join(f"{one:.6g}" for one in value)
    elif hasattr(value, "sizes"):
        sizes = ", ".join(f"{dim} {size}" for dim, size in value.sizes.items())
        text = f"<{type(value).__name__}, {sizes or 'empty'}>"
    else:
        text = value if isinstance(value, str) else _text(value)
        text = text if len(text) <= _MOST else text[: _MOST - 3] + "..."
    numeric = isinstance(value, int | float | tuple | np.ndarray) and not isinstance(value, bool)
    return html.escape(f"{text} {unit}" if unit and numeric else text)


def _table(title: str, rows: list[tuple[str, str, str]]) -> str:
    """Colours and fonts are those of the page, light or dark."""
    lines = [
        f"<tr><th {_CELL}>{html.escape(name)}</th><td {_CELL}>{value}</td>"
        f'<td {_CELL}><span style="opacity: 0.7">{html.escape(meaning)}</span></td></tr>'
        for name, value, meaning in rows
    ]
    head = f"<strong>{html.escape(title)}</strong>" if title else ""
    return f"<div>{head}<table>{''.join(lines)}</table></div>"
