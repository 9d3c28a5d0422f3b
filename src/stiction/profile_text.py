"""Tables in text: separators, decimal commas, names and units as instruments write them."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import describe
from stiction.units import parse

_EMPTY = {"", "nan", "na", "n/a", "null", "none", "-", "--"}
_WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}])?|[(\[{][^)\]}]*[)\]}]")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]\s*$")
_INTEGER = re.compile(r"[+-]?\d+$")


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers.

    Attributes
    ----------
    names, units : tuple of str or None
        One for each column; None where the file says nothing.
    columns : (columns, lines) array
        NaN where a cell is empty.
    """

    names: tuple[str | None, ...]
    units: tuple[str | None, ...]
    columns: Array


def read_table(text: str) -> Table:
    """The table in a text.

    Columns are separated by semicolons, tabs, commas or blanks, in this order of preference; the
    decimal sign may be a comma unless commas separate. Lines that begin with ``#`` are comments;
    the last one before the numbers names the columns if no other line does. Names may have a line
    of units below them.

    Raises
    ------
    InputError
        Naming the line that does not fit.
    """
    lines, comment, head = [], "", True
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            comment = line.strip().lstrip("#").strip() if head else comment
        elif line.strip():
            lines.append((number, line.strip("\r\n")))
            head = False
    if not lines:
        raise InputError("holds no numbers")
    separator = _separator([line for _, line in lines])
    rows = [(number, _split(line, separator)) for number, line in lines]
    header = []
    while rows and not any(_number(cell, separator) is not None for cell in rows[0][1]):
        header.append(rows.pop(0))
    if not rows:
        raise InputError("holds no numbers")
    if len(rows) == 1 and len(rows[0][1]) > 3:  # one line of values
        rows = [(rows[0][0], [cell]) for cell in rows[0][1]]
    width = len(rows[0][1])
    if separator == "," and not header and width == 2:
        _refuse_decimal_commas(rows)
    values = np.full((width, len(rows)), np.nan)
    for place, (number, cells) in enumerate(rows):
        if len(cells) != width:
            raise InputError(
                f"line {number} has {len(cells)} columns, line {rows[0][0]} has {width}"
            )
        for column, cell in enumerate(cells):
            value = _number(cell, separator)
            if value is None and cell.lower() not in _EMPTY:
                raise InputError(f"line {number}: {describe(cell)} is no number")
            values[column, place] = np.nan if value is None else value
    if not header and comment:
        cells = _split(comment, separator)
        header = [(0, cells)] if len(cells) == width else [(0, [comment])] if width == 1 else []
    names, units = _names(header, width)
    return Table(names, units, values)


def _separator(lines: list[str]) -> str:
    for mark in (";", "\t"):
        if any(mark in line for line in lines):
            return mark
    if not any("," in line for line in lines):
        return " "
    # Blanks separate numbers with decimal commas: '0,1 1000,5'; but '0.1, 1000.5' has commas.
    last = lines[-1]
    return " " if re.search(r"\d\s+[+-]?\d", last) and not re.search(r",\s", last) else ","


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        numbers = line.split()
        if all(_number(cell, " ") is not None or cell.lower() in _EMPTY for cell in numbers):
            return numbers
        return [cell.strip() for cell in _WORDS.findall(line)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and cell.count(",") == 1 and "." not in cell:
        cell = cell.replace(",", ".")
    if "_" in cell:  # Python reads 1_000, people do not
        return None
    try:
        return float(cell)
    except ValueError:
        return None


def _refuse_decimal_commas(rows: list[tuple[int, list[str]]]) -> None:
    """A column of '1,5' is one of decimal commas or two of integers: nobody can tell."""
    if all(_INTEGER.match(cell) for _, cells in rows for cell in cells):
        raise InputError(
            f"line {rows[0][0]}: {','.join(rows[0][1])!r} may be one number or two; separate"
            " columns with ';', or write decimal points"
        )


def _names(
    header: list[tuple[int, list[str]]], width: int
) -> tuple[tuple[str | None, ...], tuple[str | None, ...]]:
    if not header:
        return (None,) * width, (None,) * width
    for number, cells in header:
        if len(cells) != width:
            raise InputError(
                f"line {number} names {len(cells)} columns, the numbers below it have {width}"
            )
    pairs = [name_and_unit(cell) for cell in header[0][1]]
    names, units = [name for name, _ in pairs], [unit for _, unit in pairs]
    for number, cells in header[1:]:
        for column, cell in enumerate(cells):
            inner = _BRACKETS.match(cell)
            stated = inner["unit"] if inner and not inner["name"] else cell
            if not stated:
                continue
            if units[column] is not None or number != header[1][0]:
                raise InputError(f"line {number}: {describe(cell)} is neither a number nor a unit")
            units[column] = stated
    return tuple(names), tuple(units)


def name_and_unit(text: str) -> tuple[str, str | None]:
    """A heading taken apart: 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm', 'tau MPa'."""
    match = _BRACKETS.match(text)
    if match:
        return match["name"].strip(), match["unit"] or None
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    parts = re.split(r"[\s,_:]+(?:in\s+)?", text.strip())
    if len(parts) > 1 and len(parts[-1]) > 1 and parse(parts[-1]) is not None:
        return text[: text.rindex(parts[-1])].rstrip(" ,_:").removesuffix(" in"), parts[-1]
    if parse(text) is not None and len(text) > 1:
        return "", text
    return text.strip(), None
