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
5. Drops that begin before the peak are precursors.
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
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
)
from stiction.problem.reading.tables import Options, table_of_frame

TESTS = "test|specimen|run|probe|versuch"
"""Beginnings of the heading of a column that numbers tests."""
FORCE_UNITS, TRAVEL_UNITS = ("N", "Pa", "1"), ("m", "s")
"""SI units of the measured quantity, and of travel or time."""
MIN_READINGS = 8
"""Fewest readings of a test."""
MAX_BACKWARD_SHARE = 0.05
"""Largest fraction of its range by which travel may go back. A larger one begins another cycle."""
ROUND_OFF = 1e-12
"""Fraction of the largest force below which differences of readings are round-off."""
MIN_DROP_SHARE = 1e-6
"""Fraction of the peak below which a fall is round-off if there is no noise."""
MAX_SPIKES_SHARE = 0.01
"""Fraction of readings above which spikes are no errors of single readings."""
MIN_FITTED = 12
"""Fewest readings at the peak to which a parabola is fitted."""
TARE = 0.05
"""Fraction of the peak that the first readings may have."""
HIGH, LOW, MAX_RETURNS = 0.8, 0.7, 3
"""A test falls below LOW of its peak and returns above HIGH of it fewer times than this. A record
of stick-slip does so in each cycle."""
BOTH_SIGNS = 0.2
"""Fraction of the largest force that a force of the other sign reaches in a reciprocating test."""
Split = Literal["cycles", "strokes", "tables"]


@dataclass(frozen=True, eq=False, repr=False)
class Drops(Result):
    """Drops of the force: travel and force at the beginning, and size of each drop."""

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

    def __str__(self) -> str:
        count = self.drops.size.size
        place = in_words(self.travel_unit, self.peak_travel)
        text = (
            f"{self.name}: peak {in_words(self.unit, self.peak)} at {place}, {count} precursor"
        )
        text += "s" * (count != 1)
        if count:
            first = in_words(self.unit, self.drops.force[0])
            text += f" from {first} on, of up to {in_words(self.unit, self.drops.size.max())}"
        after = f", plateau {in_words(self.unit, self.plateau)}" * math.isfinite(self.plateau)
        return f"{text}{after}, noise {in_words(self.unit, self.noise)}"

    def _summary(self) -> Summary:
        rows = [
            Row("peak", self.peak, (), self.unit, f"+- {in_words(self.unit, self.peak_error)}"),
            Row("peak at", self.peak_travel, (), self.travel_unit),
            Row("precursors", self.drops.size.size),
            Row("plateau", self.plateau, (), self.unit),
            Row("noise of a reading", self.noise, (), self.unit),
        ]
        return Summary(self.name, rows)


