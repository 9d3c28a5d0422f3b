"""Files of measured data: tables, .npy, NetCDF and images. Nothing in them is trusted.

A table is text, or a sheet of a workbook. It is read in five steps:

1. Lines become cells. The last lines with numbers show what separates them.
2. Lines above the first line of numbers are headings, a line of units below them, or words of
   the instrument. Empty lines are passed over.
3. One decimal mark holds for the whole file. Where points or commas may also mark thousands,
   the file is refused unless the caller states the mark.
4. Cells become numbers, and NaN where they are empty or say that a value is missing.
5. Headings are taken apart into names and units.

Files above `LARGE` bytes follow the same steps for their first lines; pandas reads the others if
they are all of the same kind, and the steps above read the whole file if they are not.
"""

from __future__ import annotations

import csv
import io
import math
import re
import warnings
import zipfile
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.files import check_unpacked, content_of
from stiction.base.model import describe
from stiction.base.netcdf import read_netcdf
from stiction.base.units import is_in, parse

if TYPE_CHECKING:
    import xarray as xr

TEXT, EXCEL, NETCDF = (".csv", ".txt", ".dat", ".tsv", ".asc", ".xyz"), ".xlsx", (".nc", ".nc4")
IMAGES = (".png", ".tif", ".tiff")
INSTRUMENTS = (
    ".sur", ".al3d", ".plu", ".plux", ".opd", ".opdx", ".x3p", ".sdf", ".vk3", ".vk4", ".vk6",
    ".vk7", ".gwy", ".os3d", ".lext", ".nms", ".zon", ".datx", ".mnt", ".oir", ".frt", ".spm",
    ".ibw", ".nid",
)  # fmt: skip
"""Binary files of profilometers and microscopes, which SurfaceTopography reads."""
LARGE = 2**19
"""Bytes of a text from which on pandas reads the lines behind the first of them."""
MAX_UNEVEN_CELLS = 2**19
"""Cells of a text that pandas cannot read: each takes hundreds of bytes and microseconds."""
END = 20
"""Lines at the end of a text that show what separates its columns."""
HEAD = 2**16
"""Bytes of a large text that show how the others are written."""
MAX_COLUMNS = 2_000
"""Columns of a table; a file with more has its values in a single line."""
MAX_LETTERS = 1_000
"""Letters of a cell or of a comment: Python takes a long number apart slowly."""
MAX_CELLS, CELLS_OF_SMALL, CELLS_A_BYTE = 2**23, 2**18, 4
"""Cells of a sheet, whose empty cells take memory, too: at most the first, and at most the second
or this many times the size of the file."""
UNPACKED_BYTES, UNPACKED_TIMES = 2**23, 20
"""A workbook unpacks to at most this many bytes, or to this many times its size."""
ABOUT_BYTES = 2**20
"""Of what describes a workbook, such as styles, beside its sheets, texts and images."""
SHEETS, PICTURES = ("xl/worksheets/", "xl/sharedStrings"), ("xl/media/", "docProps/thumb")

_EMPTY = {
    "", "-", "--", "---", "nan", "na", "n/a", "<na>", "#n/a", "#na", "null", "none", "#div/0!",
    "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind", "#wert!", "#value!", "#nv",
}  # fmt: skip
"""What stands in a cell without a value, in small letters; a row of stars is such a cell, too."""
# Patterns never go back over what they have passed: time grows linearly with the size of a file.
_WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}]?)?|[(\[{][^)\]}]*[)\]}]?")
_NUMBER = re.compile(
    r"[+-]?(?:(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
    r"|\d{1,3}(?:(?:,\d{3})+(?:\.\d*)?|(?:\.\d{3})+(?:,\d*)?))$"
)
_BETWEEN = r"['\N{RIGHT SINGLE QUOTATION MARK} \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}]"
_GROUPS = re.compile(rf"([+-]?\d{{1,3}})((?:{_BETWEEN}\d{{3}})+)(?!\d)")
_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?!\d)")
    for mark in ".,"
}
"""Numbers whose mark may be one of thousands: 1.020 and 1.020.000, but 0.020 and 1.02 are not."""


class Options(NamedTuple):
    """What a caller knows about the file."""

    skip: int = 0
    sheet: int | str = 0
    missing: tuple[float | str, ...] | None = None
    decimal: str | None = None
    record: int | None = None

    @property
    def words(self) -> set[str]:
        """Cells without a value, in small letters."""
        given = [one for one in self.missing or () if isinstance(one, str)]
        return _EMPTY | {word.strip().casefold() for word in given}


