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
4. The peak is the largest force. Drops that begin before the peak are
   precursors. The plateau follows the drop at the peak.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import Number, Positive, checked, describe
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import in_words, is_in
from stiction.problem.profiles.files import EXCEL, TEXT, read_table
from stiction.problem.profiles.labels import column_of, in_si, unit_of, with_stated_unit
from stiction.problem.profiles.reading import Missing
from stiction.problem.profiles.tables import Options, table_of_frame

FORCE = ("force", "load", "kraft", "standardkraft", "friction", "stress", "coefficient", "mu")
TRAVEL = (
    "travel", "displacement", "extension", "position", "crosshead", "weg", "standardweg", "x",
)  # fmt: skip
TIME = ("time", "zeit", "t")
TEST = ("test", "specimen", "run", "probe", "versuch")
"""First words of the headings of force, travel, time and test number."""
FORCE_UNITS, TRAVEL_UNITS = ("N", "Pa", "1"), ("m", "s")
"""SI units of the measured quantity, and of travel or time."""
MIN_READINGS = 8
"""Fewest readings of a test."""
MAX_BACKWARD_SHARE = 0.05
"""Largest share of its range by which travel may go back. A larger one begins another cycle."""
ROUND_OFF = 1e-12
"""Share of the largest force below which differences of readings are round-off."""
MIN_DROP_SHARE = 1e-6
"""Share of the peak below which a fall is round-off if there is no noise."""


class Drops(NamedTuple):
    """Drops of the force: travel and force at the beginning, and size of each drop."""

    travel: Array
    force: Array
    size: Array


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
        Largest force and its travel.
    drops : Drops
        Precursors: drops before the peak. The error of each size is
        about twice the noise.
    plateau : float
        Mean force after the drop at the peak. NaN if the record ends there.
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
            Row("peak", self.peak, (), self.unit),
            Row("peak at", self.peak_travel, (), self.travel_unit),
            Row("precursors", self.drops.size.size),
            Row("plateau", self.plateau, (), self.unit),
            Row("noise of a reading", self.noise, (), self.unit),
        ]
        return Summary(self.name, rows)


@dataclass(frozen=True, eq=False, repr=False)
class Curves(Result):
    """Curves from repeated tests, for `read_peaks`, `infer` and figures."""

    tests: tuple[Curve, ...]

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
        return "\n".join(map(str, self.tests))

    def _summary(self) -> Summary:
        rows = [Row(curve.name, curve.peak, (), curve.unit) for curve in self]
        return Summary(f"Peaks of {len(self)} tests", rows)