@dataclass(frozen=True, eq=False, repr=False)
class Curves(Result):
    """Curves from repeated tests, for `read_peaks`, `infer` and figures.

    Attributes
    ----------
    tests : tuple of Curve
    read : tuple of Reading
        What was read from each file.
    """

    tests: tuple[Curve, ...]
    read: tuple[Reading, ...] = ()

    @property
    def unit(self) -> str:
        """Unit of the force of all tests."""
        return self.tests[0].unit

    @property
    def peaks(self) -> Array:
        """Peak of each test, in `unit`."""
        return np.array([curve.peak for curve in self.tests])

    def __len__(self) -> int:
        return len(self.tests)

    def __iter__(self) -> Iterator[Curve]:
        return iter(self.tests)

    def __getitem__(self, number: int) -> Curve:
        return self.tests[number]

    def __str__(self) -> str:
        return "\n".join(map(str, (*self.tests, *self._readings())))

    def _readings(self) -> list[str]:
        """Return what was read, once for files with the same columns."""
        alike: dict[Any, list[Reading]] = {}
        for reading in self.read:
            alike.setdefault(reading._replace(source="", values=0), []).append(reading)
        return [
            f"{files[0]}" + f" (and {len(files) - 1} files alike)" * (len(files) > 1)
            for files in alike.values()
        ]

    def _summary(self) -> Summary:
        rows = [Row(curve.name, curve.peak, (), curve.unit) for curve in self]
        return Summary(f"Peaks of {len(self)} tests", rows, notes=self._readings())


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

    A column is read if its heading, or the caller, says that it is the
    wanted quantity; if more than one column could be it, none is read.

    Parameters
    ----------
    source : path, DataFrame or (travel, force)
        A text file or workbook, a folder of such files, a pandas table,
        or two arrays. A table needs a column of friction force, shear
        stress or friction coefficient and a column of travel or time. A
        file may hold several tests, either numbered in a column
        ``test`` or separated by empty lines.
    force, travel : str or int, optional
        Column, given by its heading, name, or number from 0. By default
        the force is the column whose heading says friction, tangential,
        shear, COF, mu, Reibkraft, ... or the only column besides travel
        and time. The travel is the column called travel, displacement,
        extension, position, Weg, ... or else time.
    unit, travel_unit : str, optional
        Units of force and travel if the source states no units.
    speed : float, optional
        Speed of the crosshead, m/s. It turns time into travel.
    noise : float, optional
        Standard deviation of a reading of the load cell, in SI. By
        default it is estimated from neighbouring readings, which needs
        a load cell without a filter.
    split : {"cycles", "strokes", "tables"}, optional
        How a record with several tests is cut: at the end of each full
        slide of stick-slip, at each change of sign of the force in a
        reciprocating test, or at remarks between tables.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`.

    Returns
    -------
    Curves
        A sequence with a `Curve` for each test. Printing shows what was
        read.

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
    >>> print(st.read_curve((travel, force), unit="N", travel_unit="m")[0])
    test: peak 80 N at 501 µm, 1 precursor from 59.7 N on, of up to 19.6 N, plateau 70 N, noise 0 N
    """
    options = Options(skip, sheet, missing, decimal)
    tests: list[Curve] = []
    read: list[Reading] = []
    for name, table in _tables(source, options):
        with prefixed(name):
            if table.begins and split != "tables":
                raise InputError(
                    f"{several_tables(table)}. split='tables' reads each as a test"
                )
            readings, reading = _readings(table, force, travel, unit, travel_unit, speed)
            spans = [*_tests_of(table, readings)]
        read.append(reading)
        for label, rows in spans:
            number = f", test {label}" * bool(label)
            with prefixed(name + number):
                parts = _parts(name + number, readings.part(rows), noise, split)
                for part, sub in parts:
                    tests.append(_curve(Path(name).stem + number + part, sub, noise, split))
    if len({(curve.unit, curve.travel_unit) for curve in tests}) > 1:
        raise InputError(
            "source: units of force or travel differ between tests. Read them in separate calls"
        )
    ends = [curve.name for curve in tests if math.isnan(curve.plateau)]
    if ends and split != "cycles":
        warn_accuracy(
            f"the record ends at its peak in {', '.join(ends[:3])} ({len(ends)} of {len(tests)}"
            " tests). The interface may not have slid as a whole, and its peak may be higher"
        )
    return Curves(tuple(tests), tuple(read))


class Readings(NamedTuple):
    """Readings from a file in SI, with units and line numbers."""

    travel: Array
    force: Array
    unit: str
    travel_unit: str
    lines: Array

    def part(self, rows: Any) -> Readings:
        """Return some of the readings."""
        return self._replace(
            travel=self.travel[rows], force=self.force[rows], lines=self.lines[rows]
        )


def _tables(source: Any, options: Options) -> Iterator[tuple[str, Table]]:
    """Yield the name and table of each file in a folder, or of a single source."""
    if isinstance(source, str | Path):
        path = Path(source)
        files = [path]
        if path.is_dir():
            endings = (*TEXT, EXCEL)
            files = [file for file in sorted(path.iterdir()) if file.suffix.lower() in endings]
            files = [file for file in files if not file.name.startswith((".", "~"))]
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
        for number, (name, units) in enumerate(
            (("travel", TRAVEL_UNITS), ("force", FORCE_UNITS))
        ):
            values, unit = with_stated_unit(source[number], units)
            columns.append(Column(name, unit or "", np.asarray(values, float), number, name))
        sizes = [column.values.size for column in columns]
        if sizes[0] != sizes[1]:
            raise InputError(f"travel and force must be of equal length, got {sizes}")
        yield "test", Table(tuple(columns), "arrays", np.arange(sizes[0]))
    else:
        raise InputError(
            f"source: must be a path, a DataFrame or (travel, force). Got {describe(source)}"
        )


def _readings(
    table: Table, force: Wanted, travel: Wanted, unit: str | None, travel_unit: str | None,
    speed: float | None,
) -> tuple[Readings, Reading]:  # fmt: skip
    """Return force and travel from a table, in SI, and what was read."""
    columns = [column for column in table.columns if column.heading or not table.headed]
    column = read_column(
        columns, "force", "force", force, FORCE_UNITS, lambda c: role_of(c) == "friction"
    )
    left = [other for other in columns if other is not column]
    along = _travel_of(left, travel)
    if texts := [c.text for c in (along, column) if c.text]:
        raise InputError(texts)
    at, at_si = column_in_si(along, "travel", travel_unit, TRAVEL_UNITS, "travel_unit")
    values, si = column_in_si(column, "force", unit, FORCE_UNITS, "unit")
    if at_si == "s" and speed is not None:
        at, at_si = at * speed, "m"
    reading = reading_of(
        table, column, unit or si, {"travel" if at_si == "m" else "time": along}
    )
    return Readings(at, values, si, at_si, table.lines), reading


def _travel_of(columns: Sequence[Column], wanted: Wanted) -> Column:
    """Return the column of travel, or else time, which a stop of the machine would stretch."""
    if wanted is not None:
        return stated_column(columns, "travel", wanted)
    numeric = [column for column in columns if not column.text]
    travels = [
        c for c in numeric if role_of(c) == "travel" and (not c.unit or is_in(c.unit, "m"))
    ]
    clear = [c for c in travels if c.name.casefold() not in ("x", "x_value")]
    choices = (
        clear, travels,
        [c for c in numeric if role_of(c) == "time" or c.name.casefold() == "x_value"],
        [c for c in numeric if is_in(c.unit, "m")], [c for c in numeric if is_in(c.unit, "s")],
    )  # fmt: skip
    found = next(filter(None, choices), [])
    if len(found) != 1:
        raise InputError(unclear(columns, "travel or time", "travel", found))
    return found[0]


def _tests_of(table: Table, readings: Readings) -> Iterator[tuple[str, Any]]:
    """Yield the label of each test in a table, and a mask of its rows."""
    numbers = [
        column
        for column in table.columns
        if re.match(TESTS, column.name.strip("_:. ").casefold())
        and role_of(column) == "specimen"
    ]
    if len(numbers) == 1 and np.isfinite(numbers[0].values).all():
        for label in dict.fromkeys(numbers[0].values.tolist()):
            yield f"{label:g}", numbers[0].values == label
        return
    lines, restarts = table.lines, np.diff(readings.travel, prepend=0.0) < 0
    # A new test begins after an empty line only if the travel goes back
    # there, or at a remark.
    begins = (np.diff(lines, prepend=lines[:1]) > 1) & restarts
    begins |= np.isin(lines, table.begins[1:])
    block = np.cumsum(begins)
    # A single test has no number.
    for label in range(int(block[-1]) + 1):
        yield f"{label + 1}" if block[-1] else "", block == label


def _known(name: str, readings: Readings) -> Readings:
    """Return readings that are not missing, with rising travel and positive force."""
    travel, force = readings.travel, readings.force
    known = np.isfinite(travel) & np.isfinite(force)  # machines miss single readings
    if not known.all():
        warn_accuracy(f"{name}: {int((~known).sum())} of {known.size} readings are missing")
        readings = readings.part(known)
    if readings.force.size < MIN_READINGS:
        raise InputError(f"holds {readings.force.size} readings, fewer than {MIN_READINGS}")
    travel, force = readings.travel, readings.force
    if readings.travel_unit == "m" and travel[-1] <= travel.min() + 0.05 * np.ptp(travel) and (
        travel[0] >= travel.max() - 0.05 * np.ptp(travel) > travel[-1]
    ):  # fmt: skip
        warn_accuracy(f"{name}: the travel only falls. Its sign is changed")
        readings = readings._replace(travel=-travel)
    return readings


def _parts(
    name: str, readings: Readings, noise: float | None, split: Split | None
) -> list[tuple[str, Readings]]:
    """Return the parts of a record that are one test each, with their labels."""
    readings = _known(name, readings)
    force = readings.force
    size = max(float(np.abs(force).max()), 1e-300)
    threshold = _threshold(force, noise)[1]
    positive, negative = (
        force > max(threshold, BOTH_SIGNS * size),
        -force > max(threshold, BOTH_SIGNS * size),
    )
    if positive.any() and negative.any():
        if split != "strokes":
            raise InputError(
                "forces have both signs, as in a reciprocating test. Pass split='strokes' to read"
                " each stroke as a test"
            )
        # The sign holds until the force clearly has the other sign.
        marked = np.flatnonzero(positive | negative)
        turns = marked[1:][np.diff(positive[marked].astype(int)) != 0]
        begins = [
            int(np.flatnonzero(np.sign(force[:turn]) != np.sign(force[turn]))[-1]) + 1
            for turn in turns
        ]
        pieces = np.split(np.arange(force.size), begins)
        return [
            (f", stroke {i}", readings.part(rows)._replace(force=np.abs(force[rows])))
            for i, rows in enumerate(pieces, 1)
        ]
    if -force.min() > force.max():
        warn_accuracy(f"{name}: forces are negative. Their signs are changed")
        readings = readings._replace(force=-force)
    readings = _without_spikes(name, readings, threshold)
    force = readings.force
    if not force.max() > 0.0:
        raise InputError("all forces are zero")
    if split == "cycles":
        starts, ends = turning_points(force, threshold)
        sizes = force[starts] - force[ends]
        full = ends[sizes >= 0.5 * np.median(np.sort(sizes)[-3:])]
        if full.size == 0:
            raise InputError("split: the record has no full slide. Leave split out")
        pieces = np.split(np.arange(force.size), full + 1)[: full.size]
        return [(f", cycle {i}", readings.part(rows)) for i, rows in enumerate(pieces, 1)]
    if _returns(force) >= MAX_RETURNS:
        raise InputError(
            f"the force falls from its peak and returns {_returns(force)} times, as in a record of"
            " stick-slip. Pass split='cycles' to read each cycle as a test"
        )
    return [("", readings)]


def _returns(force: Array) -> int:
    """Return how often the force falls from HIGH to below LOW of its peak, and returns."""
    level = np.where(force >= HIGH * force.max(), 1, np.where(force < LOW * force.max(), -1, 0))
    level = level[level != 0]
    return int(np.sum((level[1:] == 1) & (level[:-1] == -1))) - int(level[:1].sum() < 0)


def _threshold(force: Array, noise: float | None) -> tuple[float, float]:
    """Return the noise of a reading and the smallest fall that counts (steps 1 and 2)."""
    top = int(np.argmax(np.abs(force)))
    if noise is None:
        noise = noise_of(force[: top + 1] if top >= MIN_READINGS else force)
    white_range = 2.0 * noise * math.sqrt(2.0 * math.log(force.size))
    return noise, max(white_range, MIN_DROP_SHARE * float(np.abs(force).max()))


def _without_spikes(name: str, readings: Readings, threshold: float) -> Readings:
    """Leave out single readings that are far above both neighbours, and warn about them."""
    force = readings.force
    steps = np.diff(force)
    least = threshold + 3.0 * float(np.median(np.abs(steps)))
    rise = np.minimum(steps[:-1], -steps[1:])  # above both neighbours
    spikes = np.flatnonzero((rise > least) & (rise > TARE * np.abs(force).max())) + 1
    if spikes.size == 0 or spikes.size > max(1, MAX_SPIKES_SHARE * force.size):
        return readings
    first = spikes[0]
    warn_accuracy(
        f"{name}: {spikes.size} single readings are far above both neighbours, such as"
        f" {in_words(readings.unit, float(force[first]))} in line {readings.lines[first]}. They are"
        " left out"
    )
    return readings.part(np.delete(np.arange(force.size), spikes))


def _curve(name: str, readings: Readings, noise: float | None, split: Split | None) -> Curve:
    """Return the curve of one test (steps 1 to 6)."""
    travel, force, lines = readings.travel, readings.force, readings.lines
    if force.size < MIN_READINGS:
        raise InputError(f"holds {force.size} readings, fewer than {MIN_READINGS}")
    # Time never goes back. A position may tremble, but a new cycle is
    # another test.
    allowed = 0.0 if readings.travel_unit == "s" else MAX_BACKWARD_SHARE * float(np.ptp(travel))
    back = np.flatnonzero(np.maximum.accumulate(travel) - travel > allowed)
    if back.size and split != "strokes":
        raise InputError(
            f"line {lines[back[0]]}: travel or time goes back. Read one cycle at a time, and"
            " separate tests by an empty line or number them in a column 'test'"
        )
    # 1. and 2.
    noise, threshold = _threshold(force, noise)
    top = int(np.argmax(force))
    # 3.
    starts, ends = precursors(force, threshold)
    # 4.
    begin = int(ends.max(initial=0))
    peak, error = _peak(force[begin:], top - begin, noise, threshold)
    _doubt_readings(name, force, peak, noise, split)
    # 5. and 6.
    return Curve(
        name, travel, force, readings.unit, readings.travel_unit, noise, threshold,
        peak=peak, peak_error=error,
        peak_travel=float(travel[top]),
        drops=Drops(travel[starts], force[starts], force[starts] - force[ends]),
        plateau=math.nan if split == "cycles" else _plateau(force, threshold),
    )  # fmt: skip


def _peak(force: Array, top: int, noise: float, threshold: float) -> tuple[float, float]:
    """Return the peak without the bias by noise, and its standard error (step 4)."""
    near = force >= force[top] - threshold
    first = top - int(np.argmin(np.r_[near[: top + 1][::-1], False])) + 1
    last = top + int(np.argmin(np.r_[near[top:], False]))
    if noise == 0.0 or last - first < MIN_FITTED:
        return float(force[top]), noise
    u = np.linspace(-1.0, 1.0, last - first)
    powers = np.vander(u, 3)
    factors, *_ = np.linalg.lstsq(powers, force[first:last])
    fitted = powers @ factors
    place = powers[int(np.argmax(fitted))]
    error = noise * math.sqrt(place @ np.linalg.inv(powers.T @ powers) @ place)
    return float(fitted.max()), error


def _plateau(force: Array, threshold: float) -> float:
    """Return the mean force of the slide after the peak, NaN without a fall (step 6)."""
    peak = float(force.max())
    after = force[int(np.flatnonzero(force >= peak - threshold)[-1]) + 1 :]
    if after.size == 0 or peak - (level := float(np.median(after))) < threshold:
        return math.nan
    if after[-1] < 0.5 * level:
        after = after[: int(np.flatnonzero(after >= 0.9 * level)[-1]) + 1]
    after = after[int(np.argmax(after <= level + 0.25 * (peak - level))) :]
    return float(after.mean())


def _doubt_readings(
    name: str, force: Array, peak: float, noise: float, split: Split | None
) -> None:
    """Warn about a saturated load cell, and about a force at the start."""
    equal, same = np.flatnonzero(force == force.max()), np.mean(np.diff(force) == 0.0)
    if noise > 0.0 and same < 0.1 and np.any(equal[2:] - equal[:-2] == 2):
        warn_accuracy(
            f"{name}: the {equal.size} largest readings are equal, {force.max():.6g}, though the"
            " record has noise. The load cell may have been saturated, and the peak be higher"
        )
    first = float(np.median(force[:3]))
    if first > TARE * peak and split is None:
        warn_accuracy(
            f"{name}: the force begins at {first:.4g}, {100.0 * first / peak:.0f} % of the peak."
            " If the load cell was not tared, subtract this force"
        )


def summary_of(force: Array, threshold: float) -> tuple[float, float, float]:
    """Return number of precursors, largest size, and force at the first precursor or else
    the peak."""
    starts, ends = precursors(force, threshold)
    sizes = force[starts] - force[ends]
    first = force[starts[0]] if sizes.size else force.max()
    return float(sizes.size), float(sizes.max(initial=0.0)), float(first)


def precursors(force: Array, threshold: float) -> tuple[Any, Any]:
    """Return the readings at which drops before the peak begin and end (step 3)."""
    starts, ends = turning_points(force, threshold)
    before = starts < int(np.argmax(force))
    return starts[before], ends[before]


def noise_of(force: Array) -> float:
    """Return the standard deviation of a reading (step 1)."""
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
    """Return the readings at which drops begin and end (step 3)."""
    # `high` and `low` are the extreme readings since the last turning point.
    starts, ends = [], []
    high = low = 0
    falling = False
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
