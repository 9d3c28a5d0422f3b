"""Measured curves of force against travel or time: peak, precursors and plateau of each test.

Readings F_i carry white noise of standard deviation s. Wanted are the peak, the drops before it,
in each of which a part of the interface slips and comes to rest, and the plateau after it.

1. Noise. Second differences F_(i-1) - 2 F_i + F_(i+1) vanish where the force is a straight line,
   and have the variance 6 s^2. Their median gives s; drops are too rare to change it. A cell that
   reads in steps q has at least s = q/sqrt(12).
2. Threshold. n readings of a constant force have a range of about 2 s sqrt(2 ln n) (David and
   Nagaraja, Order Statistics, 2003, section 10.5). Only a larger fall is a drop.
3. Turning points. From the last lowest reading on, the highest is kept until the force lies more
   than the threshold below it: there a drop begins. The lowest is then kept until the force lies
   more than the threshold above it: there the drop has ended.
4. The peak is the largest force. Drops that begin before it are precursors. The plateau is what
   follows the drop at the peak.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import Number, Positive, checked, describe, real_array
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import factor_to, in_words, is_in, parse
from stiction.problem.profiles.reading import Missing, reading_options, with_stated_unit
from stiction.problem.profiles.tables import (
    EXCEL,
    TEXT,
    Options,
    column_of,
    read_table,
    table_of_frame,
)

FORCE = ("force", "load", "kraft", "standardkraft", "friction", "stress", "coefficient", "mu")
TRAVEL = (
    "travel",
    "displacement",
    "extension",
    "position",
    "crosshead",
    "weg",
    "standardweg",
    "x",
)
TIME = ("time", "zeit", "t")
TEST = ("test", "specimen", "run", "probe", "versuch")
"""First words of headings: of the force, the travel, the time and the number of the test."""
FORCE_UNITS, TRAVEL_UNITS = ("N", "Pa", "1"), ("m", "s")
"""Units of what is measured, and of what it is measured over."""
MIN_READINGS = 8
"""Readings of a test."""
MAX_BACKWARD_SHARE = 0.05
"""Share of its range by which travel may go back: more is another cycle."""
ROUND_OFF = 1e-12
"""Share of the largest force below which differences of readings are round-off."""
MIN_DROP_SHARE = 1e-6
"""Share of the peak below which a fall is round-off, without any noise."""


class Drops(NamedTuple):
    """Falls of the force: where each begins, from which force, and by how much it falls."""

    travel: Array
    force: Array
    size: Array


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Result):
    """The curve of one test, and what it says.

    Attributes
    ----------
    name : str
        File, and number of the test if the file holds several.
    travel, force : (readings,) arrays
        In SI; travel is the time of tests without a travel.
    unit, travel_unit : str
        "N", "Pa" or "1" of the force, "m" or "s" of the travel.
    noise : float
        Standard deviation of a reading.
    threshold : float
        Fall of the force from which on it is a drop.
    peak, peak_travel : float
        Largest force, and where it was reached.
    drops : Drops
        Drops before the peak: precursors. Each size is uncertain by about twice the noise.
    plateau, plateau_deviation : float
        Mean and standard deviation of the force after the drop at the peak; NaN if the record
        ends there.
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
    plateau_deviation: float

    def __str__(self) -> str:
        count = self.drops.size.size
        text = (
            f"{self.name}: peak {in_words(self.unit, self.peak)} at"
            f" {in_words(self.travel_unit, self.peak_travel)}, {count} precursor"
            + "s"
            * (count != 1)
        )
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
    """Curves of repeated tests: a sequence of `Curve`, for `read_peaks`, `infer` and figures."""

    tests: tuple[Curve, ...]

    @property
    def unit(self) -> str:
        """Unit of the force of all tests."""
        return self.tests[0].unit

    @property
    def peaks(self) -> Array:
        """The peak of each test, in `unit`."""
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
    """Read force against travel or time, and find peak, precursors and plateau of each test.

    Parameters
    ----------
    source : path, DataFrame or (travel, force)
        A text file or workbook with a column of force, stress or friction coefficient and one
        of travel or time; a folder of them; a table of pandas; or two arrays. One file may
        hold several tests: in a column ``test``, or separated by empty lines.
    force, travel : str or int, optional
        Column: name, heading or number from 0. By default the one called force, load,
        friction, ..., and travel, displacement, extension, position, ... or else time.
    unit, travel_unit : str, optional
        Their units if the source states none.
    speed : float, optional
        Speed of the crosshead, m/s: turns time into travel.
    noise : float, optional
        Standard deviation of a reading of the load cell, in SI. By default it is estimated
        from neighbouring readings, which needs a cell without a filter.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`.

    Returns
    -------
    Curves
        A sequence of one `Curve` for each test.

    Raises
    ------
    InputError
        If a file cannot be read, a unit is missing or unknown, columns are ambiguous, or
        travel or time goes back.

    Warns
    -----
    AccuracyWarning
        If readings are missing, all forces are negative, or a record ends at its peak.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> travel = np.linspace(0.0, 1e-3, 500)
    >>> force = np.minimum(2e5 * travel, 100.0) - 20.0 * (travel > 3e-4) - 10.0 * (travel > 8e-4)
    >>> print(st.read_curve((travel, force), unit="N", travel_unit="m"))
    test: peak 80 N at 501 µm, 1 precursor from 59.7 N on, of up to 19.6 N, plateau 70 N, noise 0 N
    """
    options = reading_options(missing, decimal, skip, sheet)
    tests: list[Curve] = []
    for name, table in _tables(source, options):
        with prefixed(name):
            columns = _columns(table, force, travel, unit, travel_unit, speed)
            for label, chosen in _tests_of(table, columns):
                with prefixed(f"test {label}" if label else ""):
                    full = f"{Path(name).stem}, test {label}" if label else Path(name).stem
                    tests.append(_curve(full, columns, chosen, noise))
    if len({(curve.unit, curve.travel_unit) for curve in tests}) > 1:
        raise InputError(
            "source: tests differ in what they measure, such as force over travel and stress over"
            " time; read them apart"
        )
    if ends := [curve.name for curve in tests if math.isnan(curve.plateau)]:
        warn_accuracy(
            f"the record ends at its peak in {', '.join(ends[:3])} ({len(ends)} of {len(tests)}"
            " tests): the interface may not have slid as a whole, and its peak may be higher"
        )
    return Curves(tuple(tests))


