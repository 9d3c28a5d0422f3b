"""Files of measured data: tables, .npy and NetCDF. Nothing in them is trusted."""

from __future__ import annotations

import csv
import io
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.files import content_of
from stiction.base.model import describe
from stiction.base.units import parse

if TYPE_CHECKING:
    import xarray as xr

TEXT, EXCEL, NETCDF = (".csv", ".txt", ".dat", ".tsv"), ".xlsx", (".nc", ".nc4")

_EMPTY = ("", "nan", "na", "n/a", "null", "none", "-", "--")
_WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}])?|[(\[{][^)\]}]*[)\]}]")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]\s*$")


def load(path: Path) -> xr.Dataset | xr.DataArray:
    """Read a file: its variables, those of a table along 'row', or the one array of an .npy."""
    import xarray as xr

    ending = path.suffix.lower()
    if ending in (*TEXT, EXCEL):
        return read_table(path)
    if ending == ".npy":
        array = _read_npy(path)
        return xr.DataArray(array, dims=("x", "y")[: array.ndim])
    if ending not in NETCDF:
        endings = ", ".join((".npy", *TEXT, EXCEL, *NETCDF))
        raise InputError(
            f"must end in {endings}, got {path.name!r}; export text from the instrument"
        )
    content_of(path, read=False)
    try:
        # Times are not decoded: a variable in seconds is refused by its unit, like any other.
        with xr.open_dataset(path, decode_times=False, decode_timedelta=False) as opened:
            data = opened.squeeze(drop=True)
            return data[[name for name, one in data.items() if one.dtype.kind in "fiu"]].load()
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise InputError(f"is not a NetCDF file of numbers: {error}") from None


def _read_npy(path: Path) -> Array:
    data = content_of(path)
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception as error:  # numpy lets through whatever Python's own parser raises
        text = (str(error) or "its header cannot be read").splitlines()[0]
        raise InputError(f"is not a .npy file of numbers: {text}") from None
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    array = np.squeeze(array.astype(np.float64))
    if array.ndim not in (1, 2) or array.size == 0:
        raise InputError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    return array


def read_table(path: Path) -> xr.Dataset:
    """Read a table of numbers from a text file, or from the first sheet of a workbook.

    Columns are separated by semicolons, tabs, commas or blanks, in this order; the decimal
    sign may be a comma unless commas separate. Lines that begin with ``#`` are comments.
    The last line above the numbers names the columns, or states their units below a line of
    names; without one, the last comment may name them. Columns become variables along
    'row', NaN where a cell is empty; those without names are called by their numbers, from
    0. What is empty at the end is left out. The attribute `lines` has the number of each
    row's line; `text` of a column without any number says what it holds.
    """
    import xarray as xr

    if path.suffix.lower() == EXCEL:
        rows, comment, separator = _sheet(path), "", ""
    else:
        rows, comment, separator = _lines(path)
    while rows and not any(rows[-1][1]):
        rows.pop()
    width = max((i for _, cells in rows for i, cell in enumerate(cells, 1) if cell), default=0)
    rows = [(number, cells[:width]) for number, cells in rows]
    values = [[_number(cell, separator) for cell in cells] for _, cells in rows]
    with_numbers = [row for row in values if any(v == v for v in row if v is not None)]
    if not with_numbers:
        raise InputError("holds no numbers")
    numeric = [i for i, v in enumerate(with_numbers[-1]) if v is not None and v == v]

    def is_header(place: int) -> bool:
        own, cells = values[place], rows[place][1]
        at = [i for i in numeric if i < len(own)]
        return not any(cells[i] for i in at) or any(own[i] is None for i in at)

    start = next(place for place in range(len(rows)) if not is_header(place))
    header, rows, values = rows[:start], rows[start:], values[start:]
    for number, cells in header[-1:]:
        named = [cells[i] for i in numeric if i < len(cells)]
        wrong = [cell for cell in named if _number(cell, separator) is None]
        if len(wrong) < len(named):  # no names: a value that went wrong
            raise InputError(f"line {number}: {describe(wrong[0])} is not a number")
    if not header and comment:
        cells = [comment] if width == 1 else _split(comment, separator)
        header = [(0, cells)] if len(cells) == width else []
    integers = all(re.fullmatch(r"[+-]?\d+", cell) for _, cells in rows for cell in cells)
    if separator == "," and not header and width == 2 and integers:
        raise InputError(
            f"line {rows[0][0]}: {','.join(rows[0][1])!r} may be one number or two; separate"
            " columns with ';', or write decimal points"
        )
    first = len(rows[0][1])
    for number, cells in rows:
        if len(cells) != first:
            raise InputError(
                f"line {number} has {len(cells)} columns, line {rows[0][0]} has {first}"
            )
    columns = np.array(values, dtype=np.float64).T
    texts: dict[int, str] = {}  # such as dates: nobody may want a column without a number
    for (number, cells), own in zip(rows, values, strict=True):
        for column, (cell, value) in enumerate(zip(cells, own, strict=True)):
            if value is None:
                texts.setdefault(column, f"line {number}: {describe(cell)} is not a number")
    if mixed := [text for column, text in texts.items() if np.isfinite(columns[column]).any()]:
        raise InputError(mixed)
    data = xr.Dataset(attrs={"lines": [number for number, _ in rows]})
    for number, (name, about) in enumerate(_headings(header, first)):
        if name in data:
            name = about["heading"] if about["heading"] not in data else f"{name} {number}"
        data[name] = ("row", columns[number], about | {"text": texts.get(number, "")})
    return data


