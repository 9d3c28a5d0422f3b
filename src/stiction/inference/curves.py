"""Measured curves of force against travel or time, with peak, precursors and plateau.

Problem. Readings F_i contain white noise with standard
deviation s. Find the peak, the drops before the peak and
the plateau after the peak. The drops are called precursors:
a part of the interface slips and comes to rest.

Source. David and Nagaraja, Order Statistics (2003),
section 10.5, give the range of white noise. The
choice of thresholds and turning points is our own.

Steps:

1. Noise. Second differences F_(i-1) - 2 F_i + F_(i+1) vanish on a
   straight line, and noise gives them the variance 6 s^2. Their median
   yields s, because drops are too rare to change a median. If a load
   cell reads in steps of q, s is at least q/sqrt(12).
2. Threshold. n readings of a constant force have a range of about 2 s
   sqrt(2 ln n). Only a larger fall counts as a drop.
3. Turning points. Keep the highest reading since the last drop. A drop
   begins at this reading when the force lies more than the threshold
   below it. Then keep the lowest reading. The drop ends at this reading
   when the force lies more than the threshold above it.
4. Peak. Noise makes the largest reading too large by 2 to 4 s. Fit a
   parabola to the readings around it that lie within the threshold of
   it. The peak is the largest value of the parabola, and its error that
   of the fit. Fewer readings than `MIN_FITTED` are not fitted.
5. Count the drops that begin before the peak as precursors.
6. Plateau. Readings after the last reading within the threshold of the
   peak, from three quarters of the fall to their median on. A final fall
   below half of this median is unloading, and does not count.

Readings that are no friction are named in a warning: a single reading
far above both neighbours (left out), equal largest readings (a
saturated load cell), and a force at the start (no tare). A record with
several full slides, or with forces of both signs, is not one test:
`split` cuts it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import Number, Positive, checked, describe
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import in_words, is_in
from stiction.problem.reading.columns import (
    Column,
    Reading,
    Table,
    Wanted,
    named,
    read_column,
    reading_of,
    role_of,
    stated_column,
    unclear,
)
from stiction.problem.reading.files import EXCEL, TEXT, read_table
from stiction.problem.reading.labels import (
    Missing,
    column_in_si,
    several_tables,
    with_stated_unit,
    without_missing,
)
from stiction.problem.reading.tables import Options, table_of_frame

TESTS = "test|specimen|run|probe|versuch"
"""Beginnings of the heading of a column that numbers tests."""
FORCE_UNITS, TRAVEL_UNITS = ("N", "Pa", "1"), ("m", "s")
"""SI units of the measured quantity, and of travel or time."""
MIN_READINGS = 8
"""Fewest readings of a test."""
MAX_BACKWARD_SHARE = 0.05
"""Largest fraction of its range by which travel may go back.