class Row(NamedTuple):
    """A line of a table: its number, from 1, and its cells."""

    number: int
    cells: list[str]


class Grid(NamedTuple):
    """The cells of a file, and what stands around them."""

    rows: list[Row]
    comments: list[str]  # above the numbers
    separator: str  # empty if the file is a workbook


class Table(NamedTuple):
    """Numbers of a table by column, and what its head and its lines say of them."""

    columns: Array  # (columns, rows)
    header: list[Row]
    lines: Array  # the number of each row's line
    blocks: Array  # the number of each row's block; empty lines separate blocks
    texts: dict[int, str]  # what a column without any number holds
    mark: str | None  # the decimal mark that was seen


def load(path: Path, options: Options = Options()) -> xr.Dataset | xr.DataArray:  # noqa: B008
    """Read a file: its variables, those of a table along 'row', or the one array of an .npy."""
    import xarray as xr

    ending = path.suffix.lower()
    if ending in (*TEXT, EXCEL):
        return read_table(path, options)
    if ending == ".npy" or ending in IMAGES:
        array = _read_npy(path) if ending == ".npy" else _read_image(path)
        return xr.DataArray(array, dims=("x", "y")[: array.ndim])
    if ending in INSTRUMENTS:
        return _read_instrument(path)
    if ending not in NETCDF:
        endings = ", ".join((".npy", *TEXT, EXCEL, *NETCDF, *IMAGES, *INSTRUMENTS))
        raise InputError(
            f"must end in {endings}, got {path.name!r}; export text from the instrument"
        )
    data = read_netcdf(content_of(path)).squeeze(drop=True)
    data = data[[name for name, one in data.items() if one.dtype.kind in "fiu"]]
    data.attrs = {}
    for variable in data.variables.values():
        given = variable.attrs
        variable.attrs = {key: given[key] for key in ("unit", "units") if key in given}
    return data


def _read_npy(path: Path) -> Array:
    data = content_of(path)
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception as error:  # numpy lets through whatever Python's own parser raises
        text = (str(error) or "its header cannot be read").splitlines()[0]
        raise InputError(f"is not a .npy file of numbers: {text}") from None
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "bfiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    array = np.squeeze(array.astype(np.float64))
    if array.ndim not in (1, 2) or array.size == 0:
        raise InputError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    return array


def _read_instrument(path: Path) -> xr.DataArray:
    """Return the heights in a binary file of an instrument."""
    content = content_of(path)
    try:
        from SurfaceTopography import read_topography
    except ImportError:
        raise InputError(
            "needs SurfaceTopography (pip install 'stiction[instruments]'), or export text from the"
            " instrument"
        ) from None
    try:
        surface = read_topography(io.BytesIO(content))
    except Exception:  # the library lets through whatever a broken file leads to
        raise InputError(
            "is damaged, or of a kind that SurfaceTopography does not read; export text from the"
            " instrument"
        ) from None
    return heights_of(surface)


def heights_of(surface: Any) -> xr.DataArray:
    """Return the heights of an object of SurfaceTopography over x, and y of a map."""
    import xarray as xr

    *places, heights = surface.positions_and_heights()
    unit = surface.unit or ""
    if unit not in ("", None) and parse(unit) is None:
        with suppress(UnicodeError):  # UTF-8 that the library read as Latin-1
            unit = unit.encode("latin-1").decode("utf-8")
    values = np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan)
    dims = ("x", "y")[: values.ndim]
    first: Any = [(slice(None), 0), (0, slice(None))] if values.ndim == 2 else [slice(None)]
    along = [np.asarray(at)[index] for at, index in zip(places, first, strict=True)]
    attributes = {"units": unit} if unit else {}
    coords = {dim: (dim, at, attributes) for dim, at in zip(dims, along, strict=True)}
    return xr.DataArray(values, coords, dims, "height", attributes)


def _read_image(path: Path) -> Array:
    """Return the grey values of an image, (nx, ny); its first line is at y = 0."""
    from PIL import Image

    content = content_of(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(content), formats=("PNG", "TIFF"))
        with image:
            check_unpacked(image.width * image.height, content, MAX_CELLS, 1)
            grey = np.asarray(image)
    except InputError:
        raise
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise InputError(f"is not an image: {error}") from None
    if grey.ndim != 2 or grey.dtype.kind not in "fiu":
        raise InputError(f"must be a grey image, got shape {grey.shape} of {grey.dtype}")
    return grey.T.astype(np.float64)