@checked
def read_curve(
    source: Any,
    *,
    force: int | str | None = None,
    travel: int | str | None = None,
    unit: str | None = None,
    travel_unit: str | None = None,
    speed: Positive | None = None,
    noise: Positive | None = None,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
) -> Curves:
    """Read force against travel or time. Find the peak, precursors and plateau of each test.

    Parameters
    ----------
    source : path, DataFrame or (travel, force)
        A text file or workbook, a folder of such files, a pandas table,
        or two arrays. A table needs a column with force, stress or
        friction coefficient and a column with travel or time. A file
        may hold several tests, either numbered in a column ``test`` or
        separated by empty lines.
    force, travel : str or int, optional
        Column, given by its name, heading or number from 0. By default
        the force is the column called force, load, friction, ... and
        the travel is the column called travel, displacement, extension,
        position, ... or else time.
    unit, travel_unit : str, optional
        Units of force and travel if the source states no units.
    speed : float, optional
        Speed of the crosshead, m/s. It turns time into travel.
    noise : float, optional
        Standard deviation of a reading of the load cell, in SI. By
        default it is estimated from neighbouring readings, which needs
        a load cell without a filter.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`.

    Returns
    -------
    Curves
        A sequence with a `Curve` for each test.

    Raises
    ------
    InputError
        If a file cannot be read, a unit is missing or unknown, columns
        are ambiguous, or travel or time goes back.

    Warns
    -----
    AccuracyWarning
        If readings are missing, all forces are negative, or a record
        ends at its peak.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> travel = np.linspace(0.0, 1e-3, 500)
    >>> force = np.minimum(2e5 * travel, 100.0) - 20.0 * (travel > 3e-4) - 10.0 * (travel > 8e-4)
    >>> print(st.read_curve((travel, force), unit="N", travel_unit="m"))
    test: peak 80 N at 501 µm, 1 precursor from 59.7 N on, of up to 19.6 N, plateau 70 N, noise 0 N
    """
    options = Options(skip, sheet, missing, decimal)
    tests: list[Curve] = []
    for name, table in _tables(source, options):
        with prefixed(name):
            readings = _readings(table, force, travel, unit, travel_unit, speed)
            spans = [*_tests_of(table, readings)]
        for label, rows in spans:
            number = f", test {label}" * bool(label)
            with prefixed(name + number):
                tests.append(_curve(Path(name).stem + number, readings, rows, noise))
    if len({(curve.unit, curve.travel_unit) for curve in tests}) > 1:
        raise InputError(
            "source: units of force or travel differ between tests. Read them in separate calls"
        )
    if ends := [curve.name for curve in tests if math.isnan(curve.plateau)]:
        warn_accuracy(
            f"the record ends at its peak in {', '.join(ends[:3])} ({len(ends)} of {len(tests)}"
            " tests). The interface may not have slid as a whole, and its peak may be higher"
        )
    return Curves(tuple(tests))


class Readings(NamedTuple):
    """Readings from a file in SI, with units and line numbers."""

    travel: Array
    force: Array
    unit: str
    travel_unit: str
    lines: Array


def _tables(source: Any, options: Any) -> Iterator[tuple[str, Any]]:
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
        yield "test", _table_of_arrays(*source)
    else:
        raise InputError(
            f"source: must be a path, a DataFrame or (travel, force). Got {describe(source)}"
        )


def _table_of_arrays(travel: Any, force: Any) -> Any:
    """Return arrays of travel and force as a table, with the units that they state."""
    import xarray as xr

    columns = {}
    for name, given, units in (("travel", travel, TRAVEL_UNITS), ("force", force, FORCE_UNITS)):
        values, unit = with_stated_unit(given, units)
        columns[name] = "row", np.asarray(values), {"units": unit or ""}
    try:
        return xr.Dataset(columns)
    except ValueError as error:
        raise InputError(f"travel and force must be of equal length: {error}") from None


def _readings(
    table: Any,
    force: int | str | None,
    travel: int | str | None,
    unit: str | None,
    travel_unit: str | None,
    speed: float | None,
) -> Readings:
    """Return force and travel from a table, in SI."""
    column = column_of(table, FORCE, FORCE_UNITS, force)
    # Travel is better than time, which a stop of the machine would stretch.
    along = column_of(table, TRAVEL, ("m",), travel)
    along = column_of(table, TIME, ("s",)) if along is None else along
    if column is None or along is None:
        missing = "force" if column is None else "travel or time"
        names = ", ".join(map(repr, table.data_vars))
        raise InputError(
            f"no column is clearly the {missing}. Choose force= and travel= among {names}"
        )
    if texts := [c.attrs["text"] for c in (along, column) if c.attrs.get("text")]:
        raise InputError(texts)
    at, at_si = column_in_si(along, "travel", travel_unit, TRAVEL_UNITS, "travel_unit")
    values, si = column_in_si(column, "force", unit, FORCE_UNITS, "unit")
    if at_si == "s" and speed is not None:
        at, at_si = at * speed, "m"
    lines = np.asarray(table.attrs.get("lines", np.arange(at.size)))
    return Readings(at, values, si, at_si, lines)


