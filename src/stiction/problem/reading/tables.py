"""Numbers and headings in the cells of tables that instruments and colleagues write.

The format of a table is unknown: the rows that hold data, the decimal
mark and the place of the units. A wrong guess could change a value by a
factor of a thousand, so a table that can be read in two ways is
refused. The cells come from `files.py`. The steps are:

1. Find the columns with numbers. Most rows with numbers have them in
   the same columns.
2. Find the rows with data. A row holds data if its cells in these
   columns are numbers or empty. Rows above the first such row are
   headings, units or remarks. Below, repeated headings, remarks and
   statistics (mean, SD, n) are left out, and the table says so. A row
   with another text is refused.
3. Decimal mark, which is the same in the whole file. If points or
   commas may also mark thousands, the file is refused unless the caller
   states `decimal`.
4. Convert cells to numbers, and empty cells and words for a missing
   value to NaN.
5. Split headings into names and units.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from stiction.base.errors import InputError
from stiction.base.model import describe
from stiction.base.units import parse
from stiction.problem.reading.columns import Column, Table, role_of

_EMPTY = {
    "", "-", "--", "---", "nan", "na", "n/a", "<na>", "#n/a", "#na", "null", "none", "#div/0!",
    "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind", "#wert!", "#value!", "#nv",
}  # fmt: skip
"""Words for a missing value, in lower case. A row of stars also marks a
missing value."""
_STATISTICS = (
    "mean average avg median minimum maximum min max std stdev std.dev sd stddev standard deviation"
    " cv cov c.v variance count sum total range mittelwert mittel standardabweichung streuung"
    " variationskoeffizient anzahl summe spannweite moyenne écart-type ecart-type média media"
    " promedio desviación desviacion mw sx"
)
STATISTICS = {*_STATISTICS.split()}
SHORT_STATISTICS = {"x", "x\N{COMBINING MACRON}", "s", "n", "r", "v", "\N{MICRO SIGN}"}
"""First words in rows of statistics. Short ones count if another row of
statistics follows."""
# Patterns never return to letters that they have passed: time grows
# linearly with the file.
WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}]?)?|[(\[{][^)\]}]*[)\]}]?")
NUMBER = re.compile(
    r"[+-]?(?:(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
    r"|\d{1,3}(?:(?:,\d{3})+(?:\.\d*)?|(?:\.\d{3})+(?:,\d*)?))$"
)
_BETWEEN = r"['\N{RIGHT SINGLE QUOTATION MARK} \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}]"
GROUPS = re.compile(rf"([+-]?\d{{1,3}})((?:{_BETWEEN}\d{{3}})+)(?!\d)")
_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?!\d)")
    for mark in ".,"
}
"""Numbers whose mark may separate thousands, such as 1.020 and
1.020.000, not 0.020 or 1.02."""
_OTHER = {".": ",", ",": "."}


class Options(NamedTuple):
    """Options by which the caller describes a file."""

    skip: int = 0
    sheet: int | str = 0
    missing: Any = None  # a number, a word, or a sequence of them
    decimal: str | None = None

    @property
    def stated(self) -> tuple[float | str, ...]:
        """Numbers and words that the caller uses for a missing value.

        >>> Options().stated, Options(missing=0).stated, Options(missing=[-99, "Bad"]).stated
        ((), (0,), (-99, 'Bad'))
        """
        several = self.missing if isinstance(self.missing, tuple | list) else (self.missing,)
        return tuple(value for value in several if value is not None)

    @property
    def words(self) -> set[str]:
        """All words for a missing value, in lower case.

        >>> words = Options(missing=(-99, " Bad")).words
        >>> "bad" in words, "#nv" in words, "-99" in words
        (True, True, False)
        """
        given = {word.strip().casefold() for word in self.stated if isinstance(word, str)}
        return _EMPTY | given


class Row(NamedTuple):
    """A line of a table: its number (from 1), its cells, and their kinds.

    The kinds are 'number', 'missing' and 'word'.
    """

    number: int
    cells: list[str]
    kinds: Sequence[str] = ()

    def of_kind(self, kind: str, columns: Iterable[int]) -> list[str]:
        """Return the cells of a kind in some columns.

        >>> row = Row(7, ["x", "3", "", "4"], ["word", "number", "missing", "number"])
        >>> row.of_kind("number", [0, 2, 3, 9])
        ['4']
        """
        return [self.cells[i] for i in columns if self.kinds[i : i + 1] == [kind]]

    @property
    def text(self) -> str:
        """Text of the line for a message.

        >>> Row(7, ["mean", "", "4"]).text, len(Row(7, ["a" * 99]).text)
        ("line 7 'mean, 4'", 69)
        """
        return f"line {self.number} {', '.join(filter(None, self.cells))[:60]!r}"


class Grid(NamedTuple):
    """The cells of a file, with the comments above them."""

    rows: list[Row]
    comments: list[str]
    separator: str  # empty if the file is a workbook


def table_of_frame(frame: Any) -> Table:
    """Convert a DataFrame with headings to the form of a table from a file.

    An index with fractions holds positions. Text that pandas can convert
    counts as numbers.

    >>> import pandas as pd
    >>> force = pd.Series(["3", None], dtype=object)
    >>> frame = pd.DataFrame({"who": ["5", "B"], "F (N)": force})
    >>> frame.index = pd.Index([0.5, 2.0], name="s (mm)")
    >>> for column in table_of_frame(frame).columns:
    ...     print(column, column.name, column.unit, column.values, column.cells)
    column 0 's (mm)' s mm [0.5 2. ] ()
    column 1 'who' who  [nan nan] ['5', 'B']
    column 2 'F (N)' F N [ 3. nan] ()
    >>> table_of_frame(frame).columns[1].text, table_of_frame(frame).lines.tolist()
    ("column 'who' does not hold numbers", [0, 1])
    >>> for frame in frame.rename_axis(None), frame.reset_index(drop=True):
    ...     print([column.heading for column in table_of_frame(frame).columns])
    ['x', 'who', 'F (N)']
    ['who', 'F (N)']
    """
    import pandas as pd

    headings = [str(name) for name in frame.columns]
    if frame.index.dtype.kind == "f":  # positions
        frame, headings = frame.reset_index(), [str(frame.index.name or "x"), *headings]
    columns = []
    for number, heading in enumerate(headings):
        column, text = frame.iloc[:, number], ""
        values = pd.to_numeric(column, errors="coerce") if column.dtype == object else column
        if values.dtype.kind not in "fiu" or (values.isna() & column.notna()).any():
            text = f"column {heading!r} does not hold numbers"
            values = np.full(len(frame), np.nan)
        cells = [*map(str, column)] if text else ()
        values = np.asarray(values, dtype=np.float64)
        columns.append(Column(*name_and_unit(heading), values, number, heading, text, cells))
    return Table(tuple(columns), "DataFrame", np.arange(len(frame)))


def split_at_blanks(line: str, words: set[str]) -> list[str]:
    """Split a line at blanks, but not between a name and its unit in brackets.

    >>> split_at_blanks("x (in mm)  tau [kPa] at  rest", set())
    ['x (in mm)', 'tau [kPa]', 'at', 'rest']

    A row with data is split at every blank:

    >>> split_at_blanks("1,5  (Bad) 3", {"(bad)"}), split_at_blanks("1,5 (Bad) 3", set())
    (['1,5', '(Bad)', '3'], ['1,5 (Bad)', '3'])
    """
    cells = line.split()
    if all(NUMBER.match(cell) or cell.casefold() in words for cell in cells):
        return cells
    return [cell.strip() for cell in WORDS.findall(line)]


# -- the table -----------------------------------------------------------------------------------


def table_of(grid: Grid, options: Options, source: str) -> Table:
    """Return the columns of a table with names, units and numbers (steps 1 to 5).

    A title, a name with its unit, a unit below a name, separators at the
    ends of lines, and a mean:

    >>> lines = ["Test 7", "x (mm);F;", ";kN;", ";", "0;1,5;", "2;n/a;", "mean;1,5;"]
    >>> rows = [Row(number, line.split(";")) for number, line in enumerate(lines, 3)]
    >>> table = table_of(Grid(rows, [], ";"), Options(), "a.csv")
    >>> [(c.name, c.unit, c.values.tolist(), c.number, c.heading) for c in table.columns]
    [('x', 'mm', [0.0, 2.0], 0, 'x (mm)'), ('F', 'kN', [1.5, nan], 1, 'F')]
    >>> table.source, table.lines.tolist(), table.headed, table.left_out, table.mark
    ('a.csv', [7, 8], True, ("line 9 'mean, 1,5' (statistics)",), ',')

    Words fill the first column. The last comment names the columns:

    >>> rows = [Row(1, ["A", "1.5"]), Row(2, ["B", "2.5"])]
    >>> for grid in (Grid(rows, ["# 7", "who;F (N)"], ";"), Grid(rows, ["who  F (N)"], " ")):
    ...     who, force = table_of(grid, Options(), "").columns
    ...     print(who.heading, who.cells, who.text[:28], force.heading, force.unit)
    who ['A', 'B'] line 1: 'A' is not a number. F (N) N
    who ['A', 'B'] line 1: 'A' is not a number. F (N) N

    Blanks may also separate a name from its unit. A comment that names
    another number of columns is no heading:

    >>> rows = [Row(1, ["0", "1.5"]), Row(2, ["3", "2.5"])]
    >>> table = table_of(Grid(rows, ["x mm  tau kPa"], " "), Options(), "")
    >>> [(column.name, column.unit) for column in table.columns]
    [('x', 'mm'), ('tau', 'kPa')]
    >>> table = table_of(Grid(rows, ["x;tau;n"], ";"), Options(), "")
    >>> [column.name for column in table.columns], table.headed, table.mark
    (['0', '1'], False, '.')

    The first column may be an index. An empty column needs no heading:

    >>> rows = [Row(1, ["", "", "F"]), Row(2, ["0", "", "7"]), Row(3, ["1", "", ""])]
    >>> [column.name for column in table_of(Grid(rows, [], ","), Options(), "").columns]
    ['0', '1', 'F']
    >>> table = table_of(Grid([Row(1, ["-", "-"]), Row(2, ["3", "4.5"])], [], ","), Options(), "")
    >>> table.headed, len(table_of(Grid([Row(1, ["3", "4", "7"])], [], ","), Options(), "")[0])
    (False, 3)
    """
    words, separator = options.words, grid.separator
    rows = [
        row._replace(kinds=[_kind(cell, words) for cell in row.cells])
        for row in grid.rows
        if any(row.cells)
    ]
    # 1.
    numeric = _numeric_columns(rows)
    # 2.
    header, rows, left_out, begins = _rows_of_data(rows, numeric, separator)
    width = max(len(row.cells) for row in rows)
    while not any(len(row.cells) >= width and row.cells[width - 1] for row in rows):
        width -= 1  # a column that is empty in all rows comes from a separator at the end
    rows = _without_cut_end(rows, width, left_out)
    # Without a line of headings, the last comment may name as many
    # columns as there are.
    if not header and grid.comments:
        comment = grid.comments[-1]
        at_blanks = split_at_blanks(comment, words)
        if len(at_blanks) == 2 * width and all(map(parse, at_blanks[1::2])):  # x mm  tau kPa
            at_blanks = [f"{a} ({b})" for a, b in zip(*[iter(at_blanks)] * 2, strict=True)]
        cells = comment.split(separator) if separator.strip() else at_blanks
        cells = [comment] if width == 1 else [cell.strip() for cell in cells]
        header = [Row(0, cells)] if len(cells) == width else []
    header = [_of_width(row, width, separator) for row in header]
    contents = [list(cells) for cells in zip(*(row.cells[:width] for row in rows), strict=True)]
    if separator == "," and not header and width == 2:
        _check_pairs(contents, rows[0])
    numeric = [column for column in numeric if column < width]
    # 3.
    mark = _decimal_mark(contents, numeric, rows, separator, options.decimal)
    # 4. and 5.
    headed = any({*row.cells} - {"", "-"} for row in header)
    headings, columns = _headings(header, width), []
    for number, (cells, heading) in enumerate(zip(contents, headings, strict=True)):
        values, text = _numbers(cells, words, mark), ""
        if None in values:
            wrong = values.index(None)
            text = _not_a_number(rows[wrong].number, cells[wrong])
            if number in numeric:
                raise InputError(text)
        array = np.full(len(rows), math.nan) if text else np.array(values, dtype=np.float64)
        # The first column may be an index.
        if headed and number and not heading[-1] and not np.isnan(array).all():
            raise InputError(
                f"column {number} has numbers, for example in line {rows[0].number}, but no"
                " heading. If commas mark thousands, separate columns with ';'"
            )
        columns.append(
            Column(*heading[:2], array, number, heading[-1], text, cells if text else ())
        )
    lines = np.array([row.number for row in rows])
    return Table(tuple(columns), source, lines, headed, tuple(left_out), begins, mark)


def _not_a_number(line: int, cell: str) -> str:
    """Return the message about a cell that holds no number.

    >>> _not_a_number(4, "1.2.3")
    "line 4: '1.2.3' is not a number. If it marks a missing value, pass missing='1.2.3'"
    """
    advice = f"If it marks a missing value, pass missing={cell!r}"
    return f"line {line}: {describe(cell)} is not a number. {advice}"


def _kind(cell: str, words: set[str]) -> str:
    """Return whether a cell holds a number, a missing value or another word.

    >>> [_kind(cell, {"n/a"}) for cell in ("-1.5", "1'250", "N/A", "***", "A1")]
    ['number', 'number', 'missing', 'missing', 'word']
    """
    value = 0.0 if NUMBER.match(cell) else _number(cell, words, None)
    return "word" if value is None else "number" if value == value else "missing"


def _numeric_columns(rows: Sequence[Row]) -> list[int]:
    """Return the columns in which most rows with numbers have them (step 1).

    Each text shows the kinds of cells: 1 for a number, a for a word and -
    for a missing value. A further column needs two numbers, and more
    numbers than words:

    >>> def columns(*lines):
    ...     kinds = {"1": "number", "a": "word", "-": "missing"}
    ...     return _numeric_columns([Row(0, [], [*map(kinds.get, line)]) for line in lines])
    >>> columns("aaaa", "1a1--", "1-1--", "1a1--", "1a11-", "1a11-", "1a1-1")
    [0, 2, 3]
    >>> columns("11", "11", "1a", "1a"), columns("1-", "1-", "1-", "-1", "-1")
    ([0], [0])
    """
    places = [tuple(i for i, kind in enumerate(row.kinds) if kind == "number") for row in rows]
    counts = Counter(filter(None, places))
    if not counts:
        raise InputError("holds no numbers")
    usual = {*max(counts, key=lambda place: (counts[place], len(place)))}
    values: Counter[int] = Counter()
    texts: Counter[int] = Counter()
    for row, place in zip(rows, places, strict=True):
        if usual & {*place}:
            values.update(place)
            texts.update(i for i, kind in enumerate(row.kinds) if kind == "word")
    return sorted(i for i in values if values[i] > texts[i] and (i in usual or values[i] > 1))


def _rows_of_data(
    rows: Sequence[Row], numeric: Sequence[int], separator: str
) -> tuple[list[Row], list[Row], list[str], tuple[int, ...]]:
    """Return the headings, the rows with data, the rows left out, and where tables begin.

    Means and remarks below the first row with data begin a new table:

    >>> def rows_of(*lines):
    ...     cells = [line.split(";") for line in lines]
    ...     kinds = [[_kind(cell, {"-", ""}) for cell in row] for row in cells]
    ...     return [*map(Row, range(1, len(lines) + 1), cells, kinds)]
    >>> rows = rows_of("mean;3", "x;F", "mm;N", "1;2", "sum;3", "x;F", "3;-", "end;", "4;6")
    >>> header, data, left_out, begins = _rows_of_data(rows, [0, 1], ";")
    >>> [row.number for row in header], [row.number for row in data], begins
    ([2, 3], [4, 7, 9], (4, 7, 9))
    >>> left_out[1:]
    ["line 5 'sum, 3' (statistics)", "line 8 'end' (no numbers)"]
    >>> _rows_of_data(rows_of("1;2", "end;", "-;-", "3;4"), [0, 1], ";")[3]
    (1, 4)
    >>> _rows_of_data(rows[:4], [0, 1], ";")[3]
    ()
    >>> header, data, _, begins = _rows_of_data(rows_of("run;7", "x;F", "1;2"), [0, 1], ";")
    >>> [row.number for row in header], [row.number for row in data], begins
    ([1, 2], [3], ())

    Two words are a remark only if blanks separate cells. A row with a word
    and a number is refused, also above the data:

    >>> rows = rows_of("1;2", "the;end", "3;4")
    >>> _rows_of_data(rows, [0, 1], " ")[2]
    ["line 2 'the, end' (no numbers)"]
    >>> for rows in (rows, rows_of("1;2", "5;x"), rows_of("1;x", "3;4")):
    ...     try:
    ...         _rows_of_data(rows, [0, 1], ";")
    ...     except InputError as error:
    ...         print(str(error)[:25])
    line 2: 'the' is not a nu
    line 2: 'x' is not a numb
    line 1: 'x' is not a numb
    """
    wrong = [row.of_kind("word", numeric) for row in rows]
    has_number = [bool(row.of_kind("number", numeric)) for row in rows]
    left_out, statistics = [], _statistics(rows)
    start = next(
        i for i in range(len(rows)) if i not in statistics and has_number[i] and not wrong[i]
    )
    above = [i for i in range(start) if i not in statistics]
    header = [rows[i] for i in above]
    if header and not _are_units(header[-1].cells) and has_number[above[-1]]:
        # A single value is wrong.
        raise InputError(_not_a_number(header[-1].number, wrong[above[-1]][0]))
    data: list[Row] = []
    known = [row.cells for row in header]
    begins, interrupted = [rows[start].number], False
    for place, row in enumerate(rows):
        if place in statistics:
            left_out.append(f"{row.text} (statistics)")
            interrupted = bool(data)
        elif place < start or row.cells in known:
            continue  # a heading may be repeated above each record
        elif not wrong[place]:
            if interrupted and has_number[place]:
                begins.append(row.number)
                interrupted = False
            data.append(row)
        elif not has_number[place] and (
            len([*filter(None, row.cells)]) < max(2, len(numeric)) or separator == " "
        ):
            left_out.append(f"{row.text} (no numbers)")
            interrupted = True
        else:
            raise InputError(_not_a_number(row.number, wrong[place][0]))
    return header, data, left_out, tuple(begins) if len(begins) > 1 else ()


def _statistics(rows: Sequence[Row]) -> set[int]:
    """Return the rows that begin with the name of a statistic and hold a number (step 2).

    Short names such as n count next to a longer name:

    >>> lines = "n 1", "7 2", "s 3", "Mean: 4", "v 5", "8 6", "SD(3) 7", "who 8", "r 9"
    >>> rows = [Row(0, ["", *line.split()], ["missing", "word", "number"]) for line in lines]
    >>> sorted(_statistics(rows))
    [2, 3, 4, 6]
    >>> _statistics([Row(0, ["mean", "max"], ["word", "word"])])  # headings
    set()
    """
    labels = []
    for row in rows:
        label, kind = next(pair for pair in zip(row.cells, row.kinds, strict=True) if pair[0])
        named = kind == "word" and "number" in row.kinds
        labels.append(label.casefold().rstrip(" .:=") if named else "")
    long = {i for i, label in enumerate(labels) if re.split(r"[\s(]", label)[0] in STATISTICS}
    short = {i for i, label in enumerate(labels) if label in SHORT_STATISTICS}
    known = long | short  # a short name counts next to another
    return long | {i for i in short if known & {i - 1, i + 1}}


def _without_cut_end(rows: list[Row], width: int, left_out: list[str]) -> list[Row]:
    """Leave out a last row that is cut.

    Refuse any other row with too few cells (step 2).

    >>> rows, left_out = [Row(1, ["1", "2"]), Row(2, ["3", "4"]), Row(3, ["5"])], []
    >>> _without_cut_end(rows, 2, left_out) == rows[:2], left_out
    (True, ["line 3 '5' (cut: 1 of 2 cells)"])
    >>> _without_cut_end(rows[::-1], 2, left_out)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: line 3 has 1 cells, but line 2 has 2. ..., or give it 2 cells
    >>> len(_without_cut_end(rows[:2], 2, left_out)), len(left_out)
    (2, 1)
    """
    if len(rows[-1].cells) < width and len(rows) > 1:
        left_out.append(f"{rows[-1].text} (cut: {len(rows[-1].cells)} of {width} cells)")
        rows = rows[:-1]
    for row in rows:
        if len(row.cells) < width:
            most = next(row.number for row in rows if len(row.cells) >= width)
            raise InputError(
                f"line {row.number} has {len(row.cells)} cells, but line {most} has {width}."
                f" Remove line {row.number}, or give it {width} cells"
            )
    return rows


def _of_width(row: Row, width: int, separator: str) -> Row:
    """Return a heading with a cell for each column, without headings beyond the last number.

    Blanks may belong to a name, so a further heading stays and is refused
    later:

    >>> [_of_width(Row(3, ["x", "F", *more]), 2, ";").cells for more in ([], ["note"], [""])]
    [['x', 'F'], ['x', 'F'], ['x', 'F']]
    >>> [_of_width(Row(3, ["x", "F", *more]), 2, " ").cells for more in (["note"], [""])]
    [['x', 'F', 'note'], ['x', 'F']]
    >>> _of_width(Row(3, ["x"]), 3, ";"), _of_width(Row(3, [""]), 3, ";").cells
    (Row(number=3, cells=['x', '', ''], kinds=()), [''])
    """
    cells = list(row.cells)
    while len(cells) > width and (not cells[-1] or separator != " "):
        cells.pop()
    return Row(row.number, cells + [""] * (width - len(cells)) if any(cells) else cells)


def _check_pairs(columns: Sequence[Sequence[str]], first: Row) -> None:
    """Refuse pairs of whole numbers between commas, which may be decimal commas.

    >>> _check_pairs([["1", "2"], ["3", "4.5"]], Row(6, ["1", "3"]))
    >>> _check_pairs([["+1", "2"], ["3", "-45"]], Row(6, ["+1", "3"]))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: line 6: '+1,3' may be one number or two. Separate...
    """
    digits = re.compile(r"[+-]?\d+")
    if all(digits.fullmatch(cell) for cells in columns for cell in cells):
        raise InputError(
            f"line {first.number}: {','.join(first.cells)!r} may be one number or two. Separate"
            " columns with ';', or write decimal points"
        )


def _decimal_mark(
    columns: Sequence[Sequence[str]],
    numeric: Sequence[int],
    rows: Sequence[Row],
    separator: str,
    stated: str | None,
) -> str | None:
    """Return the decimal mark of a file, or None if its numbers have no mark (step 3).

    The number 1.020 means 1.02 in some countries
    and 1020 in others. Such a file is refused
    unless the caller or a different cell says otherwise.

    >>> def mark(*cells, separator=" ", stated=None):
    ...     rows = [Row(number, [cell, "7.5"]) for number, cell in enumerate(cells, 3)]
    ...     try:
    ...         return _decimal_mark([cells, "?"], [0], rows, separator, stated)
    ...     except InputError as error:
    ...         return str(error)[:18]
    >>> mark("1", "2e3"), mark("1.020", "1.5"), mark("-1,020", "0,020"), mark("1.020")
    (None, '.', ',', '.')
    >>> mark("1.020", separator=";"), mark("1.02", separator=";"), mark("1,020,000")
    ("line 3 has '1.020'", '.', "line 3 has '1,020,")
    >>> mark("1.020", separator=chr(9)), mark("1,020", separator=",", stated=",")
    ("line 3 has '1.020'", ',')
    >>> mark("980", "1.020"), mark("x,5", "1,020.5")
    ("line 4 has '1.020'", "line 4 has '1,020.")
    >>> mark("1.020", stated=","), mark("1,020.5", stated="."), mark("980", "1.02", stated=",")
    (',', '.', "line 4 has '1.02',")
    """
    # A cell such as 0.5 or 1.02 shows that its mark separates decimals.
    example: dict[str, str] = {}  # by mark: a cell that contains it, with its line
    decimal: set[str] = set()  # marks at a place that is impossible for thousands
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
    """Return the numbers in a column (step 3).

    >>> _numbers(["1.5", "-2e3"], set(), "."), _numbers(["1,5", "-", "x"], {"-"}, ",")
    ([1.5, -2000.0], [1.5, nan, None])
    >>> _numbers(["1_0", "7"], set(), "."), _numbers(["1,020", "7.5"], set(), ".")
    ([None, 7.0], [1020.0, 7.5])
    >>> _numbers(["1.020"], set(), ","), _numbers(["1.020"], set(), None)
    ([1020.0], [1.02])
    """
    if mark != "," and not any("_" in cell for cell in cells):
        with suppress(ValueError):
            return list(map(float, cells))
    return [_number(cell, words, mark) for cell in cells]


def _number(cell: str, words: set[str], mark: str | None) -> float | None:
    """Return the number in a cell, NaN for a missing value, None for any other text.

    >>> cells = "1.020,5", "1.020", "1 250 000,5", chr(8722) + "3", "Bad", "***", "x", "1_0"
    >>> [_number(cell, {"bad"}, ",") for cell in cells]
    [1020.5, 1020.0, 1250000.5, -3.0, nan, nan, None, None]
    >>> [_number(cell, set(), ".") for cell in ("1,5", "1,020.25", "1.020", "bad", "")]
    [None, 1020.25, 1.02, None, nan]
    """
    if cell.casefold() in words or not cell.strip("*"):
        return math.nan
    cell = GROUPS.sub(lambda match: match[1] + re.sub(r"\D", "", match[2]), cell)
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


# -- step 5: headings ----------------------------------------------------------------------------


def _headings(header: list[Row], width: int) -> list[tuple[str, str, str]]:
    """Return the name, the unit and the heading of each column (step 5).

    >>> _headings([], 2), _headings([Row(1, ["", "F / kN", "(mm)"])], 3)[::2]
    ([('0', '', ''), ('1', '', '')], [('0', '', ''), ('', 'mm', '(mm)')])

    Units may lie below the names, or above them in files of LabVIEW:

    >>> _headings([Row(1, ["x", "tau"]), Row(2, ["(mm)", "kPa"]), Row(3, ["-", ""])], 2)
    [('x', 'mm', 'x'), ('tau', 'kPa', 'tau')]
    >>> labview = [Row(1, ["Y_Unit_Label", "N", "mm"]), Row(2, ["X_Value", "Force", "Slip"])]
    >>> _headings(labview, 3)
    [('X_Value', 's', 'X_Value'), ('Force', 'N', 'Force'), ('Slip', 'mm', 'Slip')]
    >>> _headings([Row(0, ["X_Dimension", "Frequency", "Frequency"]), *labview], 3)[0]
    ('X_Value', '', 'X_Value')

    A line with another number of names, or another unit below a name, is
    refused:

    >>> _headings([Row(4, ["x", "F", "N"])], 2)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: line 4 names 3 columns, but the lines below have 2. ...
    >>> _headings([Row(1, ["x (mm)", "F"]), Row(2, ["m", "N"])], 2)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: 'x (mm)' has 'm' below it, which is another unit
    """
    header = [row for row in header if not {*row.cells} <= {"", "-"}]
    if not header:
        return [(str(number), "", "") for number in range(width)]
    number, names, _ = header[-1]
    if len(names) != width:
        raise InputError(
            f"line {number} names {len(names)} columns, but the lines below have {width}. Begin"
            " comment lines with '#', or pass skip= with the number of lines above the headings"
        )
    # A row below the names may hold the units. LabVIEW writes them
    # above.
    units = [""] * width
    above = {row.cells[0]: row.cells[1:] for row in header[:-1] if row.cells}
    if len(header) > 1 and len(header[-2].cells) == width and _are_units(names):
        units = [cell.strip("()[]{} ") for cell in names]
        names = header[-2].cells
    elif "Y_Unit_Label" in above and width > 1:
        time = "s" if "Time" in above.get("X_Dimension", ["Time"]) else ""
        units = [time, *above["Y_Unit_Label"], *units][:width]
    headings = []
    for column, (heading, below) in enumerate(zip(names, units, strict=True)):
        name, unit = name_and_unit(heading)
        if unit and below not in ("", unit):
            raise InputError(f"{heading!r} has {below!r} below it, which is another unit")
        name = name if heading else str(column)  # such as the index that pandas writes
        headings.append((name, unit or below, heading))
    return headings


def _are_units(cells: Iterable[str]) -> bool:
    """Return whether a row states units: most of its cells are units, and the others are short.

    >>> rows = ["mm", "kPa"], ["(mm)", "", "N"], ["mm", "N", "cycles"], ["1", "-", "kN"]
    >>> [_are_units(cells) for cells in rows]
    [True, True, True, True]
    >>> rows = ["1", "-", "F"], ["mm", "F"], ["mm", "N", "specimens"], [], ["N", "Test", "A"]
    >>> [_are_units(cells) for cells in rows]
    [False, False, False, False, False]
    """
    bare = [cell.strip("()[]{} ") for cell in cells if cell.strip("()[]{} ")]
    known = [cell for cell in bare if parse(cell)]
    clear = any(cell not in ("1", "-", "%") for cell in known)
    return clear and 2 * len(known) > len(bare) and all(len(cell) < 9 for cell in bare)


def name_and_unit(text: str) -> tuple[str, str]:
    """Split a heading, such as 'strength (MPa)', 'tau/MPa', 'x_mm', 'x in mm' or 'tau MPa'.

    >>> headings = "peak (MPa)", "tau/MPa", "x_mm", "x in mm", "F, kN", "a [b] / N (1)"
    >>> [name_and_unit(heading) for heading in headings]
    [('peak', 'MPa'), ('tau', 'MPa'), ('x', 'mm'), ('x', 'mm'), ('F', 'kN'), ('a [b] / N', '1')]
    >>> [name_and_unit(heading) for heading in (" F / kN ", "v / m / s", "[MPa]", "a (1) b")]
    [('F', 'kN'), ('v', 'm / s'), ('', 'MPa'), ('a (1) b', '')]
    >>> [name_and_unit(heading) for heading in ("tau (peak) (kPa)", "x_(mm)", "N load N")]
    [('tau (peak)', 'kPa'), ('x', 'mm'), ('N load', 'N')]

    The letter N is a unit behind a force, and otherwise a part of the name:

    >>> headings = "Force N", "F N", "F in N", "x N", "time s", "test s"
    >>> [name_and_unit(heading) for heading in headings]
    [('Force', 'N'), ('F N', ''), ('F', 'N'), ('x N', ''), ('time', 's'), ('test s', '')]
    >>> headings = "elapsed min", "sample min", "gauge length m", "travel m", "x/m", "/m", "a/b"
    >>> [name_and_unit(heading)[1] for heading in headings]
    ['min', '', 'm', 'm', 'm', '', '']
    """
    text = text.strip()
    if text[-1:] in tuple(")]}") and (start := max(map(text.rfind, "([{"))) >= 0:
        return text[:start].strip(" _"), text[start + 1 : -1].strip()
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    *before, last = re.split(r"[\s,_:]+(?:in\s+)?", text)
    name = text[: text.rindex(last)].rstrip(" ,_:") if before else ""
    # A short unit may be a part of the name, such as N for normal.
    role = role_of(Column(name.removesuffix(" in"), "", None, 0))
    clear = name.endswith(" in") or (len(name) > 2 and role in _SHORT.get(last, ()))
    if parse(last) is not None and (clear or (len(last) > 1 and last not in _SHORT)):
        return name.removesuffix(" in"), last
    before_slash, slash, unit = text.partition("/")
    if slash and before_slash and parse(unit) is not None:
        return before_slash, unit
    return text, ""


_SHORT = {
    "N": ("force", "friction"), "m": ("travel", "length"), "s": ("time",), "h": ("time",),
    "min": ("time",), "mil": ("travel", "length"), "g": (), "J": (), "1": (), "-": (), "%": (),
}  # fmt: skip
"""Units that may be a part of a name, and the roles of names behind
which they are units."""