# -- tables --------------------------------------------------------------------------------------


def read_table(path: Path, options: Options = Options()) -> xr.Dataset:  # noqa: B008
    """Read a table of numbers from a text file, or from a sheet of a workbook.

    Columns are separated by semicolons, tabs, commas or blanks. Lines that begin with ``#``
    are comments. The last line above the numbers names the columns, or states their units
    below a line of names; without one, the last comment may name them. Columns become
    variables along 'row', NaN where a cell is empty; those without names are called by their
    numbers, from 0. The attribute `lines` has the number of each row's line, `comments` the
    comments, `headed` is whether columns have names; `text` of a column without any number
    says what it holds.
    """
    if path.suffix.lower() == EXCEL:
        grid = _sheet(path, options)
        table = _parsed(grid, options)
    else:
        content = content_of(path)
        if content.startswith((b"\xff\xfe", b"\xfe\xff")):
            content = _text(content).encode()
        large = _large(content, options) if len(content) > LARGE else None
        if large is None:
            marks = max(map(content.count, (b",", b";", b"\t")))
            cells = max(marks + content.count(b"\n"), len(content.split()))
            if cells > MAX_UNEVEN_CELLS:
                raise InputError(
                    f"has about {cells} cells in lines of different kinds; a text of more than"
                    f" {MAX_UNEVEN_CELLS} holds no comments, blank lines or remarks between or"
                    " below the numbers, and the same number of cells in each line"
                )
            grid = _lines(_text(content), options)
            table = _parsed(grid, options)
        else:
            grid, table = large
    if options.record is not None:
        table = _record(table, options.record)
    width = len(table.columns)
    attributes = {
        "lines": table.lines, "blocks": table.blocks,
        "comments": grid.comments, "headed": any({*row.cells} - {"", "-"} for row in table.header),
    }  # fmt: skip
    headings = _headings(table.header, width)
    for number, (_, about) in enumerate(headings[1:], 1):  # the first may be an index
        unnamed = attributes["headed"] and not about["heading"]
        if unnamed and not np.isnan(table.columns[number]).all():
            raise InputError(
                f"column {number} has numbers, such as in line {table.lines[0]}, but no heading; if"
                " commas mark thousands, separate columns with ';'"
            )
    return _labelled([*table.columns], headings, table.texts, attributes)


def table_of_frame(frame: Any) -> xr.Dataset:
    """Return a DataFrame whose columns have headings as the table of a file."""
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


def _parsed(grid: Grid, options: Options) -> Table:
    """Return the numbers of a table (steps 2 to 4)."""
    words, separator = options.words, grid.separator
    rows = [row for row in grid.rows if any(row.cells)]
    start, numeric = _start(rows, words)
    header, rows = rows[:start], rows[start:]
    if header and rows:  # a heading that is repeated begins another block
        again = header[-1].cells
        rows = [row for row in rows if row.cells != again]
    # Empty cells at the end of all rows, as of a trailing separator, are no columns.
    width = max(len(row.cells) for row in rows)
    while not any(len(row.cells) >= width and row.cells[width - 1] for row in rows):
        width -= 1
    if width > MAX_COLUMNS:
        raise InputError(
            f"line {rows[0].number} has {width} columns, more than {MAX_COLUMNS}; write each value"
            " of a profile into a line of its own"
        )
    for row in rows:
        if len(row.cells) < width:
            most = next(row.number for row in rows if len(row.cells) >= width)
            raise InputError(
                f"line {row.number} has {len(row.cells)} columns, line {most} has {width}"
            )
    if not header and grid.comments:
        comment = grid.comments[-1]
        cells = [comment] if width == 1 else _split(comment, separator, words)
        header = [Row(0, cells)] if len(cells) == width and not _is_size(comment) else []
    header = [_without_empty_end(row, width) for row in header]
    columns = [list(cells) for cells in zip(*(row.cells[:width] for row in rows), strict=True)]
    _check_integers(columns, header, rows, separator)
    mark, marked = _decimal_mark(columns, numeric, rows, separator, options.decimal)
    numbers = np.empty((width, len(rows)))
    texts, mixed = {}, []
    for column, cells in enumerate(columns):
        try:
            numbers[column] = list(map(float, cells))
            if not marked and not any("_" in cell for cell in cells):
                continue
        except ValueError:
            pass
        values = [_number(cell, words, mark) for cell in cells]
        numbers[column] = [math.nan if value is None else value for value in values]
        if None in values:
            wrong = values.index(None)
            text = f"line {rows[wrong].number}: {describe(cells[wrong])} is not a number"
            texts[column] = text
            if np.isfinite(numbers[column]).any():
                mixed.append(
                    f"{text}; if it stands for no value, pass missing={cells[wrong]!r}"
                )
    if mixed:
        raise InputError(mixed)
    lines = np.array([row.number for row in rows])
    blocks = np.cumsum(np.diff(lines, prepend=lines[0]) > 1)
    return Table(numbers, header, lines, blocks, texts, mark)


