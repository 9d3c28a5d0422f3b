"""Files of measured data: text tables, .npy and NetCDF, with nothing trusted."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import describe
from stiction.units import parse

if TYPE_CHECKING:
    import xarray as xr

TEXT, NETCDF = (".csv", ".txt", ".dat", ".tsv"), (".nc", ".nc4")
LARGEST = 2**30
"""Bytes; a profile is one line of numbers, and what is larger than this is something else."""
OF_A_PLANE = (
    "; a map over x and y is read with the plane it belongs to,"
    " interface=st.Interface(length=(Lx, Ly), nodes=(nx, ny))"
)
"""What to do with two dimensions where a line was expected."""


def load(path: Path, value: Any, dims: tuple[str, ...]) -> xr.Dataset:
    """The variables of a file; those of a table are along 'row'."""
    import xarray as xr

    ending = path.suffix.lower()
    if ending in TEXT:
        return _dataset(read_table(path))
    if ending in NETCDF:
        _content(path, read=False)
        try:
            # Times are not decoded: a variable in seconds is refused by its unit, like any other.
            with xr.open_dataset(path, decode_times=False, decode_timedelta=False) as opened:
                kept = [
                    name for name, one in opened.data_vars.items()
                    if one.dtype.kind in "fiu" and one.nbytes <= LARGEST
                    and sum(size != 1 for size in one.shape) == len(dims)
                ]  # fmt: skip
                return opened[kept].squeeze(drop=True).load()
        except (OSError, ValueError, RuntimeError, KeyError, AttributeError, TypeError) as error:
            raise InputError(f"is no NetCDF file of numbers: {error}") from None
    if ending != ".npy":
        raise InputError(
            f"a profile must end in {', '.join(('.npy', *TEXT, *NETCDF))}, got {path.name!r}; files"
            " of instruments: give what SurfaceTopography.read_topography(path) returns"
        )
    array = read_npy(path)
    if len(dims) == 2:
        if value is not None:
            raise InputError(
                "value: a .npy file of a plane holds one array, without names; got"
                f" {describe(value)}"
            )
        if array.ndim != 2:
            raise InputError(f"must have shape (nx, ny), got shape {array.shape}")
        return xr.Dataset({"0": (dims, array, {"unnamed": True})})
    if array.ndim == 1 and array.size:
        return _dataset(Table([None], [None], [None], array[np.newaxis]))
    if array.ndim == 2 and array.size and value is not None:
        blank: list[None] = [None] * array.shape[1]
        return _dataset(Table(blank, blank, blank, array.T))
    hint = f"; of an array of columns say which: x=0, value=1{OF_A_PLANE}" * (array.ndim == 2)
    raise InputError(f"must hold one profile, shape (nodes,), got shape {array.shape}{hint}")


def _dataset(table: Table) -> xr.Dataset:
    """The columns as variables along 'row'."""
    import xarray as xr

    variables: dict[str, Any] = {}
    for number, (name, unit, heading, column) in enumerate(zip(*table, strict=True)):
        attributes: dict[str, Any] = {"units": unit} if unit else {}
        attributes["number"] = number
        attributes |= {"unnamed": True} if name is None else {"heading": heading}
        key = str(number) if name is None else name
        if key in variables:
            key = str(heading) if heading not in variables else f"{key} {number}"
        variables[key] = ("row", column, attributes)
    return xr.Dataset(variables)


def _content(path: Path, *, read: bool = True) -> bytes:
    """All of a regular file of reasonable size."""
    try:
        size = os.stat(path).st_size
        if not path.is_file():
            raise InputError("is not a regular file")
        if size > LARGEST:
            raise InputError(f"has {size} bytes, more than the {LARGEST} of a profile")
        return path.read_bytes() if read else b""
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None


def read_npy(path: Path) -> Array:
    try:
        array = np.load(io.BytesIO(_content(path)), allow_pickle=False)
    except InputError:
        raise
    except Exception as error:  # numpy lets through whatever Python's own parser raises
        text = str(error).splitlines()[0] if str(error) else "its header cannot be read"
        raise InputError(f"is not a .npy file of numbers: {text}") from None
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    return np.squeeze(array.astype(np.float64))


_EMPTY = ("", "nan", "na", "n/a", "null", "none", "-", "--")
_WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}])?|[(\[{][^)\]}]*[)\]}]")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]\s*$")


class Table(NamedTuple):
    """Columns of numbers.

    Attributes
    ----------
    names, units, headings : sequences of str or None
        One entry for each column; None where the file says nothing.
    columns : (columns, lines) array
        NaN where a cell is empty.
    """

    names: Sequence[str | None]
    units: Sequence[str | None]
    headings: Sequence[str | None]
    columns: Array


def read_table(path: Path) -> Table:
    """Read a table of numbers from a text file.

    Columns are separated by semicolons, tabs, commas or blanks, in this order of preference; the
    decimal sign may be a comma unless commas separate. Lines that begin with ``#`` are comments;
    the last one before the numbers names the columns if no other line does. Names may have a line
    of units below them, and lines of another number of cells above them.

    Raises
    ------
    InputError
        Naming the line that does not fit.
    """
    lines: list[Any] = []
    comment = ""
    for number, line in enumerate(_decoded(path).splitlines(), 1):
        if line.lstrip().startswith("#"):
            comment = comment if lines else line.strip().lstrip("#").strip()
        elif line.strip():
            lines.append((number, line))
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
    whole = re.compile(r"[+-]?\d+$")
    if separator == "," and not header and width == 2 and all(
        whole.match(cell) for _, cells in rows for cell in cells
    ):  # fmt: skip
        raise InputError(
            f"line {rows[0][0]}: {','.join(rows[0][1])!r} may be one number or two; separate"
            " columns with ';', or write decimal points"
        )
    columns = np.full((width, len(rows)), np.nan)
    for place, (number, cells) in enumerate(rows):
        if len(cells) != width:
            raise InputError(
                f"line {number} has {len(cells)} columns, line {rows[0][0]} has {width}"
            )
        for column, cell in enumerate(cells):
            value = _number(cell, separator)
            if value is None and cell.lower() not in _EMPTY:
                raise InputError(f"line {number}: {describe(cell)} is no number")
            columns[column, place] = np.nan if value is None else value
    if not header and comment:
        cells = _split(comment, separator)
        header = [(0, cells)] if len(cells) == width else [(0, [comment])] if width == 1 else []
    return Table(*_headings(header, width), columns)


def _decoded(path: Path) -> str:
    """The text of a file: UTF-8 or UTF-16 with a mark, or else Windows' western code page."""
    data = _content(path)
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError("is not a text file")


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
) -> tuple[list[str | None], list[str | None], list[str | None]]:
    rows = [(number, cells) for number, cells in header if len(cells) == width]
    if header and not rows:
        number, cells = header[-1]
        raise InputError(
            f"line {number} names {len(cells)} columns, the numbers below it have {width}; begin"
            " lines that are no names with '#'"
        )
    if not rows:
        return [None] * width, [None] * width, [None] * width
    pairs = [name_and_unit(cell) for cell in rows[0][1]]
    names: list[str | None] = [name for name, _ in pairs]
    units = [unit for _, unit in pairs]
    for number, cells in rows[1:]:
        for column, cell in enumerate(cells):
            inner = _BRACKETS.match(cell)
            stated = inner["unit"] if inner and not inner["name"] else cell
            if not stated:
                continue
            if units[column] is not None or number != rows[1][0]:
                raise InputError(f"line {number}: {describe(cell)} is neither a number nor a unit")
            units[column] = stated
    return names, units, list(rows[0][1])


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Take a heading apart: 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm', 'tau MPa'."""
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