class Columns(NamedTuple):
    """Readings of a file in SI, their units, and the lines where they stand."""

    travel: Array
    force: Array
    unit: str
    travel_unit: str
    lines: Array


def _tables(source: Any, options: Options) -> Iterator[tuple[str, Any]]:
    """Yield each file of a folder, or the one source, as a table with its name."""
    if isinstance(source, str | Path):
        path = Path(source)
        files = [path]
        if path.is_dir():
            files = sorted(
                file for file in path.iterdir()
                if file.suffix.lower() in (*TEXT, EXCEL) and not file.name.startswith((".", "~"))
            )  # fmt: skip
            if not files:
                raise InputError(
                    f"{path}: holds no file that ends in {', '.join((*TEXT, EXCEL))}"
                )
        for file in files:
            with prefixed(str(file)):
                table = read_table(file, options)
            yield str(file), table
    elif hasattr(source, "columns") and hasattr(source, "to_xarray"):
        yield "test", table_of_frame(source)
    elif isinstance(source, tuple | list) and len(source) == 2:
        yield "test", source
    else:
        raise InputError(
            f"source: must be a path, a DataFrame or (travel, force), got {describe(source)}"
        )


def _columns(
    table: Any,
    force: int | str | None,
    travel: int | str | None,
    unit: str | None,
    travel_unit: str | None,
    speed: float | None,
) -> Columns:
    """Return the force and the travel of a table, in SI."""
    if isinstance(table, tuple | list):
        pairs = [
            with_stated_unit(v, u)
            for v, u in zip(table, (TRAVEL_UNITS, FORCE_UNITS), strict=True)
        ]
        (at, at_unit), (values, value_unit) = pairs
        lines = np.arange(np.size(at))
    else:
        column = column_of(table, FORCE, FORCE_UNITS, force)
        along = column_of(table, TRAVEL, ("m",), travel)
        along = column_of(table, TIME, ("s",)) if along is None else along
        if column is None or along is None:
            missing = "force" if column is None else "travel or time"
            names = ", ".join(map(repr, table.data_vars))
            raise InputError(
                f"no column is clearly the {missing}; found {names}. Pass force= and travel= with"
                " their names or numbers"
            )
        if texts := [c.attrs["text"] for c in (along, column) if c.attrs.get("text")]:
            raise InputError(texts)
        at, values = along.values, column.values
        at_unit, value_unit = along.attrs.get("units"), column.attrs.get("units")
        lines = table.attrs.get("lines", np.arange(at.size))
    at, at_si = _in_si(at, at_unit, travel_unit, TRAVEL_UNITS, "travel")
    values, si = _in_si(values, value_unit, unit, FORCE_UNITS, "force")
    if at.shape != values.shape or at.ndim != 1:
        raise InputError(f"travel and force have shapes {at.shape} and {values.shape}")
    if at_si == "s" and speed is not None:
        at, at_si = at * speed, "m"
    return Columns(at, values, si, at_si, np.asarray(lines))