def _start(rows: Sequence[Row], words: set[str]) -> tuple[int, list[int]]:
    """Return the index of the first row of numbers, and the columns that hold numbers."""

    def is_value(cell: str, or_empty: bool = False) -> bool:
        value = _number(cell, words, None)
        return bool(_NUMBER.match(cell)) or (value is not None and (or_empty or value == value))

    last = next((row for row in reversed(rows) if any(map(is_value, row.cells))), None)
    if last is None:
        raise InputError("holds no numbers")
    numeric = [i for i, cell in enumerate(last.cells) if is_value(cell)]

    def is_header(row: Row) -> bool:
        cells = [row.cells[i] for i in numeric if i < len(row.cells)]
        return {*row.cells} <= {"", "-"} or any(not is_value(cell, True) for cell in cells)

    start = next(place for place, row in enumerate(rows) if not is_header(row))
    if start > 0 and not _are_units(rows[start - 1].cells):
        number, cells = rows[start - 1]
        named = [cells[i] for i in numeric if i < len(cells) and cells[i]]
        wrong = [cell for cell in named if not is_value(cell, True)]
        if len(wrong) < len(named) and wrong:  # no names: a value that went wrong
            text = f"line {number}: {describe(wrong[0])} is not a number"
            raise InputError(f"{text}; if it stands for no value, pass missing={wrong[0]!r}")
    return start, numeric


def _are_units(cells: Iterable[str]) -> bool:
    """Return whether a row states units: each cell is one, or empty."""
    bare = [cell.strip("()[]{} ") for cell in cells]
    known = [cell for cell in bare if parse(cell)]
    return len(known) == len([cell for cell in bare if cell]) and any(
        cell not in ("1", "-", "%") for cell in known
    )


def _without_empty_end(row: Row, width: int) -> Row:
    cells = list(row.cells)
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return Row(row.number, cells + [""] * (width - len(cells)) if any(cells) else cells)


def _check_integers(
    columns: Sequence[Sequence[str]], header: list[Row], rows: list[Row], separator: str
) -> None:
    """Refuse pairs of whole numbers between commas, which may be decimal commas."""
    if separator == "," and not header and len(columns) == 2:
        digits = re.compile(r"[+-]?\d+")
        if all(digits.fullmatch(cell) for cells in columns for cell in cells):
            raise InputError(
                f"line {rows[0].number}: {','.join(rows[0].cells)!r} may be one number or two;"
                " separate columns with ';', or write decimal points"
            )


