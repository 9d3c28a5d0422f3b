"""Measured peaks, validated and in SI units, with one array for each kind of specimen.

`make_peaks` is the door for all kinds of input: numbers with or without
a unit, mappings from specimen lengths to numbers, tables of pandas, and
curves. `read_peaks` reads a file. A wrong unit would change a result by
a factor of a thousand, so a unit that contradicts another unit is
refused, and so are peaks that are far from the predictions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed
from stiction.base.model import FilePath, Number, RealArray, check, checked, describe, is_finite
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import factor_to, is_in, magnitude_in_one_of
from stiction.inference.curves import Curves, column_in_si
from stiction.problem.profiles.files import read_table
from stiction.problem.profiles.labels import column_of, with_stated_unit, without_missing
from stiction.problem.profiles.reading import Missing
from stiction.problem.profiles.tables import Options, table_of_frame

MIN_PEAKS = 3
"""Fewest different peaks in all: of two numbers, one may be a mistake."""
MAX_PEAK_RATIO = 50.0
"""Ratio of measured and predicted peaks above which their unit must be wrong."""
MIN_CURVE_LINES = 100
"""Fewest lines of a table that is taken for a curve if its time or travel only rises."""
PEAK_COLUMNS = ("peak", "tau", "stress", "strength", "force", "friction")
LENGTH_COLUMNS = ("length", "specimen")
VARIABLES = {"Pa": "critical_stress", "N": "critical_force", "1": "friction_coefficient"}
"""Variable of a method that each unit measures."""


@dataclass(frozen=True, eq=False, repr=False)
class Peaks(Result):
    """Peaks of repeated tests, by the length of the specimens.

    Attributes
    ----------
    lengths : tuple of float or None
        Specimen length for each kind, m.
        None means the length of the problem.
    values : tuple of arrays
        Peaks of each kind, in `unit`.
    unit : str
        "Pa", "N" for forces, or "1" for friction coefficients.
    """

    lengths: tuple[float | None, ...]
    values: tuple[Array, ...]
    unit: str

    def refuse_far(self, predicted: Sequence[Array]) -> None:
        """Refuse peaks that differ so much from predictions that their unit must be wrong."""
        for values, predictions in zip(self.values, predicted, strict=True):
            measured, expected = np.median(values), np.median(predictions)
            if not 1.0 / MAX_PEAK_RATIO < measured / expected < MAX_PEAK_RATIO:
                raise InputError(
                    f"peaks: are about {measured:.3g} {self.unit}, but predictions are about"
                    f" {expected:.3g} {self.unit}. State the unit, as in unit='kPa' or unit='N'"
                )

    @property
    def variable(self) -> str:
        """Name of the measured quantity among the results of a method."""
        return VARIABLES[self.unit]

    def _summary(self) -> Summary:
        kinds = zip(self.lengths, self.values, strict=True)
        rows = [
            Row(f"peak {i + 1}" + (f" at {length:g} m" if length else ""), peak, (), self.unit)
            for length, values in kinds
            for i, peak in enumerate(values.tolist())
        ]
        return Summary(str(self), rows)

    def __repr__(self) -> str:
        return self._summary().text

    def __str__(self) -> str:
        pairs = zip(self.lengths, self.values, strict=True)
        kinds = [
            f"{v.size} peaks" + (f" at {length:g} m" if length else "") for length, v in pairs
        ]
        return ", ".join(kinds)


def make_peaks(peaks: Any, unit: str = "Pa") -> Peaks:
    """Return valid peaks, given an array, a mapping from lengths to arrays, a table or curves."""
    if isinstance(peaks, Peaks):
        return peaks
    if isinstance(peaks, Curves):
        return make_peaks(peaks.peaks, peaks.unit)
    if hasattr(peaks, "columns") and hasattr(peaks, "to_xarray"):
        with prefixed("peaks"):
            return _of_table(table_of_frame(peaks), None, Options())
    # Lengths may be quantities with a unit.
    groups: dict[Any, Any] = dict(peaks) if isinstance(peaks, Mapping) else {None: peaks}
    groups = {magnitude_in_one_of(key, ["m"])[0]: values for key, values in groups.items()}
    if not all(key is None or (is_finite(key) and key > 0.0) for key in groups):
        raise InputError(
            "peaks: the keys of a mapping must be lengths (m), such as {0.1: [...], 0.2: [...]}."
            f" Got {describe(list(groups))}"
        )
    lengths = tuple(None if length is None else float(length) for length in groups)
    values = tuple(_in_si(given, unit) for given in groups.values())
    different = np.unique(np.concatenate([np.zeros(0), *values])).size
    if different < MIN_PEAKS:
        raise InputError(
            f"peaks: at least {MIN_PEAKS} different values are needed, got {different}. Test more"
            " specimens, or pass the fit of profiles alone to st.design_stress"
        )
    return Peaks(lengths, values, si_of(unit))


def si_of(unit: str) -> str:
    """Return the SI unit for a unit: "1", "N", or otherwise "Pa"."""
    return next((one for one in VARIABLES if is_in(unit, one)), "Pa")


def factor_of(unit: str, peaks: Any = None) -> float:
    """Return the factor that converts a unit of peaks to SI. It is 1 if they are in SI already."""
    if isinstance(peaks, Peaks | Curves):
        return 1.0
    with prefixed("unit"):
        return factor_to(si_of(unit), unit)


def _in_si(given: Any, unit: str) -> Array:
    """Return peaks for one kind of specimen in SI. A unit that the values carry is used."""
    with prefixed("peaks"):
        numbers, stated = with_stated_unit(given, VARIABLES)
    if si_of(stated or unit) != si_of(unit):
        raise InputError(f"peaks: are in {stated}, but unit = {unit!r}. Pass unit={stated!r}")
    values: Array = check("peaks", numbers, RealArray)
    if values.ndim != 1:
        raise InputError(
            "peaks: must be a list of numbers, or map each length (m) to its peaks, such as"
            f" {{0.1: [...], 0.2: [...]}}. Got {describe(given)}"
        )
    bad = np.flatnonzero(~(values > 0.0) | np.isinf(values))
    if bad.size:
        raise InputError(
            f"peaks: must be positive numbers, but number {bad[0]} is {values[bad[0]]:g}. Leave out"
            " tests without a peak, or pass missing= to st.read_peaks"
        )
    return values * factor_of(stated or unit)


@checked
def read_peaks(
    source: FilePath | Curves,
    *,
    unit: str | None = None,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
) -> Peaks:
    """Read the peaks of repeated tests from a text file or a workbook (.xlsx).

    First plot the peaks in the order of the tests. Peaks that drift are
    not a sample from one distribution.

    Parameters
    ----------
    source : path or Curves
        Curves from `stiction.read_curve`, or a table with a heading and
        one test in each line, separated by commas, semicolons, tabs or
        blanks. The peaks are the column called peak, stress, strength,
        force or friction, with its unit: ``peak [MPa]``. Forces have
        the unit N or kN. Friction coefficients have the unit 1 or -. If
        no column has such a name, the peaks are the only column with a
        suitable unit. A column ``length [mm]`` may hold the length of
        the specimen. Other columns are not read.
    unit : str, optional
        Unit of the peaks if the file does not state it.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`. Tests without a peak are left out.

    Returns
    -------
    Peaks
        For `stiction.infer`.

    Raises
    ------
    InputError
        If a unit is missing or unknown, columns are ambiguous, a number
        is missing, or the file is the curve of one test.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import stiction as st
    >>> path = Path(tempfile.mkdtemp()) / "peaks.csv"
    >>> _ = path.write_text("test, peak [MPa]\\n1, 0.71\\n2, 0.69\\n3, 0.74\\n")
    >>> print(st.read_peaks(path))
    3 peaks
    """
    options = Options(skip, sheet, missing, decimal)
    if isinstance(source, Curves):
        return make_peaks(source)
    with prefixed(str(source)):
        return _of_table(read_table(Path(source), options), unit, options)


def _refuse_curve(table: Any, read: set[str]) -> None:
    """Refuse a long table in which time or travel only rises: it is the curve of a test."""
    for name, column in table.items():
        timed = any(is_in(column.attrs.get("units"), si) for si in ("m", "s"))
        long = name not in read and len(column) >= MIN_CURVE_LINES
        if timed and long and np.all(np.diff(column) >= 0):
            raise InputError(
                f"{name!r} only rises over {len(column)} lines, as in the curve of one test. Read"
                " curves with st.read_curve, and pass them to st.read_peaks"
            )


def _of_table(table: Any, unit: str | None, options: Options) -> Peaks:
    """Return the peaks in a table of tests."""
    length, peak = column_of(table, LENGTH_COLUMNS), column_of(table, PEAK_COLUMNS, VARIABLES)
    if peak is None:
        names = ", ".join(map(str, table.data_vars))
        raise InputError(f"no column has a name like 'peak [MPa]'. The columns are {names}")
    columns = [column for column in (length, peak) if column is not None]
    _refuse_curve(table, {column.name for column in columns})
    if any(texts := [column.attrs["text"] for column in columns]):
        raise InputError(filter(None, texts))
    values, si = column_in_si(without_missing(peak, options), "peak", unit, VARIABLES, "unit")
    # A stated word or number marks a test without a peak. Any other NaN
    # is a mistake.
    kept = ~np.isnan(values) if options.missing is not None else np.ones(values.size, np.bool_)
    if length is None:
        return make_peaks(values[kept], si)
    lengths = column_in_si(length, "length", None, ("m",))[0][kept]
    if np.isnan(lengths).any():
        row = int(np.argmax(np.isnan(lengths)))
        raise InputError(f"length: missing in row {row}. Give the length of each specimen")
    groups = {size: values[kept][lengths == size] for size in np.unique(lengths)}
    return make_peaks(groups, si)