def _in_si(
    values: Any, stated: str | None, given: str | None, units: tuple[str, ...], what: str
) -> tuple[Array, str]:
    """Return values in the SI unit of their kind, by the unit that they or the caller state."""
    option = "unit" if what == "force" else "travel_unit"
    if stated and given and stated != given:
        raise InputError(f"{option}: is {given!r}, but the source states {stated!r}")
    name = stated or given
    if name is None:
        raise InputError(
            f"the unit of the {what} is not stated; pass {option}=, such as 'mm' or 'N'"
        )
    si = next((si for si in units if is_in(name, si)), None)
    if si is None:
        if parse(name) is None:
            factor_to(units[0], name)  # says that it is unknown
        raise InputError(
            f"the {what} is in {name}; it must be in {', '.join(units)} or a multiple"
        )
    try:
        return real_array(values) * factor_to(si, name), si
    except TypeError as error:
        raise InputError(f"{what}: must be numbers; {error}") from None


def _tests_of(table: Any, columns: Columns) -> Iterator[tuple[str, Any]]:
    """Yield the label of each test in a table, and which of its rows belong to the test."""
    number = None if isinstance(table, tuple | list) else column_of(table, TEST)
    if number is not None and np.isfinite(number.values).all():
        for label in dict.fromkeys(number.values.tolist()):
            yield f"{label:g}", number.values == label
        return
    blocks = np.zeros(columns.travel.size)
    if not isinstance(table, tuple | list) and "blocks" in table.attrs:
        blocks = np.asarray(table.attrs["blocks"])
    # An empty line inside a test separates nothing: only one after which travel begins again.
    begins = (np.diff(blocks, prepend=blocks[:1]) > 0) & (
        np.diff(columns.travel, prepend=0.0) < 0
    )
    block = np.cumsum(begins)
    for label in range(int(block[-1]) + 1):
        yield f"{label + 1}" if block[-1] else "", block == label


def _curve(name: str, columns: Columns, chosen: Array, noise: float | None) -> Curve:
    """Return what one test says (steps 1 to 4)."""
    travel, force, lines = columns.travel[chosen], columns.force[chosen], columns.lines[chosen]
    known = np.isfinite(travel) & np.isfinite(force)
    if not known.all():
        warn_accuracy(f"{name}: {int((~known).sum())} of {known.size} readings are missing")
        travel, force, lines = travel[known], force[known], lines[known]
    if force.size < MIN_READINGS:
        raise InputError(f"holds {force.size} readings, fewer than {MIN_READINGS}")
    allowed = 0.0 if columns.travel_unit == "s" else MAX_BACKWARD_SHARE * float(np.ptp(travel))
    back = np.flatnonzero(np.maximum.accumulate(travel) - travel > allowed)
    if back.size:
        raise InputError(
            f"line {lines[back[0]]}: travel or time goes back to {travel[back[0]]:.6g}"
            f" {columns.travel_unit}; read one test or cycle at a time, with a column 'test' or an"
            " empty line between tests"
        )
    if -force.min() > force.max():
        warn_accuracy(f"{name}: forces are negative; their signs are changed")
        force = -force
    if not force.max() > 0.0:
        raise InputError("all forces are zero")
    top = int(np.argmax(force))
    rising = force[: top + 1] if top >= MIN_READINGS else force
    if noise is None:
        noise = noise_of(rising)
    threshold = max(
        2.0 * noise * math.sqrt(2.0 * math.log(force.size)), MIN_DROP_SHARE * force[top]
    )
    starts, ends = turning_points(force, threshold)
    before = starts < top
    after = ends[starts == top]
    rest = force[after[0] :] if after.size else force[:0]
    return Curve(
        name, travel, force, columns.unit, columns.travel_unit, noise, threshold,
        peak=float(force[top]),
        peak_travel=float(travel[top]),
        drops=Drops(
            travel[starts[before]], force[starts[before]],
            force[starts[before]] - force[ends[before]],
        ),
        plateau=float(rest.mean()) if rest.size else math.nan,
        plateau_deviation=float(rest.std()) if rest.size else math.nan,
    )  # fmt: skip


def summary_of(force: Array, threshold: float) -> tuple[float, float, float]:
    """Return number of precursors, size of the largest, and force at the first (else the peak)."""
    starts, ends = turning_points(force, threshold)
    before = starts < int(np.argmax(force))
    sizes = force[starts[before]] - force[ends[before]]
    first = force[starts[before][0]] if sizes.size else force.max()
    return float(sizes.size), float(sizes.max(initial=0.0)), float(first)


def noise_of(force: Array) -> float:
    """Return the standard deviation of a reading (step 1)."""
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
    if falling:
        ends.append(low)
    return np.array(starts, dtype=np.int64), np.array(ends, dtype=np.int64)