def _decimal_mark(
    columns: Sequence[Sequence[str]],
    numeric: Sequence[int],
    rows: Sequence[Row],
    separator: str,
    stated: str | None,
) -> tuple[str | None, bool]:
    """Return the decimal mark of a file, and whether its cells must be rewritten.

    A comma or a point may also mark thousands: 1.020 is 1.02 in one country and 1020 in
    another. That is refused unless another cell decides, or the caller.
    """
    first: dict[str, str] = {}  # a cell with each mark, with its line
    told: set[str] = set()  # marks that stand where none of thousands can stand
    for column in numeric:
        for row, cell in enumerate(columns[column]):
            for mark in ".,":
                if mark in cell and mark not in told and _NUMBER.match(cell):
                    first.setdefault(mark, f"line {rows[row].number} has {cell!r}")
                    if not _THOUSANDS[mark].match(cell):
                        told.add(mark)
                        first[mark] = f"line {rows[row].number} has {cell!r}"
        if len(told) == 2:
            break
    if stated is not None:
        (thousands,) = {".", ","} - {stated}
        if thousands in told:
            raise InputError(
                f"{first[thousands]}, in which {thousands!r} does not mark thousands; pass"
                f" decimal={thousands!r}"
            )
        return stated, bool(first)
    if len(first) == 2:
        raise InputError(
            f"{first[',']}, and {first['.']}: two decimal marks; if points mark thousands, pass"
            " decimal=',', and decimal='.' if commas do"
        )
    # Programs write the same number of decimals in a column; 980 above 1.020 is 1020.
    bare = any(
        any(map(str.isdigit, columns[i])) and any("." in cell for cell in columns[i])
        for i in numeric
    )
    doubtful = {
        mark for mark in first if mark == "," or separator in (";", "\t") or bare
    } - told
    for mark in doubtful:
        (thousands,) = {".", ","} - {mark}
        raise InputError(
            f"{first[mark]}, which may be a number with three decimals or a thousand times as"
            f" large; pass decimal={mark!r} or decimal={thousands!r}"
        )
    return (next(iter(first)), "," in first) if first else (None, False)


def _number(cell: str, words: set[str], mark: str | None) -> float | None:
    """Return the number in a cell, NaN if it is empty or says so, None for a text."""
    if cell.casefold() in words or not cell.strip("*"):
        return math.nan
    if not cell[-1:].isdigit() and cell[-1:] not in ".,fFyY":  # inf, infinity
        return None
    cell = _GROUPS.sub(lambda match: match[1] + re.sub(r"\D", "", match[2]), cell)
    cell = cell.replace("\N{MINUS SIGN}", "-")
    if mark is not None:
        (thousands,) = {".", ","} - {mark}
        if thousands in cell and _THOUSANDS[thousands].match(cell):
            cell = cell.replace(thousands, "")
        if mark == "," and "." not in cell:
            cell = cell.replace(",", ".")
    try:
        return None if "_" in cell else float(cell)  # Python reads 1_000, people do not
    except ValueError:
        return None


def _record(table: Table, record: int) -> Table:
    """Return one block of a table."""
    chosen = table.blocks == record
    if not chosen.any():
        raise InputError(f"record: must be 0 to {table.blocks[-1]}, got {record}")
    return table._replace(
        columns=table.columns[:, chosen], lines=table.lines[chosen], blocks=table.blocks[chosen]
    )


# -- where cells come from -----------------------------------------------------------------------


def _lines(text: str, options: Options) -> Grid:
    """Return the cells of each line of a text, and the comments above them (step 1)."""
    lines: list[tuple[int, str]] = []
    comments: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if number <= options.skip:
            continue
        if line.lstrip().startswith("#"):
            if not lines:
                comments.append(line.strip().lstrip("#").strip()[:MAX_LETTERS])
        elif line.strip():
            lines.append((number, line))
    if lines and lines[0][1].strip().startswith("sep="):  # what Excel writes and reads
        lines = lines[1:]
    separator = _separator([line for _, line in lines])
    for number, line in lines:
        if len(line) > MAX_LETTERS:
            _check_line(number, line, separator)
    if separator == " ":
        rows = [Row(number, _split(line, " ", options.words)) for number, line in lines]
    else:
        cells = csv.reader([line for _, line in lines], delimiter=separator)
        try:
            rows = [
                Row(n, [c.strip() for c in row])
                for (n, _), row in zip(lines, cells, strict=True)
            ]
        except (ValueError, csv.Error):
            raise InputError("has a quotation mark that does not end in its line") from None
    return Grid(rows, comments, separator)


def _check_line(number: int, line: str, separator: str) -> None:
    """Refuse a line of very many columns, or with a very long cell."""
    blank = separator == " "
    cells = line.split(None if blank else separator, 2 * MAX_COLUMNS)
    if len(cells) > 2 * MAX_COLUMNS:
        raise InputError(
            f"line {number} has {line.count(separator) + 1} columns; write each value of a"
            " profile into a line of its own"
        )
    runs = re.split(r"\s{2,}", line) if blank else cells
    if (letters := max(map(len, runs if len(runs) > 1 else cells))) > MAX_LETTERS:
        raise InputError(
            f"line {number} has a cell of {letters} letters, at most {MAX_LETTERS}"
        )


