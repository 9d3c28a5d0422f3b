"""Numbers and headings in the cells of tables that instruments and colleagues write.

The format of a table is unknown: the decimal mark, the end of the
headings and the place of the units. A wrong guess could change a value
by a factor of a thousand, so a table that can be read in two ways is
refused. The cells come from `files.py`. The steps are:

1. Find the first line of numbers. Lines above it are headings, units or
   remarks. Empty lines separate records.
2. Find the decimal mark, which is the same in the whole file. If points
   or commas may also mark thousands, refuse the file unless the caller
   states `decimal`.
3. Turn cells into numbers. Empty cells and
   words for a missing value become NaN.
4. Split headings into names and units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import describe
from stiction.base.units import parse

if TYPE_CHECKING:
    import xarray as xr

_EMPTY = {
    "", "-", "--", "---", "nan", "na", "n/a", "<na>", "#n/a", "#na", "null", "none", "#div/0!",
    "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind", "#wert!", "#value!", "#nv",
}  # fmt: skip
"""Words for a missing value, in lower case. A row of stars is another."""
# Patterns never return to letters that they have passed: time grows
# linearly with the file.
WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}]?)?|[(\[{][^)\]}]*[)\]}]?")
NUMBER = re.compile(
    r"[+-]?(?:(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
    r"|\d{1,3}(?:(?:,\d{3})+(?:\.\d*)?|(?:\.\d{3})+(?:,\d*)?))$"
)
_BETWEEN = r"['\N{RIGHT SINGLE QUOTATION MARK} \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}]"
_GROUPS = re.compile(rf"([+-]?\d{{1,3}})((?:{_BETWEEN}\d{{3}})+)(?!\d)")
_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?!\d)")
    for mark in ".,"
}
"""Numbers whose mark may separate thousands, such as 1.020 and 1.020.000, not 0.020 or 1.02."""
_OTHER = {".": ",", ",": "."}


class Options(NamedTuple):
    """What the caller states about a file."""

    skip: int = 0
    sheet: int | str = 0
    missing: Any = None  # a number, a word, or a sequence of them
    decimal: str | None = None

    @property
    def stated(self) -> tuple[float | str, ...]:
        """Numbers and words that the caller uses for a missing value."""
        several = self.missing if isinstance(self.missing, tuple | list) else (self.missing,)
        return tuple(value for value in several if value is not None)

    @property
    def words(self) -> set[str]:
        """All words for a missing value, in lower case."""
        given = {word.strip().casefold() for word in self.stated if isinstance(word, str)}
        return _EMPTY | given


class Row(NamedTuple):
    """A line of a table: its number (from 1) and its cells."""

    number: int
    cells: list[str]


class Grid(NamedTuple):
    """The cells of a file, with the comments above them."""

    rows: list[Row]
    comments: list[str]
    separator: str  # empty if the file is a workbook


class Table(NamedTuple):
    """The numbers of a table in columns, and its headings."""

    columns: Array  # (columns, rows)
    header: list[Row]
    lines: Array  # the number of the line of each row
    texts: dict[int, str]  # by column without any number: its content, in words
    mark: str | None  # the decimal mark, if one was seen


def dataset_of(grid: Grid, table: Table, options: Options) -> xr.Dataset:
    """Return the columns of a table as variables along 'row'. See `files.read_table`."""
    columns, lines = table.columns, table.lines
    blocks = np.cumsum(np.diff(lines, prepend=lines[0]) > 1)
    # 4. Split headings into names and units.
    headed = any({*row.cells} - {"", "-"} for row in table.header)
    headings = _headings(table.header, len(columns))
    for number, (_, about) in enumerate(headings[1:], 1):  # the first may be an index
        if headed and not about["heading"] and not np.isnan(columns[number]).all():
            raise InputError(
                f"column {number} has numbers, such as in line {lines[0]}, but no heading. If"
                " commas mark thousands, separate columns with ';'"
            )
    attributes = {"lines": lines, "blocks": blocks, "comments": grid.comments, "headed": headed}
    return _labelled([*columns], headings, table.texts, attributes)


def table_of_frame(frame: Any) -> xr.Dataset:
    """Convert a DataFrame with headings to the form of a table from a file."""
    import pandas as pd

    headings = [str(name) for name in frame.columns]
    if frame.index.dtype.kind == "f":  # positions
        frame, headings = frame.reset_index(), [str(frame.index.name or "x"), *headings]
    columns, texts = [], {}
    for number, heading in enumerate(headings):
        column = frame.iloc[:, number]
        numbers = pd.to_numeric(column, errors="coerce") if column.dtype == object else column
        if numbers.dtype.kind not in "fiu" or (numbers.isna() & column.notna()).any():
            texts[number] = f"column {heading!r} does not hold numbers"
            numbers = np.full(len(frame), np.nan)
        columns.append(np.asarray(numbers, dtype=np.float64))
    attributes = {"headed": True, "comments": []}
    return _labelled(columns, _headings([Row(0, headings)], len(columns)), texts, attributes)


def _labelled(
    columns: Sequence[Array],
    headings: Sequence[tuple[str, dict[str, str]]],
    texts: dict[int, str],
    attributes: dict[str, Any],
) -> xr.Dataset:
    """Return columns with their headings as variables along 'row'."""
    import xarray as xr

    variables: dict[str, Any] = {}  # a dataset that grows takes quadratic time
    for number, (name, about) in enumerate(headings):
        about |= {"name": name, "text": texts.get(number, ""), "column": str(number)}
        if name in variables:
            heading = about["heading"]
            name = heading if heading not in variables else f"{name} {number}"
        variables[name] = ("row", columns[number], about)
    return xr.Dataset(variables, attrs=attributes)


def split_at_blanks(line: str, words: set[str]) -> list[str]:
    """Split a line at blanks, but not between a name and its unit in brackets."""
    cells = line.split()
    if all(NUMBER.match(cell) or cell.casefold() in words for cell in cells):
        return cells
    return [cell.strip() for cell in WORDS.findall(line)]


# -- steps 1 to 3: numbers -----------------------------------------------------------------------


def numbers_of(grid: Grid, options: Options) -> Table:
    """Return the numbers of a table (steps 1 to 3)."""
    words, separator = options.words, grid.separator
    # 1. Find the first line of numbers.
    rows = [row for row in grid.rows if any(row.cells)]
    start, numeric = _start(rows, words)
    header, rows = rows[:start], rows[start:]
    if header:  # a heading may be repeated above each record
        rows = [row for row in rows if row.cells != header[-1].cells]
    width = max(len(row.cells) for row in rows)
    while not any(len(row.cells) >= width and row.cells[width - 1] for row in rows):
        width -= 1  # a column that is empty in all rows comes from a separator at the end
    for row in rows:
        if len(row.cells) < width:
            most = next(row.number for row in rows if len(row.cells) >= width)
            raise InputError(
                f"line {row.number} has {len(row.cells)} columns, line {most} has {width}"
            )
    # Without a line of headings, the last comment may name as many
    # columns as there are.
    if not header and grid.comments and not _SIZE.match(grid.comments[-1]):
        comment = grid.comments[-1]
        at_blanks = split_at_blanks(comment, words)
        cells = comment.split(separator) if separator.strip() else at_blanks
        cells = [comment] if width == 1 else [cell.strip() for cell in cells]
        header = [Row(0, cells)] if len(cells) == width else []
    header = [_without_empty_end(row, width) for row in header]
    columns = [list(cells) for cells in zip(*(row.cells[:width] for row in rows), strict=True)]
    if separator == "," and not header and width == 2:
        _check_pairs(columns, rows[0])
    # 2. Find the decimal mark.
    mark = _decimal_mark(columns, numeric, rows, separator, options.decimal)
    # 3. Turn cells into numbers. A column may hold words only, or
    # numbers only.
    numbers, texts, mixed = np.empty((width, len(rows))), {}, []
    for column, cells in enumerate(columns):
        values = _numbers(cells, words, mark)
        numbers[column] = [math.nan if value is None else value for value in values]
        if None in values:
            wrong = values.index(None)
            texts[column] = _not_a_number(rows[wrong].number, cells[wrong])
            if np.isfinite(numbers[column]).any():
                mixed.append(texts[column])
    if mixed:
        raise InputError(mixed)
    return Table(numbers, header, np.array([row.number for row in rows]), texts, mark)


def _not_a_number(line: int, cell: str) -> str:
    advice = f"If it stands for no value, pass missing={cell!r}"
    return f"line {line}: {describe(cell)} is not a number. {advice}"


def _start(rows: Sequence[Row], words: set[str]) -> tuple[int, list[int]]:
    """Return the index of the first row with numbers, and the columns with numbers (step 1)."""

    def is_value(cell: str, or_empty: bool = False) -> bool:
        value = _number(cell, words, None)
        return bool(NUMBER.match(cell)) or (value is not None and (or_empty or value == value))

    last = next((row for row in reversed(rows) if any(map(is_value, row.cells))), None)
    if last is None:
        raise InputError("holds no numbers")
    numeric = [i for i, cell in enumerate(last.cells) if is_value(cell)]

    # The last line with numbers shows which columns have numbers. A
    # heading has a word there.
    def is_header(row: Row) -> bool:
        cells = [row.cells[i] for i in numeric if i < len(row.cells)]
        return {*row.cells} <= {"", "-"} or any(not is_value(cell, True) for cell in cells)

    start = next(place for place, row in enumerate(rows) if not is_header(row))
    if start > 0 and not _are_units(rows[start - 1].cells):
        number, cells = rows[start - 1]
        named = [cells[i] for i in numeric if i < len(cells) and cells[i]]
        wrong = [cell for cell in named if not is_value(cell, True)]
        if len(wrong) < len(named) and wrong:  # a row of values, one of which is wrong
            raise InputError(_not_a_number(number, wrong[0]))
    return start, numeric


def _without_empty_end(row: Row, width: int) -> Row:
    """Return a heading with one cell for each column, if all further cells are empty."""
    cells = list(row.cells)
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return Row(row.number, cells + [""] * (width - len(cells)) if any(cells) else cells)


def _check_pairs(columns: Sequence[Sequence[str]], first: Row) -> None:
    """Refuse pairs of whole numbers between commas, which may be decimal commas."""
    digits = re.compile(r"[+-]?\d+")
    if all(digits.fullmatch(cell) for cells in columns for cell in cells):
        raise InputError(
            f"line {first.number}: {','.join(first.cells)!r} may be a number or two. Separate"
            " columns with ';', or write decimal points"
        )


def _decimal_mark(
    columns: Sequence[Sequence[str]],
    numeric: Sequence[int],
    rows: Sequence[Row],
    separator: str,
    stated: str | None,
) -> str | None:
    """Return the decimal mark of a file, or None if its numbers have no mark (step 2).

    The number 1.020 means 1.02 in some countries
    and 1020 in others. Such a file is refused
    unless the caller or a different cell decides.
    """
    # A cell such as 0.5 or 1.02 shows that its mark stands before decimals.
    example: dict[str, str] = {}  # by mark: a cell that contains it, with its line
    decimal: set[str] = set()  # marks that stand where a mark of thousands cannot stand
    cells = [(row.number, row.cells[column]) for row in rows for column in numeric]
    for mark in ".,":
        for number, cell in cells:
            if mark in cell and NUMBER.match(cell):
                example.setdefault(mark, f"line {number} has {cell!r}")
                if not _THOUSANDS[mark].match(cell):
                    decimal.add(mark)
                    example[mark] = f"line {number} has {cell!r}"
                    break
    if stated is not None:
        if (thousands := _OTHER[stated]) in decimal:
            text = f"{thousands!r} does not mark thousands. Pass decimal={thousands!r}"
            raise InputError(f"{example[thousands]}, in which {text}")
        return stated
    if len(example) == 2:
        raise InputError(
            f"{example[',']}, and {example['.']}: two decimal marks. Pass decimal=',' if points"
            " mark thousands, and decimal='.' if commas do"
        )
    # Programs write the same number of decimals in a column: 980 above
    # 1.020 means 1020.
    whole = any(
        any(map(str.isdigit, columns[i])) and any("." in cell for cell in columns[i])
        for i in numeric
    )
    for mark in {*example} - decimal:
        if mark == "," or separator in (";", "\t") or whole:
            raise InputError(
                f"{example[mark]}, which may have three decimals or be a thousand times as large."
                f" Pass decimal={mark!r} or decimal={_OTHER[mark]!r}"
            )
    return next(iter(example), None)


def _numbers(cells: Sequence[str], words: set[str], mark: str | None) -> list[float | None]:
    """Return the numbers in a column (step 3)."""
    if mark != "," and not any("_" in cell for cell in cells):
        with suppress(ValueError):
            return list(map(float, cells))
    return [_number(cell, words, mark) for cell in cells]


def _number(cell: str, words: set[str], mark: str | None) -> float | None:
    """Return the number in a cell, NaN for a missing value, None for any other text."""
    if cell.casefold() in words or not cell.strip("*"):
        return math.nan
    cell = _GROUPS.sub(lambda match: match[1] + re.sub(r"\D", "", match[2]), cell)
    cell = cell.replace("\N{MINUS SIGN}", "-")
    if mark is not None:
        thousands = _OTHER[mark]
        if thousands in cell and _THOUSANDS[thousands].match(cell):
            cell = cell.replace(thousands, "")
        if mark == "," and "." not in cell:
            cell = cell.replace(",", ".")
    try:
        return None if "_" in cell else float(cell)  # Python accepts 1_000
    except ValueError:
        return None


# -- step 4: headings ----------------------------------------------------------------------------


def _headings(header: list[Row], width: int) -> list[tuple[str, dict[str, str]]]:
    """Return the name, the heading and the unit of each column (step 4)."""
    header = [row for row in header if not {*row.cells} <= {"", "-"}]
    if not header:
        return [(str(number), {"heading": ""}) for number in range(width)]
    number, names = header[-1]
    if len(names) != width:
        raise InputError(
            f"line {number} names {len(names)} columns, the numbers below it have {width}. Begin"
            " comment lines with '#', or pass skip= with the number of lines above the headings"
        )
    # A row below the names may hold the units.
    units = [""] * width
    if len(header) > 1 and len(header[-2].cells) == width and _are_units(names):
        units = [cell.strip("()[]{} ") for cell in names]
        names = header[-2].cells
    headings = []
    for column, (heading, below) in enumerate(zip(names, units, strict=True)):
        name, unit = name_and_unit(heading)
        if unit and below not in ("", unit):
            raise InputError(f"{heading!r} has {below!r} below it, which is another unit")
        unit = unit or below
        name = name if heading else str(column)  # such as the index that pandas writes
        headings.append((name, {"heading": heading} | ({"units": unit} if unit else {})))
    return headings


def _are_units(cells: Iterable[str]) -> bool:
    """Return whether a row states units: each of its cells is a unit or empty."""
    bare = [cell.strip("()[]{} ") for cell in cells]
    known = [cell for cell in bare if parse(cell)]
    clear = any(cell not in ("1", "-", "%") for cell in known)
    return clear and len(known) == len([cell for cell in bare if cell])


def name_and_unit(text: str) -> tuple[str, str]:
    """Split a heading, such as 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm' or 'tau MPa'."""
    text = text.strip()
    if text[-1:] in tuple(")]}") and (start := max(map(text.rfind, "([{"))) >= 0:
        return text[:start].strip(" _"), text[start + 1 : -1].strip()
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    *before, last = re.split(r"[\s,_:]+(?:in\s+)?", text)
    if len(last) > 1 and parse(last) is not None:  # a single letter may be the name
        name = text[: text.rindex(last)].rstrip(" ,_:") if before else ""
        return name.removesuffix(" in"), last
    return text, ""


_SIZE = re.compile(r"(width|height|value units)\s*[:=]\s*(?:([\d.,eE+-]+)\s*)?(\S*)$", re.I)


def sizes_of(comments: Iterable[str]) -> dict[str, tuple[float, str]]:
    """Return from comments the 'width', 'height' and 'value units' of a map, with their units."""
    matches = filter(None, map(_SIZE.match, comments))
    return {m[1].lower(): (float(m[2] or 1.0), m[3]) for m in matches}