def _lines(path: Path) -> tuple[list[tuple[int, list[str]]], str, str]:
    """Return the cells of each line with its number, the last comment above them, and what
    separates them.
    """
    lines: list[tuple[int, str]] = []
    comment = ""
    for number, line in enumerate(_text(path).splitlines(), 1):
        if line.lstrip().startswith("#"):
            comment = comment if lines else line.strip().lstrip("#").strip()
        elif line.strip():
            lines.append((number, line))
    separator = _separator([line for _, line in lines])
    return [(number, _split(line, separator)) for number, line in lines], comment, separator


def _sheet(path: Path) -> list[tuple[int, list[str]]]:
    import pandas as pd

    options: Any = {"header": None, "dtype": str, "na_filter": False, "engine": "openpyxl"}
    try:
        sheet = pd.read_excel(io.BytesIO(content_of(path)), **options)
    except ImportError:
        raise InputError("needs openpyxl (pip install openpyxl), or save it as .csv") from None
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise InputError(f"is not a workbook: {error}") from None
    rows = enumerate(sheet.to_numpy().tolist(), 1)
    return [(number, [cell.strip() for cell in row]) for number, row in rows]


def _text(path: Path) -> str:
    """Return the text of a file in UTF-8, UTF-16 with a mark, or else Windows' western code."""
    data = content_of(path)
    try:
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InputError("is not a text file")
    return text


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
    if separator != " ":
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    cells = line.split()
    if all(_number(cell, " ") is not None for cell in cells):
        return cells
    return [cell.strip() for cell in _WORDS.findall(line)]


def _number(cell: str, separator: str) -> float | None:
    """Return the number in a cell, NaN if it is empty or says so, None for a text."""
    if cell.lower() in _EMPTY:
        return math.nan
    if separator != "," and cell.count(",") == 1 and "." not in cell:
        cell = cell.replace(",", ".")
    try:
        return None if "_" in cell else float(cell)  # Python reads 1_000, people do not
    except ValueError:
        return None


def _headings(
    header: list[tuple[int, list[str]]], width: int
) -> list[tuple[str, dict[str, str]]]:
    if not header:
        return [(str(number), {}) for number in range(width)]
    number, names = header[-1]
    if len(names) != width:
        raise InputError(
            f"line {number} names {len(names)} columns, the numbers below it have {width}; begin"
            " comment lines with '#'"
        )
    units = [""] * width
    bare = [cell.strip("()[]{} ") for cell in names]
    if len(header) > 1 and len(header[-2][1]) == width and any(map(parse, filter(None, bare))):
        names, units = header[-2][1], bare
    found = []
    for heading, below in zip(names, units, strict=True):
        name, unit = name_and_unit(heading)
        if unit and below not in ("", unit):
            raise InputError(f"{heading!r} has {below!r} below it, which is another unit")
        unit = unit or below
        found.append((name, {"heading": heading} | ({"units": unit} if unit else {})))
    return found


def name_and_unit(text: str) -> tuple[str, str]:
    """Take a heading apart: 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm', 'tau MPa'."""
    if match := _BRACKETS.match(text):
        return match["name"].strip(), match["unit"]
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    *before, last = re.split(r"[\s,_:]+(?:in\s+)?", text.strip())
    if len(last) > 1 and parse(last) is not None:  # one letter may be the name
        name = text[: text.rindex(last)].rstrip(" ,_:") if before else ""
        return name.removesuffix(" in"), last
    return text.strip(), ""