def _large(content: bytes, options: Options) -> tuple[Grid, Table] | None:
    """Return a large table whose lines are all of the same kind; None for any other."""
    import pandas as pd

    end = content.find(b"\n", HEAD) + 1
    if end == 0:
        return None
    with suppress(InputError, UnicodeDecodeError, ValueError):
        grid = _lines(_text(content[:end]), options)
        table = _parsed(grid, options)
        body, width = content[end:].rstrip(), len(table.columns)
        separator = {" ": r"\s+"}.get(grid.separator, grid.separator)
        marks = body.count(grid.separator.encode()) if separator != r"\s+" else -1
        lines = body.count(b"\n") + 1
        trailing = len(grid.rows[-1].cells) - width
        even = marks in (-1, lines * (width + trailing - 1))
        # From pandas 3 on numbers are read to the last digit without being asked to.
        exact: Any = {"float_precision": "round_trip"} if pd.__version__ < "3" else {}
        words = [w for word in options.words for w in (word, word.upper(), word.title())]
        whole_numbers = b"." not in body and (separator == "," or b"," not in body)
        if (table.mark or whole_numbers) and even and b"#" not in body:
            numeric = [column for column in range(width) if column not in table.texts]
            frame = pd.read_csv(
                io.BytesIO(body), sep=separator, header=None, decimal=table.mark or ".",
                names=range(width + trailing), index_col=False, keep_default_na=False,
                na_values=words, skip_blank_lines=False, usecols=numeric,
                encoding="utf-8",
                **exact,
            ).reindex(columns=range(width))  # fmt: skip
            whole = all(kind.kind in "fiu" for kind in frame.dtypes) and len(frame) == lines
            blank = separator == r"\s+" and frame[numeric].isna().to_numpy().any()
            if whole and not blank:
                first = table.lines[-1] + 1
                return grid, table._replace(
                    columns=np.hstack([table.columns, frame.to_numpy(np.float64).T]),
                    lines=np.r_[table.lines, first : first + lines],
                    blocks=np.r_[table.blocks, np.full(lines, table.blocks[-1])],
                )
    return None


def _sheet(path: Path, options: Options) -> Grid:
    content = content_of(path)
    try:
        import openpyxl
    except ImportError:
        raise InputError("needs openpyxl (pip install openpyxl), or save it as .csv") from None
    try:
        _check_workbook(content)
        book = openpyxl.load_workbook(
            io.BytesIO(content), read_only=True, data_only=True, keep_links=False
        )
        names = [sheet.title for sheet in book.worksheets]
        known = options.sheet in (
            range(len(names)) if isinstance(options.sheet, int) else names
        )
        place = (
            options.sheet
            if isinstance(options.sheet, int) or not known
            else names.index(options.sheet)
        )
        rows = _cells_of(book.worksheets[place], len(content)) if known else []
    except InputError:
        raise
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise InputError(f"is not a workbook: {error}") from None
    if not known:
        raise InputError(
            f"sheet: {options.sheet!r} is not one of {', '.join(map(repr, names))}"
        )
    if len(names) > 1 and not any(any(map(_NUMBER.match, row.cells)) for row in rows):
        raise InputError(
            f"sheet {names[0]!r} holds no numbers; pass sheet= for another:"
            f" {', '.join(map(repr, names))}"
        )
    return Grid(rows[options.skip :], [], "")


def _check_workbook(content: bytes) -> None:
    """Refuse a workbook whose parts unpack to very much."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        sizes = {part.filename: part.file_size for part in archive.infolist()}
    check_unpacked(sum(sizes.values()), content, UNPACKED_BYTES, UNPACKED_TIMES)
    about = [name for name in sizes if not name.startswith(SHEETS + PICTURES)]
    check_unpacked(sum(sizes[name] for name in about), b"", ABOUT_BYTES, 0)


def _cells_of(sheet: Any, size: int) -> list[Row]:
    """Return the cells of a sheet as texts; `size` is the number of bytes of its file."""
    most = min(MAX_CELLS, max(CELLS_OF_SMALL, CELLS_A_BYTE * size))
    sheet.reset_dimensions()  # what a workbook says of its size need not be true
    rows, width = [], 0
    for number, values in enumerate(sheet.iter_rows(values_only=True, max_row=2**20), 1):
        cells = ["" if value is None else str(value).strip() for value in values]
        width = max(width, len(cells))
        if width * number > most or width > MAX_COLUMNS:
            raise InputError(
                f"spans {number} rows and {width} columns or more, beyond the limit of {most}"
                f" cells for its size, or of {MAX_COLUMNS} columns"
            )
        rows.append(Row(number, cells))
    for row in rows:
        row.cells.extend([""] * (width - len(row.cells)))
    return rows


def _text(data: bytes) -> str:
    """Return a text in UTF-8, UTF-16 with a mark, or else Windows' western code."""
    try:
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InputError("is not a text file (UTF-8, or UTF-16 with a byte order mark)")
    return text


