"""Files of measured data: tables, .npy and NetCDF. Nothing in them is trusted."""

from __future__ import annotations

import csv
import io
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
    """Read a table of numbers from a text file, or from the sheet of a workbook that has numbers.

    Columns are separated by semicolons, tabs, commas or blanks, in this order; the decimal sign may
    be a comma unless commas separate. Lines that begin with ``#`` are comments; the last one before
    the numbers names the columns if no other line does. Names may have a line of units below them,
    and titles above them. Columns become variables along 'row', NaN where a cell is empty; those
    without names are called by their numbers, from 0. What is empty at the end is left out. The
    attribute `lines` has the number of each row's line; `text` of a column without any number says
    what it holds.
    """
    import xarray as xr

    lines: list[tuple[int, str]] = []
    comment, separator = "", ""
    if path.suffix.lower() == EXCEL:
        rows = _sheet(path)
    else:
        for number, line in enumerate(_text(path).splitlines(), 1):
            if line.lstrip().startswith("#"):
                comment = comment if lines else line.strip().lstrip("#").strip()
            elif line.strip():
                lines.append((number, line))
        separator = _separator([line for _, line in lines])
        rows = [(number, _split(line, separator)) for number, line in lines]
    while rows and not any(rows[-1][1]):
        rows.pop()
    width = max((i for _, cells in rows for i, cell in enumerate(cells, 1) if cell), default=0)
    rows = [(number, cells[:width]) for number, cells in rows]
    header: list[tuple[int, list[str]]] = []
    numeric = [_number(cell, separator) is not None for cell in rows[-1][1]] if rows else []
    while rows and _is_heading(rows[0][1], numeric, separator):
        if header and _states(header[-1][1]) and _is_gap(rows[0][1]):
            break  # below units: a row of missing values
        header.append(rows.pop(0))
    while header and _has_number(header[-1][1], separator):  # refused below
        rows.insert(0, header.pop())
    while any(
        _has_number(cells, separator) for _, cells in header
    ):  # titles such as 'Probe;12'
        header.pop(0)
    if not rows:
        raise InputError("holds no numbers")
    start, first = rows[0]
    if not header and comment:
        cells = [comment] if len(first) == 1 else _split(comment, separator)
        header = [(0, cells)] if len(cells) == len(first) else []
    integers = all(re.fullmatch(r"[+-]?\d+", cell) for _, cells in rows for cell in cells)
    if separator == "," and not header and len(first) == 2 and integers:
        raise InputError(
            f"line {start}: {','.join(first)!r} may be one number or two; separate columns"
            " with ';', or write decimal points"
        )
    columns = np.full((len(first), len(rows)), np.nan)
    texts: dict[int, str] = {}  # such as dates: nobody may want a column without a number
    for place, (number, cells) in enumerate(rows):
        if len(cells) != len(first):
            raise InputError(
                f"line {number} has {len(cells)} columns, line {start} has {len(first)}"
            )
        for column, cell in enumerate(cells):
            value = _number(cell, separator)
            if value is not None:
                columns[column, place] = value
            elif cell.lower() not in _EMPTY:
                texts.setdefault(column, f"line {number}: {describe(cell)} is not a number")
    if mixed := [text for column, text in texts.items() if np.isfinite(columns[column]).any()]:
        raise InputError(mixed)
    data = xr.Dataset(attrs={"lines": [number for number, _ in rows]})
    for number, (name, about) in enumerate(_headings(header, len(first))):
        if name in data:
            name = about["heading"] if about["heading"] not in data else f"{name} {number}"
        data[name] = ("row", columns[number], about | {"text": texts.get(number, "")})
    return data


def _sheet(path: Path) -> list[tuple[int, list[str]]]:
    """Return the rows of the one sheet of a workbook that holds numbers."""
    import pandas as pd

    options: Any = {"sheet_name": None, "header": None, "dtype": str, "na_filter": False}
    try:
        sheets = pd.read_excel(io.BytesIO(content_of(path)), engine="openpyxl", **options)
    except ImportError:
        raise InputError("needs openpyxl (pip install openpyxl), or save it as .csv") from None
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise InputError(f"is not a workbook: {error}") from None
    tables = {str(name): sheet.to_numpy().tolist() for name, sheet in sheets.items()}
    found = [name for name, rows in tables.items() if any(map(_has_number, rows))]
    if len(found) != 1:
        raise InputError(f"must have numbers on one sheet, got {', '.join(found) or 'none'}")
    return [(n, [cell.strip() for cell in row]) for n, row in enumerate(tables[found[0]], 1)]


def _is_heading(cells: list[str], numeric: list[bool], separator: str) -> bool:
    """Whether a row has no numbers, or other text where there are numbers in the end."""
    pairs = zip(cells, numeric, strict=False)
    text = any(
        n and c.lower() not in _EMPTY and _number(c, separator) is None for c, n in pairs
    )
    return text or not _has_number(cells, separator)


def _is_gap(cells: list[str]) -> bool:
    """Whether a row says that its values are missing, as '-' or 'nan' do."""
    return any(cells) and all(cell.lower() in _EMPTY for cell in cells)


def _has_number(cells: list[str], separator: str = "") -> bool:
    return any(_number(cell, separator) is not None for cell in cells)


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
    if all(_number(cell, " ") is not None or cell.lower() in _EMPTY for cell in cells):
        return cells
    return [cell.strip() for cell in _WORDS.findall(line)]


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and cell.count(",") == 1 and "." not in cell:
        cell = cell.replace(",", ".")
    try:
        return None if "_" in cell else float(cell)  # Python reads 1_000, people do not
    except ValueError:
        return None


def _headings(
    header: list[tuple[int, list[str]]], width: int
) -> list[tuple[str, dict[str, str]]]:
    """Return the name and the attributes of each column."""
    if not header:
        return [(str(number), {}) for number in range(width)]
    rows = [(number, cells) for number, cells in header if len(cells) == width]
    if not rows:
        number, cells = header[-1]
        raise InputError(
            f"line {number} names {len(cells)} columns, the numbers below it have"
            f" {width}; begin comment lines with '#'"
        )
    # Titles stand above the names, and units below them: the last line that states units counts.
    filled = [sum(map(bool, cells)) for _, cells in rows]
    first = filled.index(max(filled))
    names, units = rows[first][1], [""] * width
    for number, cells in rows[first + 1 :]:
        bare = [cell.strip("()[]{} ") for cell in cells]
        if any(map(parse, filter(None, bare))):
            if any(units):
                raise InputError(f"line {number} is a second line of units")
            units = bare
        elif sum(map(bool, cells)) == max(filled) and (_states(cells) or not _states(names)):
            names = cells
    found = []
    for heading, below in zip(names, units, strict=True):
        name, unit = name_and_unit(heading)
        if unit and below not in ("", unit):
            raise InputError(f"{heading!r} has {below!r} below it, which is another unit")
        unit = unit or below
        found.append((name, {"heading": heading} | ({"units": unit} if unit else {})))
    return found


def _states(headings: list[str]) -> bool:
    """Whether any of them states a unit."""
    return any(name_and_unit(heading)[1] for heading in headings)


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