A new cycle goes back further.
"""
ROUND_OFF = 1e-12
"""Fraction of the largest force below which differences of readings are
round-off."""
MIN_DROP_SHARE = 1e-6
"""Fraction of the peak below which a fall is round-off if there is no noise."""
MAX_SPIKES_SHARE = 0.01
"""Fraction of readings above which spikes do not count as errors of
single readings."""
MIN_FITTED = 12
"""Fewest readings at the peak to which a parabola is fitted."""
TARE = 0.05
"""Largest ratio of the first readings to the peak without a doubt about
the tare."""
HIGH, LOW, MAX_RETURNS = 0.8, 0.7, 3
"""A test falls below LOW of its peak and returns above HIGH of it fewer
times than this. A record of stick-slip does so in each cycle."""
BOTH_SIGNS = 0.2
"""Least size of forces of the other sign in a reciprocating test, over
the largest force."""
Split = Literal["cycles", "strokes", "tables"]


@dataclass(frozen=True, eq=False, repr=False)
class Drops(Result):
    """Drops of the force: travel and force at the beginning, and size of each drop.

    Examples
    --------
    >>> len(Drops(np.zeros(2), np.ones(2), np.ones(2)))
    2
    """

    travel: Array
    force: Array
    size: Array

    def __len__(self) -> int:
        return self.size.size


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Result):
    """The curve of one test, with peak, precursors and plateau.

    Attributes
    ----------
    name : str
        File, and number of the test if the file holds several.
    travel, force : (readings,) arrays
        Readings in SI. `travel` is the time if the test has no travel.
    unit, travel_unit : str
        Unit of the force, "N", "Pa" or "1", and of the travel, "m" or "s".
    noise : float
        Standard deviation of a reading.
    threshold : float
        Smallest fall of the force that counts as a drop.
    peak, peak_travel : float
        Largest force, without the bias by noise, and its travel.
    peak_error : float
        Standard error of the peak by noise.
    drops : Drops
        Precursors: drops before the peak. The error of each size is
        about twice the noise.
    plateau : float
        Mean force while the whole interface slides, after the peak. NaN
        if the record ends there.
    """

    name: str
    travel: Array
    force: Array
    unit: str
    travel_unit: str
    noise: float
    threshold: float
    peak: float
    peak_travel: float
    drops: Drops
    plateau: float
    peak_error: float = 0.0

    def _row(self, name: str) -> Row:
        """Return a row with the peak and, as its remark, all other
        results.

        >>> at, none = np.zeros(0), Drops(*np.zeros((3, 0)))
        >>> two = Drops(*np.array([[1, 2], [7, 8], [0.5, 3]]))
        >>> curve = Curve("a", at, at, "N", "s", 0.03, 0.2, 9.0, 4.0, two, 6.0, peak_error=0.1)
        >>> curve._row("peak").remark
        '+- 0.1 N, at 4 s, 2 precursors from 7 N on, of up to 3 N, plateau 6 N, noise 0.03 N'
        >>> replace(curve, drops=none, plateau=math.nan)._row("peak").remark
        '+- 0.1 N, at 4 s, 0 precursors, noise 0.03 N'
        >>> first = Drops(two.travel[:1], two.force[:1], two.size[:1])
        >>> row = replace(curve, drops=first)._row("top")
        >>> (row.name, row.value, row.interval, row.unit), "1 precursor from" in row.remark
        (('top', 9.0, (), 'N'), True)
        """
        count, force = len(self.drops), partial(in_words, self.unit)
        place = in_words(self.travel_unit, self.peak_travel)
        texts = [f"+- {force(self.peak_error)}", f"at {place}"]
        texts.append(f"{count} precursor" + "s" * (count != 1))
        if count:
            first, most = self.drops.force[0], self.drops.size.max()
            texts[-1] += f" from {force(first)} on, of up to {force(most)}"
        texts += [f"plateau {force(self.plateau)}"] * math.isfinite(self.plateau)
        texts.append(f"noise {force(self.noise)}")
        return Row(name, self.peak, (), self.unit, ", ".join(texts))

    def _summary(self) -> Summary:
        """Return the summary, whose title is the name of the test.

        >>> at, drops = np.zeros(0), Drops(*np.zeros((3, 0)))
        >>> print(Curve("a", at, at, "N", "m", 0.0, 0.0, 0.4, 2e-3, drops, 0.3))
        a
                value  unit
          peak  0.4    N     +- 0 N, at 2 mm, 0 precursors, plateau 0.3 N, noise 0 N
        """
        return Summary(self.name, [self._row("peak")])


@dataclass(frozen=True, eq=False, repr=False)
class Curves(Sequence[Curve], Result):
    """Curves from repeated tests, for `infer`, `agreement` and figures.

    Attributes
    ----------
    tests : tuple of Curve
    read : tuple of Reading
        What was read from each file.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> tests = SimpleNamespace(peak=3.0, unit="N"), SimpleNamespace(peak=2.0, unit="Pa")
    >>> curves = Curves(tests)
    >>> len(curves), curves[1].peak, curves.unit, curves.peaks.tolist()
    (2, 2.0, 'N', [3.0, 2.0])
    """

    tests: tuple[Curve, ...]
    read: tuple[Reading, ...] = ()

    @property
    def unit(self) -> str:
        """Force unit in all tests."""
        return self.tests[0].unit

    @property
    def peaks(self) -> Array:
        """Peak of each test, in `unit`."""
        return np.array([curve.peak for curve in self.tests])

    def __len__(self) -> int:
        return len(self.tests)

    def __getitem__(self, number: Any) -> Any:
        return self.tests[number]

    def _summary(self) -> Summary:
        # Files with the same columns are shown once.
        """Return the summary of all tests.

        Readings that differ only in their source or number of
        values are shown once.

        >>> at, drops = np.zeros(0), Drops(*np.zeros((3, 0)))
        >>> curve = Curve("a", at, at, "N", "m", 0.0, 0.0, 4.0, 0.0, drops, 3.0)
        >>> files = ("a", "N", 9), ("b", "kN", 9), ("c", "N", 8)
        >>> read = tuple(Reading(file, "F", unit, count) for file, unit, count in files)
        >>> summary = Curves((curve, replace(curve, name="c")), read)._summary()
        >>> summary.title, [row.name for row in summary.rows]
        ('Peaks of 2 tests', ['a', 'c'])
        >>> summary.notes
        ['a: F in N, 9 values (and 1 similar files)', 'b: F in kN, 9 values']
        """
        alike: dict[Any, list[Reading]] = {}
        for reading in self.read:
            alike.setdefault(reading._replace(source="", values=0), []).append(reading)
        notes = [
            f"{files[0]}" + f" (and {len(files) - 1} similar files)" * (len(files) > 1)
            for files in alike.values()
        ]
        rows = [curve._row(curve.name) for curve in self]
        return Summary(f"Peaks of {len(self)} tests", rows, notes=notes)


@checked
def read_curve(
    source: Any,
    *,
    force: Wanted = None,
    travel: Wanted = None,
    unit: str | None = None,
    travel_unit: str | None = None,
    speed: Positive | None = None,
    noise: Positive | None = None,
    split: Split | None = None,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
) -> Curves:
    """Read force against travel or time. Find the peak, precursors and plateau of each test.

    A column is read if its heading, or the caller, says that it is the wanted
    quantity. If several columns could be the quantity, an error lists them.

    Parameters
    ----------
    source : path, DataFrame or (travel, force)
        A text file or workbook, a folder of such files, a pandas table, or two
        arrays. A table needs a column of friction force, shear stress or friction
        coefficient and a column of travel or time. A file may hold several tests,
        either numbered in a column ``test`` or separated by empty lines.
    force, travel : str or int, optional
        Column, given by its heading, name, or number from 0. By default
        the force is the column whose heading says friction, tangential,
        shear, COF, mu, Reibkraft, ... or the only column besides travel
        and time. The travel is the column called travel, displacement,
        extension, position, Weg, ... or else time.
    unit, travel_unit : str, optional
        Units of force and travel if the source states no units.
    speed : float, optional
        Speed of the crosshead, m/s, which turns time into travel.
    noise : float, optional
        Standard deviation of a load-cell reading, in SI. By default it is estimated
        from neighbouring readings, which needs a load cell without a filter.
    split : {"cycles", "strokes", "tables"}, optional
        How a record with several tests is cut: where each full slide in a
        stick-slip record ends, where the force changes its sign in a
        reciprocating test, or at remarks between tables.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`.

    Returns
    -------
    Curves
        A sequence with a `Curve` for each test. Printing shows what was read.

    Raises
    ------
    InputError
        If a file cannot be read, a unit is missing or unknown, columns
        are ambiguous, travel or time goes back, or a record holds more
        than one test and `split` is not given.

    Warns
    -----
    AccuracyWarning
        If readings are missing or far above both neighbours, all forces
        are negative, the load cell was saturated or not tared, or a
        record ends at its peak.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> travel = np.linspace(0.0, 1e-3, 500)
    >>> force = np.minimum(2e5 * travel, 100.0) - 20.0 * (travel > 3e-4) - 10.0 * (travel > 8e-4)
    >>> curves = st.read_curve((travel, force), unit="N", travel_unit="m")
    >>> curves[0].peak, len(curves[0].drops), curves[0].plateau
    (80.0, 1, 70.0)

    The speed of the machine turns time into travel.

    >>> curves = st.read_curve((travel, force), unit="N", travel_unit="s", speed=0.5)
    >>> float(curves[0].travel[-1]), curves[0].travel_unit
    (0.0005, 'm')
    """
    tests: list[Curve] = []
    read: list[Reading] = []
    options = Options(skip, sheet, missing, decimal)
    for name, table in _tables(source, options):
        with prefixed(name):
            if table.begins and split != "tables":
                raise InputError(f"{several_tables(table)}. split='tables' reads all of them")
            columns = [c for c in table.columns if c.heading or not table.headed]
            column = read_column(columns, "force", "force", force, FORCE_UNITS)
            along = _travel_of([c for c in columns if c is not column], travel)
            at, at_si = column_in_si(along, "travel", travel_unit, TRAVEL_UNITS, "travel_unit")
            known = replace(column, values=without_missing(column.values, options))
            values, si = column_in_si(known, "force", unit, FORCE_UNITS, "unit")
            if at_si == "s" and speed is not None:
                at, at_si = at * speed, "m"
            used = "travel" if at_si == "m" else "time"
            read.append(reading_of(table, column, unit or si, {used: along}))
        readings = Readings(Path(name).stem, si, at_si, at, values, table.lines)
        for label, rows in _tests_of(table, readings):
            with prefixed(name + label):
                parts = _parts(readings.part(rows, label), noise, split)
                tests += [_curve(part, noise, split) for part in parts]
    if len({(curve.unit, curve.travel_unit) for curve in tests}) > 1:
        raise InputError("source: tests differ in their units. Read them in separate calls")
    ends = [curve.name for curve in tests if math.isnan(curve.plateau)]
    if ends and split != "cycles":
        warn_accuracy(
            f"the record ends at its peak in {', '.join(ends[:3])} ({len(ends)} of {len(tests)}"
            " tests). The interface may not have slid as a whole, and its peak may be higher"
        )
    return Curves(tuple(tests), tuple(read))


class Readings(NamedTuple):
    """Readings of a test in SI, with units and line numbers."""

    name: str
    unit: str
    travel_unit: str
    travel: Array
    force: Array
    lines: Array

    def part(self, rows: Any, label: str = "") -> Readings:
        """Return a part of the readings, and add a label to the name.

        >>> part = Readings("a", "N", "m", *np.arange(9.0).reshape(3, 3)).part([2, 0], " x")
        >>> part[:3], [array.tolist() for array in part[3:]]
        (('a x', 'N', 'm'), [[2.0, 0.0], [5.0, 3.0], [8.0, 6.0]])
        """
        return Readings(self.name + label, *self[1:3], *(array[rows] for array in self[3:]))

    def cut(self, begins: Any, word: str) -> list[Readings]:
        """Return the parts that begin at given readings.

        >>> parts = Readings("a", "N", "m", *np.arange(15.0).reshape(3, 5)).cut([1, 3], "part")
        >>> [(part.name, part.travel.tolist()) for part in parts]
        [('a, part 1', [0.0]), ('a, part 2', [1.0, 2.0]), ('a, part 3', [3.0, 4.0])]
        """
        pieces = np.split(np.arange(self.force.size), begins)
        return [self.part(rows, f", {word} {i}") for i, rows in enumerate(pieces, 1)]


def _tables(source: Any, options: Options) -> Iterator[tuple[str, Table]]:
    """Yield the name and table of each file in a folder, or of a single source.

    Two arrays, or a table of pandas, have the name 'test'.

    >>> ((name, table),) = _tables(([0, 1, 2], [5, 7, 8]), Options())
    >>> name, table.source, table.lines.tolist()
    ('test', 'arrays', [0, 1, 2])
    >>> [(c.name, c.unit, c.values.tolist(), c.number, c.heading) for c in table.columns]
    [('travel', '', [0.0, 1.0, 2.0], 0, 'travel'), ('force', '', [5.0, 7.0, 8.0], 1, 'force')]
    >>> list(_tables(([0, 1], [5, 7, 8]), Options()))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: source: travel and force must have ... [2, 3]
    >>> list(_tables([1, 2, 3], Options()))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: source: must be a path, a DataFrame or ...
    >>> import pandas as pd
    >>> ((name, table),) = _tables(pd.DataFrame({"F (kN)": [3.0, 4.0]}), Options())
    >>> name, table.columns[0].unit
    ('test', 'kN')
    >>> ((_, table),) = _tables((pd.Series([1.0], name="s [mm]"), [3.0]), Options())
    >>> [(column.name, column.unit) for column in table.columns]
    [('travel', 'mm'), ('force', '')]

    A folder gives its text files and workbooks in order, without
    hidden files and copies that an editor keeps.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> for name in ("b.csv", "a.TXT", ".c.csv", "~d.csv", "e.pdf"):
    ...     _ = (folder / name).write_text("s [mm]; F [N]\\n0; 1\\n1; 2\\n2; 4\\n")
    >>> for source in (folder, folder / "e.pdf"):
    ...     [(Path(name).name, table.lines.size) for name, table in _tables(source, Options())]
    [('a.TXT', 3), ('b.csv', 3)]
    [('e.pdf', 3)]
    """
    if isinstance(source, str | Path):
        path, endings = Path(source), (*TEXT, EXCEL)
        files = [path]
        if path.is_dir():
            visible = [file for file in sorted(path.iterdir()) if file.name[0] not in ".~"]
            files = [file for file in visible if file.suffix.lower() in endings]
            if not files:
                raise InputError(f"{path}: has no file that ends in {', '.join(endings)}")
        for file in files:
            with prefixed(str(file)):
                table = read_table(file, options)
            yield str(file), table
    elif hasattr(source, "columns") and hasattr(source, "to_xarray"):
        yield "test", table_of_frame(source)
    elif isinstance(source, tuple | list) and len(source) == 2:
        columns = []
        wanted = ("travel", TRAVEL_UNITS), ("force", FORCE_UNITS)
        for number, (given, (name, units)) in enumerate(zip(source, wanted, strict=True)):
            values, unit = with_stated_unit(given, units)
            columns.append(Column(name, unit or "", np.asarray(values, float), number, name))
        sizes = [column.values.size for column in columns]
        if sizes[0] != sizes[1]:
            raise InputError(f"source: travel and force must have equal lengths, got {sizes}")
        yield "test", Table(tuple(columns), "arrays", np.arange(sizes[0]))
    else:
        raise InputError(
            f"source: must be a path, a DataFrame or (travel, force), got {describe(source)}"
        )


def _travel_of(columns: Sequence[Column], wanted: Wanted) -> Column:
    """Return the column of travel, or else time, which a stop of the machine would stretch.

    >>> def chosen(*columns, wanted=None):
    ...     made = [Column(*c, np.zeros(1), i, c[0]) for i, c in enumerate(columns)]
    ...     return _travel_of(made, wanted).number
    >>> chosen(("time", "s"), ("travel", "mm")), chosen(("travel", "%"), ("time", "s"))
    (1, 1)

    The headings 'x' and 'x_value' count only if no other heading is
    a travel.

    >>> chosen(("x", "mm"), ("travel", "mm")), chosen(("x", "mm"), ("time", "s"))
    (1, 0)
    >>> chosen(("x_value", ""), ("travel", "mm")), chosen(("a", "mm"), ("x_value", "s"))
    (1, 1)
    >>> chosen(("a", "mm"), ("x_value", "")), chosen(("b", "s"), ("a", "mm"))
    (1, 1)
    >>> chosen(("a", "N"), ("b", "s"))
    1
    >>> chosen(("travel", "mm"), ("time", "s"), wanted="time"), chosen(("a", "N"), ("a", "mm"))
    (1, 1)
    >>> chosen(("travel", "mm"), ("time", "s"), wanted="travel")
    0
    >>> chosen(("travel", "mm"), ("position", "mm"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: 2 columns could be the travel or time. ...
    >>> chosen(("a", "N"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: no column is clearly the travel or time. ...
    >>> text = Column("travel", "mm", np.zeros(1), 0, text="no numbers")
    >>> _travel_of([text, Column("time", "s", np.zeros(1), 1)], None).name
    'time'
    """
    if wanted is not None:
        return stated_column(columns, "travel", wanted)
    numeric = [column for column in columns if not column.text]
    travels = [c for c in numeric if role_of(c) == "travel" and c.may_be_in("m")]
    choices = (
        [c for c in travels if c.name.casefold() not in ("x", "x_value")], travels,
        [c for c in numeric if role_of(c) == "time" or c.name.casefold() == "x_value"],
        [c for c in numeric if is_in(c.unit, "m")], [c for c in numeric if is_in(c.unit, "s")],
    )  # fmt: skip
    chosen = next(filter(None, choices), [])
    if len(chosen) != 1:
        raise InputError(unclear(columns, "travel or time", "travel", chosen))
    return chosen[0]


def _tests_of(table: Table, readings: Readings) -> Iterator[tuple[str, Any]]:
    """Yield the label of each test in a table, and a mask of its rows.

    A lone test has no label.

    >>> def tests(travel, lines, begins=(), **columns):
    ...     travel, lines = np.array(travel, float), np.array(lines)
    ...     made = tuple(Column(k, "", np.array(v, float), 0) for k, v in columns.items())
    ...     readings = Readings("a", "N", "m", travel, travel, lines)
    ...     pairs = _tests_of(Table(made, "a", lines, begins=begins), readings)
    ...     return [(label, rows.nonzero()[0].tolist()) for label, rows in pairs]

    A column may number the tests. If one of its numbers is missing,
    it does not count.

    >>> tests([0, 1, 2, 3], [1, 2, 3, 4], test=[7, 7, 2, 7])
    [(', test 7', [0, 1, 3]), (', test 2', [2])]
    >>> tests([0, 1, 2, 3], [1, 2, 3, 4], test=[7, 7, np.nan, 2])
    [('', [0, 1, 2, 3])]
    >>> tests([0, 1, 2], [1, 2, 3], test=[7, 7, 2], run=[3, 4, 4])
    [('', [0, 1, 2])]
    >>> tests([0, 1, 2], [1, 2, 3], **{"test time": [3, 4, 4]})
    [('', [0, 1, 2])]

    An empty line separates tests if the travel goes back, and a
    remark always does. The first of the `begins` is the first
    table.

    >>> tests([0, 1, 1, 0, 1, 0, 1], [1, 2, 4, 6, 7, 8, 9])
    [(', test 1', [0, 1, 2]), (', test 2', [3, 4, 5, 6])]
    >>> tests([-1, 1, 2, 3], [5, 6, 9, 10], begins=(6, 9))
    [(', test 1', [0, 1]), (', test 2', [2, 3])]
    """
    numbers = [c for c in named(table.columns, TESTS) if role_of(c) == "specimen"]
    if len(numbers) == 1 and np.isfinite(numbers[0].values).all():
        for label in dict.fromkeys(numbers[0].values.tolist()):
            yield f", test {label:g}", numbers[0].values == label
        return
    # A new test begins after an empty line only if the travel goes back there, or at a remark.
    begins = np.diff(table.lines, prepend=table.lines[:1]) > 1
    begins &= np.diff(readings.travel, prepend=0.0) < 0
    begins |= np.isin(table.lines, table.begins[1:])
    block = np.cumsum(begins)
    for label in range(int(block[-1]) + 1):
        yield f", test {label + 1}" * bool(block[-1]), block == label


def _parts(readings: Readings, noise: float | None, split: Split | None) -> list[Readings]:
    """Return the parts of a record that are one test each.

    >>> def parts(force, travel=None, unit="m", split=None):
    ...     at = np.arange(len(force)) * 1.0 if travel is None else np.array(travel, float)
    ...     readings = Readings("a", "N", unit, at, np.array(force, float), at)
    ...     return [(p.name, p.force.tolist()) for p in _parts(readings, 0.0, split)]
    >>> parts([0, 1, np.nan, 2, 3, 4, 5, 6, 5, 5], [0, 1, 2, 3, 4, 5, np.inf, 6, 7, 8])
    [('a', [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 5.0, 5.0])]
    >>> parts([0, 1, 2, 30, 3, 4, 5, 6, 7])  # a spike
    [('a', [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])]

    Forces of the other sign count if they exceed a fifth of the
    largest force, here 1 N.

    >>> for part in parts([-1, 3, 4, -0.1, 0.2, -0.3, -5, -4, -0.1, 2, 3], split="strokes"):
    ...     print(part)
    ('a, stroke 1', [1.0, 3.0, 4.0, 0.1, 0.2])
    ('a, stroke 2', [0.3, 5.0, 4.0, 0.1])
    ('a, stroke 3', [2.0, 3.0])
    >>> parts([1, 3, 4, 0, -0.3, -5, -4, -0.1])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: forces have both signs, as in a ...
    >>> parts([0.5, 0, -1, -2, -3, -4, -4, -3])
    [('a', [-0.5, -0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 3.0])]
    >>> parts([-0.5, 0, 1, 2, 3, 4, 4, 3])
    [('a', [-0.5, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 3.0])]
    >>> parts([0] * 8)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: all forces are zero

    The sign of the travel changes if it ends at least nine tenths
    of its range below its start.

    >>> force = np.arange(10.0)
    >>> for last, unit in ((1, "m"), (1, "s"), (2, "m")):
    ...     at = np.array([10, 9, 8, 7, 6, 5, 4, 3, 0, last], dtype=float)
    ...     print(_parts(Readings("a", "N", unit, at, force, at), 0.0, None)[0].travel[-1])
    -1.0
    1.0
    2.0
    >>> float(_parts(Readings("a", "N", "m", 0.0 * at, force, at), 0.0, None)[0].travel[0])
    0.0

    Full slides are 6, 3 and 8 N here. A slide of 2.5 N is less than
    half of the median of the largest three, and the force after the
    last full slide is left out.

    >>> for part in parts([0, 4, 8, 2, 6, 3, 5, 2.5, 9, 1, 3], split="cycles"):
    ...     print(part)
    ('a, cycle 1', [0.0, 4.0, 8.0, 2.0])
    ('a, cycle 2', [6.0, 3.0])
    ('a, cycle 3', [5.0, 2.5, 9.0, 1.0])
    >>> parts(range(8), split="cycles")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: split: the record has no full slide. Leave out split

    A return ends at 0.8 of the peak or above, after a force below
    0.7 of the peak.

    >>> len(parts([0, 10, 7, 10, 6, 8, 6.9, 9, 6]))
    1
    >>> parts([0, 10, 7, 10, 6, 8, 6.9, 9, 6, 8])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: the force falls ... and returns 3 times, ...
    >>> parts([8, 6, 8, 6, 8, 6, 8, 10])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: the force falls ... and returns 3 times, ...
    """
    known = np.isfinite(readings.travel) & np.isfinite(readings.force)
    if not known.all():  # machines miss single readings
        warn_accuracy(f"{readings.name}: {np.sum(~known)} of {known.size} readings are missing")
        readings = readings.part(known)
    travel, force = readings.travel, readings.force
    threshold = _threshold(force, noise)[1]
    if readings.travel_unit == "m" and travel[0] - travel[-1] >= 0.9 * np.ptp(travel) > 0.0:
        warn_accuracy(f"{readings.name}: the travel only falls, so its sign is changed")
        readings = readings._replace(travel=-travel)
    clear = np.abs(force) > max(threshold, BOTH_SIGNS * float(np.abs(force).max()))
    marked, signs = np.flatnonzero(clear), np.sign(force)
    turns = marked[1:][np.diff(signs[marked]) != 0.0]
    if turns.size:
        if split != "strokes":
            raise InputError(
                "forces have both signs, as in a reciprocating test. Pass split='strokes'"
            )
        # The sign holds until the force clearly has the other sign.
        begins = [np.flatnonzero(signs[:turn] != signs[turn])[-1] + 1 for turn in turns]
        return readings._replace(force=np.abs(force)).cut(begins, "stroke")
    if -force.min() > force.max():
        warn_accuracy(f"{readings.name}: forces are negative, so their signs are changed")
        readings = readings._replace(force=-force)
    readings = _without_spikes(readings, threshold)
    force = readings.force
    if not force.max() > 0.0:
        raise InputError("all forces are zero")
    if split == "cycles":
        starts, ends = turning_points(force, threshold)
        sizes = force[starts] - force[ends]
        if sizes.size == 0:
            raise InputError("split: the record has no full slide. Leave out split")
        full = ends[sizes >= 0.5 * np.median(np.sort(sizes)[-3:])] + 1
        return readings.part(slice(full[-1])).cut(full[:-1], "cycle")
    # Readings above HIGH, or else below LOW of the peak, and how often the force returns.
    high = force >= HIGH * force.max()
    level = high[high | (force < LOW * force.max())]
    returns = int(np.sum(level[1:] > level[:-1])) - int(not level[0])
    if returns >= MAX_RETURNS:
        raise InputError(
            f"the force falls from its peak and returns {returns} times, as in a record of"
            " stick-slip. Pass split='cycles' to read each cycle as a test"
        )
    return [readings]


def _threshold(force: Array, noise: float | None) -> tuple[float, float]:
    """Return the noise of a reading and the smallest fall that counts (steps 1 and 2).

    >>> force = np.array([0, 1, 2, 3, -9, 4, 5, 6.0])
    >>> _threshold(force, 0.3)[1] == 2.0 * 0.3 * math.sqrt(2.0 * math.log(8))
    True
    >>> [f"{value:.3g}" for value in _threshold(force, 0.0)]  # 1e-6 of the largest size
    ['0', '9e-06']
    >>> _threshold(force[:7], 0.3)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: holds 7 readings, but at least 8 are needed

    The noise is measured up to the peak, unless the peak comes too
    early.

    >>> _threshold(np.r_[np.arange(9.0), 3, 5, 2, 6, 1, 7, 0, 7], None)[0]
    0.0
    >>> late = np.r_[np.arange(8.0), 3, 5, 2, 6, 1, 7]
    >>> _threshold(late, None)[0] == noise_of(late) > 0.0
    True
    """
    if force.size < MIN_READINGS:
        raise InputError(f"holds {force.size} readings, but at least {MIN_READINGS} are needed")
    top = int(np.argmax(np.abs(force)))
    if noise is None:
        noise = noise_of(force[: top + 1] if top >= MIN_READINGS else force)
    white_range = 2.0 * noise * math.sqrt(2.0 * math.log(force.size))
    return noise, max(white_range, MIN_DROP_SHARE * abs(float(force[top])))


def _without_spikes(readings: Readings, threshold: float) -> Readings:
    """Leave out single readings that are far above both neighbours, and warn about them.

    Steps are 1 N. A spike rises above both neighbours by more than
    the threshold and 3 N.

    >>> from stiction.base.errors import collect_warnings
    >>> at = np.arange(9.0)
    >>> readings = Readings("a", "N", "m", at, np.array([1, 2, 9, 3, 4, 5, 6, 7, 8.0]), at + 5)
    >>> with collect_warnings() as caught:
    ...     _without_spikes(readings, 2.9).force.tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    >>> _without_spikes(readings, 3.0).force.size
    9
    >>> print(*caught)  # doctest: +ELLIPSIS
    a: 1 single readings are far above ..., such as 9 N in line 7.0. They are left out

    Several spikes are noise, a rise below a twentieth of the peak
    is small, and a jump stays.

    >>> def size(*force):
    ...     return _without_spikes(readings._replace(force=np.array(force)), 0.1).force.size
    >>> size(0, 9, 0, 1, 2, 9, 3, 3, 4, 4, 5), size(9, 9, 9.4, 9, 9, 9, 9, 9, 9)
    (11, 9)
    >>> size(1, 1, 9, 9, 9, 1, 1, 1, 1), size(1, 1, 1, 9, 1, 1, 1, 1, 1)
    (9, 8)
    >>> size(8, 8, 8, -1, 8, 8, 8, 8, 8)
    9
    """
    force, steps = readings.force, np.diff(readings.force)
    least = threshold + 3.0 * float(np.median(np.abs(steps)))
    rise = np.minimum(steps[:-1], -steps[1:])  # above both neighbours
    spikes = np.flatnonzero((rise > least) & (rise > TARE * np.abs(force).max())) + 1
    if spikes.size == 0 or spikes.size > max(1, MAX_SPIKES_SHARE * force.size):
        return readings
    reading, line = in_words(readings.unit, float(force[spikes[0]])), readings.lines[spikes[0]]
    warn_accuracy(
        f"{readings.name}: {spikes.size} single readings are far above both neighbours, such as"
        f" {reading} in line {line}. They are left out"
    )
    return readings.part(np.delete(np.arange(force.size), spikes))


def _curve(readings: Readings, noise: float | None, split: Split | None) -> Curve:
    """Return the curve of one test (steps 1 to 6).

    >>> at, force = np.arange(10.0), np.array([0, 3, 6, 5, 8, 9, 5, 4, 4.2, 4.5])
    >>> readings = Readings("a", "N", "m", 2.0 * at, force, at + 10)
    >>> curve = _curve(readings, 0.0, None)
    >>> curve.name, curve.unit, curve.travel_unit
    ('a', 'N', 'm')
    >>> curve.travel is readings.travel, curve.force is force, curve.threshold
    (True, True, 9e-06)
    >>> curve.peak, curve.peak_error, curve.peak_travel, f"{curve.plateau:.4f}", curve.noise
    (9.0, 0.0, 10.0, '4.4250', 0.0)
    >>> curve.drops.travel.tolist(), curve.drops.force.tolist(), curve.drops.size.tolist()
    ([4.0], [6.0], [1.0])
    >>> _curve(readings, 0.0, "cycles").plateau
    nan
    >>> _curve(readings, 0.0, "tables").plateau == curve.plateau
    True

    Travel may go back by a twentieth of its range, here 0.9, and
    time may not go back.

    >>> def back(by, unit="m", split=None):
    ...     at = np.r_[2.0 * np.arange(5), 8.0 - by, np.arange(6.0, 10) * 2.0]
    ...     moved = readings._replace(travel=at, travel_unit=unit)
    ...     return _curve(moved, 0.0, split).peak_travel
    >>> back(0.875), back(0.0, "s"), back(1.0, split="strokes")
    (7.125, 8.0, 7.0)
    >>> back(1.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: line 15.0: travel or time goes back. Read one cycle ...
    >>> back(0.125, "s")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: line 15.0: travel or time goes back. Read one cycle ...

    Three equal largest readings in a row may be a saturated load
    cell, if the force has noise. A force at the start may be a load
    cell that was not tared.

    >>> from stiction.base.errors import collect_warnings
    >>> def warned(*force, noise=0.0, split=None):
    ...     at, force = np.arange(len(force)), np.array(force, float)
    ...     with collect_warnings() as caught:
    ...         _curve(Readings("a", "N", "m", at * 1.0, force, at), noise, split)
    ...     return [str(one).split(". ")[0] for one in caught]
    >>> warned(0, 0.1, 2, 9, 9, 9, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6, noise=1.0)
    ['a: the 3 largest readings are equal, 9, though the record has noise']
    >>> warned(0, 0.1, 2, 9, 9, 9, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6)
    []
    >>> warned(0, 0.1, 9, 9, 5, 9, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6, 5, 4, 5, 6, noise=1.0)
    []
    >>> warned(0, 0.1, 2, 9, 9, 9, 5, 4, 5, 6, 5, 5, 5, 6, noise=1.0)  # in steps
    []
    >>> warned(2, 1.5, 0, 5, 8, 10, 6, 5)
    ['a: the force begins at 1.5, 15 % of the peak']
    >>> warned(2, 0.5, 0, 5, 8, 10, 6, 5), warned(2, 1.5, 0, 5, 8, 10, 6, 5, split="cycles")
    ([], [])
    """
    name, unit, travel_unit, travel, force, lines = readings
    # 1. and 2.
    noise, threshold = _threshold(force, noise)
    # Time never goes back. A position may tremble, but a new cycle is another test.
    allowed = 0.0 if travel_unit == "s" else MAX_BACKWARD_SHARE * float(np.ptp(travel))
    back = np.flatnonzero(np.maximum.accumulate(travel) - travel > allowed)
    if back.size and split != "strokes":
        raise InputError(
            f"line {lines[back[0]]}: travel or time goes back. Read one cycle at a time, and"
            " separate tests by an empty line or number them in a column 'test'"
        )
    top = int(np.argmax(force))
    # 3.
    starts, ends = precursors(force, threshold)
    # 4.
    begin = int(ends.max(initial=0))
    peak, error = _peak(force[begin:], top - begin, noise, threshold)
    equal, same = np.flatnonzero(force == force[top]), np.mean(np.diff(force) == 0.0)
    if noise > 0.0 and same < 0.1 and np.any(equal[2:] - equal[:-2] == 2):
        warn_accuracy(
            f"{name}: the {equal.size} largest readings are equal, {force[top]:.6g}, though the"
            " record has noise. The load cell may have been saturated, so the peak may be higher"
        )
    first = float(np.median(force[:3]))
    if first > TARE * peak and split is None:
        warn_accuracy(
            f"{name}: the force begins at {first:.4g}, {100.0 * first / peak:.0f} % of the peak."
            " If the load cell was not tared, subtract this force"
        )
    # 5. and 6.
    return Curve(
        name, travel, force, unit, travel_unit, noise, threshold,
        peak=peak, peak_error=error, peak_travel=float(travel[top]),
        drops=Drops(travel[starts], force[starts], force[starts] - force[ends]),
        plateau=math.nan if split == "cycles" else _plateau(force, threshold),
    )  # fmt: skip


def _peak(force: Array, top: int, noise: float, threshold: float) -> tuple[float, float]:
    """Return the peak, corrected for the bias due to noise, and its standard error (step 4).

    A parabola of 13 readings has its peak, 9, in the middle. This
    reading is 0.5 too large. The fit gives it the weight 25/143.

    >>> force = np.r_[-1, 5, -1, 9.0 - 0.25 * np.arange(-6, 7) ** 2, -1, 5]
    >>> force[9] += 0.5
    >>> peak, error = _peak(force, 9, 0.3, 9.5)
    >>> f"{peak - 8.0 - 0.5 * 25 / 143:.6f} {error + 1.0 - 0.3 * math.sqrt(25 / 143):.6f}"
    '1.000000 1.000000'
    >>> _peak(force[3:16], 6, 0.3, 9.5) == (peak, error)
    True
    >>> _peak(force[3:15], 6, 0.3, 9.5)[0] < 9.2
    True
    >>> _peak(force[3:14], 6, 0.3, 9.5), _peak(force, 9, 0.0, 9.5)
    ((9.5, 0.3), (9.5, 0.0))
    """
    near = force >= force[top] - threshold
    first = top - int(np.argmin(np.r_[near[: top + 1][::-1], False])) + 1
    last = top + int(np.argmin(np.r_[near[top:], False]))
    if noise == 0.0 or last - first < MIN_FITTED:
        return float(force[top]), noise
    u = np.linspace(-1.0, 1.0, last - first)
    powers = np.vander(u, 3)
    factors, *_ = np.linalg.lstsq(powers, force[first:last])
    fitted = powers @ factors
    place = powers[fitted.argmax()]
    error = noise * math.sqrt(place @ np.linalg.inv(powers.T @ powers) @ place)
    return float(fitted.max()), error


def _plateau(force: Array, threshold: float) -> float:
    """Return the mean force of the slide after the peak, NaN without a fall (step 6).

    The last reading within 1 N of the peak is 9 N. The median after
    it is 4.2 N. Three quarters of the fall end at 5.65 N. The last
    reading is unloading, because it is below 2.1 N.

    >>> force = np.array([0, 10, 8, 9, 8, 6, 4, 5.2, 3.6, 4.2, 1.0])
    >>> f"{_plateau(force, 1.0):.4f}"  # the mean of 4, 5.2, 3.6 and 4.2
    '4.2500'
    >>> f"{_plateau(np.r_[force[:-1], 2.1], 1.0):.4f}"
    '3.8200'
    >>> _plateau(force[:4], 1.0), f"{_plateau(np.array([5, -2, -2, -3.0]), 1.0):.4f}"
    (nan, '-2.3333')
    """
    peak = float(force.max())
    after = force[int(np.flatnonzero(force >= peak - threshold)[-1]) + 1 :]
    if after.size == 0 or peak - (level := float(np.median(after))) < threshold:
        return math.nan
    if level > 0.0 and after[-1] < 0.5 * level:  # the machine unloads
        after = after[: int(np.flatnonzero(after >= 0.9 * level)[-1]) + 1]
    after = after[int(np.argmax(after <= level + 0.25 * (peak - level))) :]
    return float(after.mean())


def precursors(force: Array, threshold: float) -> tuple[Any, Any]:
    """Return the readings at which drops before the peak begin and end (step 3).

    Examples
    --------
    >>> starts, ends = precursors(np.array([0, 5, 3, 8, 6, 7.0]), 1.0)
    >>> starts.tolist(), ends.tolist()
    ([1], [2])
    """
    starts, ends = turning_points(force, threshold)
    before = starts < int(np.argmax(force))
    return starts[before], ends[before]


def noise_of(force: Array) -> float:
    """Return the standard deviation of a reading (step 1).

    Examples
    --------
    Second differences are 1, 4 and 9, and their median is 4.

    >>> noise_of(np.array([0, 1, 1, 5, 0.0])) == 1.4826 * 4.0 / math.sqrt(6.0)
    True
    >>> noise_of(np.array([0, 2, 4, 6.0])), noise_of(np.array([3, 3, 3.0]))
    (0.0, 0.0)

    A load cell that reads in steps of 0.5:

    >>> force = np.array([-4, -4, -4, -4, -2.5, -2.5, -2.5, -2.5, -2, -2, -2])
    >>> noise_of(force) == 0.5 / math.sqrt(12.0)
    True
    """
    # The median of a normal |x| is its deviation over 1.4826.
    second = np.abs(force[:-2] - 2.0 * force[1:-1] + force[2:])
    steps = np.abs(np.diff(force))
    least = ROUND_OFF * float(np.abs(force).max())
    if (middle := float(np.median(second))) > least:
        return 1.4826 * middle / math.sqrt(6.0)
    if np.median(steps) > least or steps.max() <= least:  # a straight line, or no change at all
        return 0.0
    return float(steps[steps > least].min()) / math.sqrt(12.0)


def turning_points(force: Array, threshold: float) -> tuple[Any, Any]:
    """Return the readings at which drops begin and end (step 3).

    Examples
    --------
    A change by the threshold is not a turning point, and the first
    of equal readings counts.

    >>> starts, ends = turning_points(np.array([0, 5, 4, 6, 3, 4, 2, 2, 7, 7, 5, 1, 2.0]), 1.0)
    >>> starts.tolist(), ends.tolist()
    ([3, 8], [6, 11])
    """
    # `high` and `low` are the extreme readings since the last turning point.
    starts, ends = [], []
    high, low, falling = 0, 0, False
    for place, value in enumerate(force.tolist()):
        if falling:
            if value < force[low]:
                low = place
            elif value > force[low] + threshold:
                ends.append(low)
                falling, high = False, place
        elif value > force[high]:
            high = place
        elif value < force[high] - threshold:
            starts.append(high)
            falling, low = True, place
    if falling:  # the record ends during a drop
        ends.append(low)
    return np.array(starts, dtype=np.int64), np.array(ends, dtype=np.int64)