def _separator(lines: Sequence[str]) -> str:
    """Return what separates columns, as most of the last lines with numbers show it."""
    ends = [line for line in lines[-2 * END :] if re.search(r"\d", line)][-END:]
    for mark in (";", "\t"):
        if ends and 2 * sum(mark in line for line in ends) >= len(ends):
            return mark
    last = ends[-1] if ends else ""
    # Blanks separate numbers with decimal commas: '0,1 1000,5'; but '0.1, 1000.5' has commas.
    between = re.search(r"\d\s+[+-]?\d", last) and not re.search(r",\s", last)
    return " " if "," not in last or between else ","


def _split(line: str, separator: str, words: set[str]) -> list[str]:
    if separator not in ("", " "):
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    cells = line.split()
    if all(_NUMBER.match(cell) or cell.casefold() in words for cell in cells):
        return cells
    return [cell.strip() for cell in _WORDS.findall(line)]


def column_of(
    table: Any, kinds: Sequence[str], units: Iterable[str] = (), wanted: int | str | None = None
) -> Any:
    """Return the column that is wanted, or whose name begins with one of some words.

    Without such a name it is the only one in one of the units, or None.
    """
    if wanted is not None:
        keys = ("name", "heading", "column")
        chosen = [
            c for c in table.values() if str(wanted) in [c.attrs.get(key) for key in keys]
        ]
        if len(chosen) != 1:
            names = ", ".join(map(repr, table.data_vars))
            raise InputError(
                f"{wanted!r} is not one column of {names}; pass its number, from 0"
            )
        return chosen[0]
    words = {
        name: re.split(r"[\s_:.]", name.strip("_:. ").lower())[0] for name in table.data_vars
    }
    called = [name for name, word in words.items() if word in kinds]
    if len(called) > 1:
        raise InputError(
            f"{' and '.join(map(repr, called))} may both be the {kinds[0]}; rename one"
        )
    fitting = [
        name
        for name, column in table.items()
        if any(is_in(column.attrs.get("units"), si) for si in units)
    ]
    called = called or (fitting if len(fitting) == 1 else [])
    return table[called[0]] if called else None


# -- headings ------------------------------------------------------------------------------------


def _headings(header: list[Row], width: int) -> list[tuple[str, dict[str, str]]]:
    """Return the name, the heading and the unit of each column (step 5)."""
    header = [row for row in header if not {*row.cells} <= {"", "-"}]
    if not header:
        return [(str(number), {"heading": ""}) for number in range(width)]
    number, names = header[-1]
    if len(names) != width:
        raise InputError(
            f"line {number} names {len(names)} columns, the numbers below it have {width}; begin"
            " comment lines with '#', or pass skip= with the number of lines above the headings"
        )
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


def name_and_unit(text: str) -> tuple[str, str]:
    """Take a heading apart: 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm', 'tau MPa'."""
    text = text.strip()
    if text[-1:] in tuple(")]}") and (start := max(map(text.rfind, "([{"))) >= 0:
        return text[:start].strip(" _"), text[start + 1 : -1].strip()
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    *before, last = re.split(r"[\s,_:]+(?:in\s+)?", text.strip())
    if len(last) > 1 and parse(last) is not None:  # one letter may be the name
        name = text[: text.rindex(last)].rstrip(" ,_:") if before else ""
        return name.removesuffix(" in"), last
    return text.strip(), ""


_SIZE = re.compile(r"(width|height|value units)\s*[:=]\s*(?:([\d.,eE+-]+)\s*)?(\S*)$", re.I)


def _is_size(comment: str) -> bool:
    return _SIZE.match(comment) is not None


def sizes_of(comments: Iterable[str]) -> dict[str, tuple[float, str]]:
    """Return what comments state of an image: width, height and value units, with their units."""
    matches = filter(None, map(_SIZE.match, comments))
    return {m[1].lower(): (float(m[2] or 1.0), m[3]) for m in matches}
