"""Read files of measured data, chosen by their endings.

A file may come from a stranger.

Each reader takes these steps:

1. Take the whole content of a regular file (`base/files.py`).
2. Compare the size that the file states with a limit, before anything
   is unpacked.
3. Let a library read the content. Any failure of the library becomes a
   line for the user.
4. Return an array with its names and units.

A table is a text file or a sheet of a workbook. Its lines are split
into cells here, and `tables.py` reads the numbers in them. For a text
above `LARGE` bytes, both read the first lines. pandas then reads the
other lines if all are alike. Otherwise the whole text is read
line by line.
"""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.files import check_unpacked, content_of, refuse_damage
from stiction.base.netcdf import read_netcdf
from stiction.problem.reading.columns import Table
from stiction.problem.reading.tables import (
    GROUPS,
    NUMBER,
    Grid,
    Options,
    Row,
    split_at_blanks,
    table_of,
)

if TYPE_CHECKING:
    import xarray as xr

TEXT, EXCEL = (".csv", ".txt", ".dat", ".tsv", ".asc", ".xyz", ".lvm"), ".xlsx"
LARGE = 2**19
"""Size of a text, bytes, above which pandas reads all lines but the first."""
HEAD = 2**16
"""Bytes at the start of a large text that show its dialect."""
MAX_UNEVEN_CELLS = 2**19
"""Cells of a text that pandas cannot read. Each cell takes hundreds of
bytes and microseconds."""
SEPARATORS = (";", "\t", " ", ",", "")
"""Separators of columns. A single column has none."""
END, MAX_LINES_COMPARED, HEADING = 40, 150, 2
"""Lines at the start of a text, and in the rest of it, that show the
separator, and the number of lines for which a heading counts."""
_CELL = re.compile(
    rf"(?!.*,$)(?:$|{NUMBER.pattern}|{GROUPS.pattern}(?:[.,]\d*)?$|[\W_]+$|[^\W\d][^;,\t]*$"
    r"|\d+[^\W\d_]\w*$|\d+[-/]\d+$"
    r"|\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?:[ T]\s*\d[\d:.,]*)?$|\d{1,2}:\d{2}[\d:.,]*$)"
)
"""Cells of rows with data: nothing, numbers, marks, words, names such
as 1a, dates and times."""
MAX_COLUMNS = 2_000
"""Columns of a table. A file with more columns holds its values in a
single line."""
MAX_LETTERS = 1_000
"""Letters of a cell or of a comment, because Python converts long
numbers slowly."""
MAX_CELLS, CELLS_OF_SMALL, CELLS_A_BYTE = 2**23, 2**18, 4
"""Cells of a sheet: in any case, in a small file, and per byte of a
larger file. Empty cells take memory too."""
UNPACKED_BYTES, UNPACKED_TIMES = 2**23, 20
"""Unpacked size of a workbook: bytes of a small one, and multiples of
the size of a larger one."""
ABOUT_BYTES = 2**20
"""Unpacked size of the parts apart from sheets, texts and images, such
as styles."""
SHEETS, PICTURES = ("xl/worksheets/", "xl/sharedStrings"), ("xl/media/", "docProps/thumb")

NETCDF = (".nc", ".nc4")


def load(path: Path, options: Options) -> Table | xr.Dataset | Array:
    r"""Read a file as a table, as variables, or as an .npy array.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.TXT"
    >>> _ = path.write_text("x;F\n2;1,5\n3;2,5\n")
    >>> load(path, Options()).source, load(path, Options()).headed, load(path, Options(1)).headed
    ('a.TXT', True, False)
    >>> np.save(path.with_suffix(".npy"), [[3], [4]])
    >>> load(path.with_suffix(".npy"), Options())
    array([3., 4.])
    >>> load(Path("a.pdf"), Options())  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must end in .csv, .txt, ... .nc4, got 'a.pdf'. Export...
    """
    ending = path.suffix.lower()
    if ending in (*TEXT, EXCEL):
        return read_table(path, options)
    if ending == ".npy":
        return _read_npy(content_of(path))
    if ending in NETCDF:
        return _read_netcdf(content_of(path))
    endings = ", ".join((*TEXT, EXCEL, ".npy", *NETCDF))
    raise InputError(f"must end in {endings}, got {path.name!r}. Export it as text")