def column_in_si(
    column: Any, quantity: str, given: str | None, units: Iterable[str], option: str = ""
) -> tuple[Array, str]:
    """Return a column in SI and its SI unit. The source or the caller states the original unit."""
    name = given or unit_of(column)
    if not name:
        way = f", or pass {option}=" * bool(option)
        raise InputError(
            f"the unit of the {quantity} is not stated. Write it into the heading{way}"
        )
    for si in units:
        if is_in(name, si):
            return in_si(column, quantity, si, given), si
    raise InputError(
        f"the {quantity} is in {name}. Its unit must be a multiple of {' or '.join(units)}"
    )


def _tests_of(table: Any, readings: Readings) -> Iterator[tuple[str, Any]]:
    """Yield the label of each test in a table, and a mask of its rows."""
    number = column_of(table, TEST)
    if number is not None and np.isfinite(number.values).all():
        for label in dict.fromkeys(number.values.tolist()):
            yield f"{label:g}", number.values == label
        return
    blocks = np.asarray(table.attrs.get("blocks", np.zeros(readings.travel.size)))
    # A new test begins after an empty line
    # only if the travel goes back there.
    restarts = np.diff(readings.travel, prepend=0.0) < 0
    begins = (np.diff(blocks, prepend=blocks[:1]) > 0) & restarts
    block = np.cumsum(begins)
    # A single test has no number.
    for label in range(int(block[-1]) + 1):
        yield f"{label + 1}" if block[-1] else "", block == label


def _curve(name: str, readings: Readings, rows: Array, noise: float | None) -> Curve:
    """Return the curve of one test (steps 1 to 4)."""
    travel, force, lines = readings.travel[rows], readings.force[rows], readings.lines[rows]
    known = np.isfinite(travel) & np.isfinite(force)  # machines miss single readings
    if not known.all():
        warn_accuracy(f"{name}: {int((~known).sum())} of {known.size} readings are missing")
        travel, force, lines = travel[known], force[known], lines[known]
    if force.size < MIN_READINGS:
        raise InputError(f"holds {force.size} readings, fewer than {MIN_READINGS}")
    # Time never goes back. A position may tremble, but a new cycle is
    # another test.
    allowed = 0.0 if readings.travel_unit == "s" else MAX_BACKWARD_SHARE * float(np.ptp(travel))
    back = np.flatnonzero(np.maximum.accumulate(travel) - travel > allowed)
    if back.size:
        raise InputError(
            f"line {lines[back[0]]}: travel or time goes back. Read one cycle at a time, and"
            " separate tests by an empty line or number them in a column 'test'"
        )
    if -force.min() > force.max():
        warn_accuracy(f"{name}: forces are negative. Their signs are changed")
        force = -force
    if not force.max() > 0.0:
        raise InputError("all forces are zero")
    top = int(np.argmax(force))
    # 1.
    if noise is None:
        noise = noise_of(force[: top + 1] if top >= MIN_READINGS else force)
    # 2.
    white_range = 2.0 * noise * math.sqrt(2.0 * math.log(force.size))
    threshold = max(white_range, MIN_DROP_SHARE * force[top])
    # 3. and 4.
    starts, ends = turning_points(force, threshold)
    # The plateau begins where the drop at the peak ends, and is empty
    # without such a drop.
    after = force[ends[starts == top].min(initial=force.size) :]
    starts, ends = starts[starts < top], ends[starts < top]
    return Curve(
        name, travel, force, readings.unit, readings.travel_unit, noise, threshold,
        peak=float(force[top]),
        peak_travel=float(travel[top]),
        drops=Drops(travel[starts], force[starts], force[starts] - force[ends]),
        plateau=float(after.mean()) if after.size else math.nan,
    )  # fmt: skip


def summary_of(force: Array, threshold: float) -> tuple[float, float, float]:
    """Return number of precursors, largest size, and force at the first precursor or else
    the peak."""
    starts, ends = turning_points(force, threshold)
    before = starts < int(np.argmax(force))
    sizes = force[starts[before]] - force[ends[before]]
    first = force[starts[before][0]] if sizes.size else force.max()
    return float(sizes.size), float(sizes.max(initial=0.0)), float(first)


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