def read_table(path: Path, options: Options = Options()) -> Table:  # noqa: B008  # a tuple
    """Read a table of numbers from a text file or a sheet of a workbook.

    Semicolons, tabs, commas or blanks separate columns. Lines that
    begin with ``#`` are comments. The last line above the numbers holds
    the column names, or their units below a line of names. If
    there is no such line, the last comment may hold the names.
    """
    content = content_of(path)
    if path.suffix.lower() == EXCEL:
        return table_of(_sheet(content, options), options, path.name)
    return _table_of_text(content, options, path.name)


# -- cells of a text -----------------------------------------------------------------------------


def _table_of_text(content: bytes, options: Options, source: str) -> Table:
    r"""Return the table in a text.

    >>> for encoding in ("utf-8", "utf-16"):
    ...     table = _table_of_text("x;F (N)\n2;3.5\n".encode(encoding), Options(), "a.csv")
    ...     print([(c.heading, c.values.tolist()) for c in table.columns], table.source)
    [('x', [2.0]), ('F (N)', [3.5])] a.csv
    [('x', [2.0]), ('F (N)', [3.5])] a.csv
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = _text(content).encode()
    if len(content) > LARGE:
        if (large := _large(content, options, source)) is not None:
            return large
        marks = max(map(content.count, (b",", b";", b"\t"))) + content.count(b"\n")
        cells = max(marks, len(content.split()))
        if cells > MAX_UNEVEN_CELLS:
            raise InputError(
                f"has about {cells} cells in lines of different kinds, more than"
                f" {MAX_UNEVEN_CELLS}. Remove remarks, and give each line the same number of cells"
            )
    return table_of(_lines(_text(content), options), options, source)


def _text(data: bytes) -> str:
    """Decode UTF-8, UTF-16 with a byte order mark, or otherwise the western encoding of Windows.

    >>> [_text("5 µm".encode(name)) for name in ("utf-8", "utf-8-sig", "utf-16", "cp1252")]
    ['5 µm', '5 µm', '5 µm', '5 µm']
    >>> _text(bytes([65, 0]))
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: is not a text file (UTF-8, or UTF-16 with a byte order mark)
    """
    try:
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InputError("is not a text file (UTF-8, or UTF-16 with a byte order mark)")
    return text


def _lines(text: str, options: Options) -> Grid:
    r"""Return the cells of each line of a text, and the comments above them.

    Lines are numbered as in the file. Excel writes the line with sep=:

    >>> lines = ["skipped", "## x;F #", "sep=;", "", " 2; 3,5", "# below", '4;"a;b"', "6;c"]
    >>> grid = _lines("\n".join(lines), Options(skip=1))
    >>> [(row.number, row.cells) for row in grid.rows], grid.comments, grid.separator
    ([(5, ['2', '3,5']), (7, ['4', 'a;b']), (8, ['6', 'c'])], ['x;F #'], ';')

    Blanks separate the cells of other lines:

    >>> grid = _lines("7\n 8\n", Options())
    >>> [row.cells for row in grid.rows], grid.separator
    ([['7'], ['8']], ' ')
    >>> [row.cells for row in _lines("x (mm)  F\n1  2\n3 -\n", Options()).rows]
    [['x (mm)', 'F'], ['1', '2'], ['3', '-']]
    """
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
    if lines and lines[0][1].strip().startswith("sep="):  # Excel writes and reads such a line
        lines = lines[1:]
    separator = _separator([line for _, line in lines], options.words)
    for number, line in lines:
        if len(line) > MAX_LETTERS:
            _check_line(number, line, separator)
    if separator in (" ", ""):
        rows = [Row(number, _split(line, separator, options.words)) for number, line in lines]
        return Grid(rows, comments, separator or " ")
    split = csv.reader([line for _, line in lines], delimiter=separator)
    try:
        pairs = [*zip(lines, split, strict=True)]
    except (ValueError, csv.Error):
        raise InputError("has a quotation that does not end in its line") from None
    rows = [Row(number, [cell.strip() for cell in cells]) for (number, _), cells in pairs]
    return Grid(rows, comments, separator)


def _separator(lines: Sequence[str], words: set[str]) -> str:
    r"""Return the separator that splits most lines into equally many numbers, times and words.

    If several separators do, the heading is compared first, and then
    the order of `SEPARATORS`. Blanks separate numbers with decimal
    commas, '0,1 1000,5', but commas '0.1, 1000.5'.

    >>> def separator(*lines):
    ...     return _separator(lines, {"n/a"})
    >>> separator("1;2", "3;n/a"), separator("1 2", "3 4"), separator("1\t2", "3\t4")
    (';', ' ', '\t')
    >>> separator("0,1 1000,5"), separator("0.1, 1000.5"), separator(";;", "1,5 2")
    (' ', ',', ' ')
    >>> separator("1", "2"), separator("a", "b")
    ('', ' ')

    The heading decides between thousands and columns. One line with dates
    and words does not count against numbers:

    >>> separator("1 000,5"), separator("a,b", "1 000,5")
    (' ', ',')
    >>> separator("a b;c", "2026-01-02 12:30;x", "1;2")
    ';'
    """
    step = max(1, len(lines) // MAX_LINES_COMPARED)
    sampled = (line[:MAX_LETTERS] for line in (*lines[:END], *lines[END::step]))
    # A row without cells says nothing.
    shown = [line for line in sampled if line.strip("".join(SEPARATORS))]
    ratings = []
    for order, separator in enumerate(SEPARATORS):
        rows = [_split(line, separator, words) for line in shown]
        counts = [
            len(cells) * (any(map(NUMBER.match, cells)) and all(map(_CELL.match, cells)))
            for cells in rows
        ]
        common = Counter(filter(None, counts)).most_common(1)
        if common and (common[0][0] > 1) == bool(separator):
            ((width, count),) = common
            first = counts.index(width)
            headed = first > 0 and len(rows[first - 1]) >= width
            ratings.append((count + HEADING * headed, -order, separator))
    return max(ratings)[-1] if ratings else " "


def _split(line: str, separator: str, words: set[str]) -> list[str]:
    """Return the cells of a line, without blanks, quotation marks and empty cells at its end.

    >>> _split(' 1;"a b";; ', ";", set()), _split(";", ";", set()), _split("1 2", "", set())
    (['1', 'a b'], [''], ['1 2'])
    >>> _split("1  2 ", " ", set())
    ['1', '2']
    """
    if separator == " ":
        return split_at_blanks(line, words)
    cells = [cell.strip(' \t"') for cell in (line.split(separator) if separator else [line])]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _check_line(number: int, line: str, separator: str) -> None:
    r"""Refuse a line with too many columns or with a long cell.

    >>> for line, separator in (("1;" * 2000, ";"), ("1 " * 2000, " "), ("a" * 1000, "")):
    ...     _check_line(3, line, separator)
    >>> for line, separator in (("1;" * 2001, ";"), ("b\t" + "a" * 1001, "\t"), ("a" * 1001, "")):
    ...     try:
    ...         _check_line(3, line, separator)
    ...     except InputError as error:
    ...         print(str(error)[:40])
    line 3 has 2001 columns, more than 2000.
    line 3 has a cell of 1001 characters, mo
    line 3 has a cell of 1001 characters, mo
    """
    cells = line.rstrip(separator).split(None if separator == " " else separator or "\n")
    if len(cells) > MAX_COLUMNS:
        raise InputError(
            f"line {number} has {len(cells)} columns, more than {MAX_COLUMNS}. Write each value"
            " of a profile into a line of its own"
        )
    if (letters := max(map(len, cells), default=0)) > MAX_LETTERS:
        raise InputError(
            f"line {number} has a cell of {letters} characters, more than {MAX_LETTERS}"
        )


def _large(content: bytes, options: Options, source: str) -> Table | None:
    r"""Return a large table if all its lines are alike, and None for any other text.

    >>> lines = [b"x;F\n", *(b"%d;%d.5\n" % (n, n % 7) for n in range(9000))]
    >>> table = _large(b"".join(lines), Options(), "a.csv")
    >>> table.lines[[0, 1, -1]].tolist(), table.lines.size, table.source
    ([2, 3, 9001], 9000, 'a.csv')
    >>> x, force = (column.values for column in table.columns)
    >>> bool((x == np.arange(9000)).all()), bool((force == x % 7 + 0.5).all())
    (True, True)

    Small texts, remarks and uneven lines are left to the slower reader:

    >>> [bool(_large(b"".join(lines[:5000] + e), Options(), "")) for e in ([], [b"# end"])]
    [False, False]
    >>> ends = [b"# end"], [b"8\n"], [b"8;a\n"]
    >>> [bool(_large(b"".join(lines + end), Options(), "")) for end in ends]
    [False, False, False]
    >>> missing = _large(b"".join([*lines, b"8;Bad\n"]), Options(missing="BAD"), "")
    >>> missing.columns[1].values[-2:].tolist()
    [4.5, nan]
    """
    import pandas as pd

    end = content.find(b"\n", HEAD) + 1
    if end == 0:
        return None
    with suppress(InputError, UnicodeDecodeError, ValueError):
        grid = _lines(_text(content[:end]), options)
        table = table_of(grid, options, source)
        if table.left_out or table.begins:
            return None
        body, cells = content[end:].rstrip(), len(grid.rows[-1].cells)
        lines, blank = body.count(b"\n") + 1, grid.separator == " "
        even = blank or body.count(grid.separator.encode()) == lines * (cells - 1)
        whole_numbers = b"." not in body and (grid.separator == "," or b"," not in body)
        if b"#" in body or not (even and (table.mark or whole_numbers)):
            return None
        words = [w for word in options.words for w in (word, word.upper(), word.title())]
        # From pandas 3 on, numbers are always read to the last digit.
        exact: Any = {"float_precision": "round_trip"} if pd.__version__ < "3" else {}
        frame = pd.read_csv(
            io.BytesIO(body), sep=r"\s+" if blank else grid.separator, header=None,
            names=range(cells), index_col=False, decimal=table.mark or ".",
            keep_default_na=False, na_values=words, skip_blank_lines=False, encoding="utf-8",
            **exact,
        )  # fmt: skip
        # With `usecols` pandas would drop further cells in silence.
        frame = frame[[column.number for column in table.columns if not column.text]]
        whole = all(kind.kind in "fiu" for kind in frame.dtypes) and len(frame) == lines
        if whole and not (blank and frame.isna().to_numpy().any()):
            gaps, columns = np.full(lines, np.nan), []
            for column in table.columns:
                below = frame.get(column.number, gaps)
                columns.append(replace(column, values=np.r_[column.values, below], cells=()))
            numbers = np.r_[table.lines, table.lines[-1] + 1 + np.arange(lines)]
            return table._replace(columns=tuple(columns), lines=numbers)
    return None


# -- cells of a workbook -------------------------------------------------------------------------


def _sheet(content: bytes, options: Options) -> Grid:
    """Return the cells in a sheet of a workbook as strings."""
    try:
        import openpyxl
    except ImportError:
        raise InputError("needs openpyxl. Run pip install openpyxl, or save as .csv") from None
    with refuse_damage("a workbook"):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            sizes = {part.filename: part.file_size for part in archive.infolist()}
        check_unpacked(sum(sizes.values()), content, UNPACKED_BYTES, UNPACKED_TIMES)
        about = [size for name, size in sizes.items() if not name.startswith(SHEETS + PICTURES)]
        check_unpacked(sum(about), b"", ABOUT_BYTES, 0)
        book = openpyxl.load_workbook(
            io.BytesIO(content), read_only=True, data_only=True, keep_links=False
        )
        sheets = {sheet.title: sheet for sheet in book.worksheets}
        listed = ", ".join(map(repr, sheets))
        chosen = dict(enumerate(sheets.values())) | sheets
        if options.sheet not in chosen:
            raise InputError(f"sheet: must be one of {listed}, got {options.sheet!r}")
        rows = _cells_of(chosen[options.sheet], len(content))
    if len(sheets) > 1 and not any(any(map(NUMBER.match, row.cells)) for row in rows):
        raise InputError(
            f"sheet {chosen[options.sheet].title!r} holds no numbers. Choose another sheet with"
            f" sheet=: {listed}"
        )
    return Grid(rows[options.skip :], [], "")


def _cells_of(sheet: Any, size: int) -> list[Row]:
    """Return the cells in a sheet as strings. `size` is the size of the file in bytes.

    >>> from types import SimpleNamespace
    >>> sheet = SimpleNamespace(reset_dimensions=lambda: None)
    >>> sheet.iter_rows = lambda **given: iter([(1, None, " a "), (2.5, 0)])
    >>> [(row.number, row.cells) for row in _cells_of(sheet, 10)]
    [(1, ['1', '', 'a']), (2, ['2.5', '0', ''])]
    >>> sheet.iter_rows = lambda **given: iter([(7,) * 2001])
    >>> _cells_of(sheet, 10)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: has 1 or more rows and 2001 or more columns. ...
    """
    most = min(MAX_CELLS, max(CELLS_OF_SMALL, CELLS_A_BYTE * size))
    sheet.reset_dimensions()  # the stated size of a sheet need not be true
    rows, width = [], 0
    for number, values in enumerate(sheet.iter_rows(values_only=True, max_row=2**20), 1):
        cells = ["" if value is None else str(value).strip() for value in values]
        width = max(width, len(cells))
        if width * number > most or width > MAX_COLUMNS:
            raise InputError(
                f"has {number} or more rows and {width} or more columns. A file of its size may"
                f" have {most} cells, and {MAX_COLUMNS} columns"
            )
        rows.append(Row(number, cells))
    return [Row(row.number, row.cells + [""] * (width - len(row.cells))) for row in rows]


# -- arrays --------------------------------------------------------------------------------------


def _read_npy(content: bytes) -> Array:
    """Return the numbers in an .npy file, without dimensions of length one.

    >>> def read(values):
    ...     file = io.BytesIO()
    ...     np.save(file, values)
    ...     return _read_npy(file.getvalue())
    >>> read([[3], [4]]), read([True, False]).tolist()
    (array([3., 4.]), [1.0, 0.0])
    >>> read(["a"])
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must hold numbers, got <U1
    """
    with refuse_damage("a .npy file of numbers"):
        array = np.load(io.BytesIO(content), allow_pickle=False)
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "bfiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    return np.squeeze(array.astype(np.float64))


def _read_netcdf(content: bytes) -> xr.Dataset:
    """Return the numeric variables with their units, without dimensions of length one.

    >>> import tempfile
    >>> import xarray as xr
    >>> path = Path(tempfile.mkdtemp()) / "a.nc"
    >>> force = (["n", "k"], [[3.0], [4.5]], {"units": "kN", "by": "AB"})
    >>> xr.Dataset({"F": force, "who": ("n", ["A", "B"])}).to_netcdf(path, engine="h5netcdf")
    >>> data = _read_netcdf(path.read_bytes())
    >>> [*data.data_vars], data.F.values.tolist(), data.F.dims, data.F.attrs
    (['F'], [3.0, 4.5], ('n',), {'units': 'kN'})
    """
    data = read_netcdf(content).squeeze(drop=True)
    data = data[[name for name, variable in data.items() if variable.dtype.kind in "fiu"]]
    data.attrs = {}
    for variable in data.variables.values():
        given = variable.attrs
        variable.attrs = {key: given[key] for key in ("unit", "units") if key in given}
    return data
