"""Measured peaks, validated and in SI units, with one array for each specimen type.

`make_peaks` is the door for all kinds of input: numbers with or without
a unit, mappings from specimen lengths to numbers, tables of pandas, and
curves. `read_peaks` reads a file. A wrong unit would change a result by
a factor of a thousand, so a unit that contradicts another unit is
refused, and so are peaks that are far from the predictions.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import (
    Count,
    FilePath,
    Number,
    Positive,
    RealArray,
    check,
    checked,
    describe,
    is_finite,
)
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import conversion, is_in, magnitude_in_one_of
from stiction.inference.curves import Curves
from stiction.inference.standards import standards_of
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
from stiction.problem.reading.files import read_table
from stiction.problem.reading.labels import (
    Missing,
    column_in_si,
    several_tables,
    with_stated_unit,
    without_missing,
)
from stiction.problem.reading.tables import Options, table_of_frame

MIN_PEAKS = 3
"""Fewest different peaks, because one of two numbers may be a mistake."""
MAX_PEAK_RATIO = 50.0
"""Ratio of measured and predicted peaks above which their unit must be
wrong."""
MAX_STATISTICS = 4
"""Most rows of statistics without names below a table."""
MIN_CURVE_LINES = 100
"""Fewest lines of a table that is taken for a curve if its time or
travel only rises."""
PART = re.compile(r"(.*\d)[ ._-]?[A-Za-z]")
"""Name of a slip load that consists of the number of its specimen and a
letter."""
SPECIMEN_NAMES = "specimen|sample|probe|éprouvette|muestra|probeta"
"""Beginnings of the heading of a column that says which specimen was
tested."""
SLIP_FACTORS = (0.05, 1.0)
"""Range of slip factors. Swapped columns or units lead far beyond this
range."""
VARIABLES = {"Pa": "critical_stress", "N": "critical_force", "1": "friction_coefficient"}
"""Variable of a method that each unit measures."""


@dataclass(frozen=True, eq=False, repr=False)
class Peaks(Result):
    """Peaks in repeated tests, by specimen length.

    Attributes
    ----------
    lengths : tuple of float or None
        Specimen length for each kind, m.
        None means the length of the problem.
    values : tuple of arrays
        Peaks of each kind, in `unit`.
    unit : str
        "Pa", "N" for forces, or "1" for friction coefficients.
    normal_forces : tuple of arrays, optional
        Normal force of each test (N), or normal stress (Pa), if
        coefficients were computed from them.
    specimens : tuple of arrays, optional
        Name or number of each test's specimen.
    read : Reading, optional
        File, column, unit, number of values, and what was left out.
    surfaces : int
        Number of friction surfaces that carry a slip load.
    loads : Peaks, optional
        Single slip loads, if these peaks are the means of specimens.
    """

    lengths: tuple[float | None, ...]
    values: tuple[Array, ...]
    unit: str
    normal_forces: tuple[Array, ...] | None = None
    specimens: tuple[Any, ...] | None = None
    read: Reading | None = None
    surfaces: int = 1
    loads: Peaks | None = None

    @property
    def standards(self) -> dict[str, float]:
        """Mean, standard deviation, and values by EN 1990 and EN 1090-2, of all slip loads.

        `stiction.inference.standards` has the formulas, which are from
        memory and not yet compared with the printed standards.

        The slip loads count, not the means of specimens:

        >>> loads = Peaks((0.1, 0.2), (np.array([3.0, 8.0]), np.array([4.0])), "N")
        >>> means = replace(loads, values=(np.array([5.5]), np.array([4.0])), loads=loads)
        >>> means.standards["mean"], round(loads.standards["standard deviation"] ** 2, 9)
        (5.0, 7.0)
        """
        return standards_of(np.concatenate((self.loads or self).values))

    def refuse_far(self, predicted: Sequence[Array]) -> None:
        """Refuse peaks that differ so much from predictions that their unit must be wrong.

        >>> peaks = Peaks((0.1, 0.2), (np.array([3.0, 4.0, 500.0]), np.array([60.0, 70.0])), "N")
        >>> peaks.refuse_far([np.array([0.081, 0.081]), np.array([3200.0])])
        >>> peaks.refuse_far([np.array([201.0, 199.0, 903.0]), np.array([65.0])])
        ... # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: peaks: are about 4 N, but predictions are about 201 N. ...
        >>> peaks.refuse_far([np.array([4.0]), np.array([1.2])])  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: peaks: are about 65 N, but predictions are about 1.2 N. ...
        """
        for values, predictions in zip(self.values, predicted, strict=True):
            measured, expected = np.median(values), np.median(predictions)
            if not 1.0 / MAX_PEAK_RATIO < measured / expected < MAX_PEAK_RATIO:
                raise InputError(
                    f"peaks: are about {measured:.3g} {self.unit}, but predictions are about"
                    f" {expected:.3g} {self.unit}. State the unit, as in unit='kPa' or unit='N'"
                )

    @property
    def variable(self) -> str:
        """Name of the measured quantity in results.

        >>> [Peaks((), (), unit).variable for unit in ("1", "N", "Pa")]
        ['friction_coefficient', 'critical_force', 'critical_stress']
        """
        return VARIABLES[self.unit]

    def _summary(self) -> Summary:
        """Return what is printed: peaks are counted for each length.

        >>> peaks = Peaks((None, 0.25), (np.array([3.0, 8.0]), np.array([5.0])), "N")
        >>> [(row[0], row[1]) for row in peaks._summary().rows]
        [('peak 1', 3.0), ('peak 2', 8.0), ('peak 1 at 0.25 m', 5.0)]
        """
        kinds = zip(self.lengths, self.values, strict=True)
        rows = [
            Row(f"peak {i + 1}" + (f" at {length:g} m" if length else ""), peak, (), self.unit)
            for length, values in kinds
            for i, peak in enumerate(values.tolist())
        ]
        return Summary(title_of(self), rows, notes=[str(self.read)] if self.read else [])


def title_of(peaks: Peaks) -> str:
    """Return how many peaks there are, by specimen length.

    >>> three, two = np.array([3.0, 4.0, 8.0]), np.array([5.0, 7.0])
    >>> title_of(Peaks((None, 0.25), (three, two), "N"))
    '3 peaks, 2 peaks at 0.25 m'
    >>> loads = Peaks((0.1, 0.2), (three, two), "N")
    >>> title_of(Peaks((0.1, 0.2), (two, two), "N", loads=loads))
    '2 peaks at 0.1 m, 2 peaks at 0.2 m, means of 5 slip loads'
    """
    pairs = zip(peaks.lengths, peaks.values, strict=True)
    kinds = [f"{v.size} peaks" + (f" at {length:g} m" if length else "") for length, v in pairs]
    if peaks.loads is not None:
        kinds.append(f"means of {sum(map(np.size, peaks.loads.values))} slip loads")
    return ", ".join(kinds)


def peaks_and_error(
    peaks: Any, unit: str | None, load_cell_error: float
) -> tuple[Peaks, float]:
    """Return the mean peak of each specimen, and the standard deviation of its error, in SI.

    Each specimen counts once, because its slip loads do not show how
    specimens differ. Their pooled coefficient of variation gives the
    error of a mean, computed for the harmonic mean of the numbers of
    slip loads.

    Without names of specimens, the error is the error of the load cell:

    >>> peaks, error = peaks_and_error([3.0, 4.0, 8.0], "kN", 0.2)
    >>> peaks.values[0].tolist(), error
    ([3000.0, 4000.0, 8000.0], 200.0)
    >>> peaks_and_error([3.0, 4.0, 8.0], "N", 7.0)[1], peaks_and_error(peaks, "kN", 7.0)[1]
    (7.0, 7.0)

    Two slip loads, 19 and 21, differ by 5 % from their mean, and so do 38
    and 42, on specimens with another length. Five loads and three means leave
    two degrees of freedom. The mean of 1/n is (1/2 + 1/2 + 1)/3, and the mean
    of the means is 30:

    >>> values = np.array([19.0, 30.0, 21.0]), np.array([42.0, 38.0])
    >>> names = np.array(["a", "c", "a"]), np.array(["b", "b"])
    >>> loads = Peaks((0.1, 0.2), values, "N", specimens=names)
    >>> means, error = peaks_and_error(loads, None, 0.7)
    >>> [mean.tolist() for mean in means.values], not means.specimens, means.loads is loads
    ([[20.0, 30.0], [40.0]], True, True)
    >>> of_means = math.sqrt(4 * 0.05**2 / (5 - 3) * (0.5 + 0.5 + 1.0) / 3) * 30.0
    >>> round(error - math.hypot(0.7, of_means), 12)
    0.0

    If each specimen has a single slip load, the result is as without names:

    >>> single = replace(loads, specimens=(np.array(["a", "b", "c"]), np.array(["d", "e"])))
    >>> peaks_and_error(single, None, 0.7)[1]
    0.7
    """
    measured, error = make_peaks(peaks, unit), load_cell_error * factor_of(unit, peaks)
    if error > np.concatenate(measured.values).max():
        raise InputError(
            f"load_cell_error: {error:g} {measured.unit} exceeds the largest peak. Check its unit"
        )
    if measured.specimens is None:
        return measured, error
    means, squares, shares = [], 0.0, 0.0
    for values, names in zip(measured.values, measured.specimens, strict=True):
        _, of, counts = np.unique(names, return_inverse=True, return_counts=True)
        means.append(np.bincount(of, values) / counts)
        squares += float(np.sum((values / means[-1][of] - 1.0) ** 2))
        shares += float(np.sum(1.0 / counts))
    total, loads = np.concatenate(means), sum(map(np.size, measured.values))
    if loads == total.size:
        return measured, error
    repeated = math.sqrt(squares / (loads - total.size) * shares / total.size) * total.mean()
    of_specimens = replace(measured, values=tuple(means), specimens=None, loads=measured)
    return of_specimens, math.hypot(error, repeated)


def make_peaks(peaks: Any, unit: str | None = None) -> Peaks:
    """Return valid peaks, given an array, a mapping from lengths to arrays, a table or curves.

    >>> peaks = make_peaks({0.1: [3.0, 4.0], 0.2: [5.0, 3.0, 4.0]}, "kN")
    >>> peaks.lengths, [values.tolist() for values in peaks.values], peaks.unit
    ((0.1, 0.2), [[3000.0, 4000.0], [5000.0, 3000.0, 4000.0]], 'N')
    >>> make_peaks(peaks) is peaks
    True
    >>> import pandas
    >>> table = pandas.DataFrame({"specimen": [1, 2, 3], "peak [MPa]": [0.5, 0.7, 0.6]})
    >>> make_peaks(table).values[0].tolist(), make_peaks(table).unit
    ([500000.0, 700000.0, 600000.0], 'Pa')
    """
    if isinstance(peaks, Peaks):
        return peaks
    if isinstance(peaks, Curves):
        return make_peaks(peaks.peaks, peaks.unit)
    if hasattr(peaks, "columns") and hasattr(peaks, "to_xarray"):
        with prefixed("peaks"):
            return _of_table(table_of_frame(peaks), Options())
    # Lengths may be quantities with a unit.
    groups: dict[Any, Any] = dict(peaks) if isinstance(peaks, Mapping) else {None: peaks}
    groups = {magnitude_in_one_of(key, ["m"])[0]: values for key, values in groups.items()}
    if not all(key is None or (is_finite(key) and key > 0.0) for key in groups):
        raise InputError(
            "peaks: the keys of a mapping must be lengths (m), such as {0.1: [...], 0.2: [...]},"
            f" got {describe(list(groups))}"
        )
    lengths = tuple(None if length is None else float(length) for length in groups)
    values, units = zip(*(_in_si(given, unit) for given in groups.values()), strict=True)
    different = np.unique(np.concatenate([np.zeros(0), *values])).size
    if different < MIN_PEAKS:
        raise InputError(
            f"peaks: at least {MIN_PEAKS} different values are needed, got {different}. Test more"
            " specimens, or pass the fit of profiles alone to st.design_stress"
        )
    if len({*units}) > 1:
        raise InputError(f"peaks: must be in one unit, got {' and '.join(sorted({*units}))}")
    return Peaks(lengths, values, units[0])


def si_of(unit: str) -> str:
    """Return the SI unit for a unit: "1", "N", or otherwise "Pa".

    >>> [si_of(unit) for unit in ("kN", "MPa", "-", "%", "nonsense")]
    ['N', 'Pa', '1', '1', 'Pa']
    """
    return next((one for one in VARIABLES if is_in(unit, one)), "Pa")


def factor_of(unit: str | None, peaks: Any = None) -> float:
    """Return the factor that converts a unit of peaks to SI, or 1 for peaks in SI.

    >>> factor_of("kN"), factor_of("MPa"), factor_of("%"), factor_of(None)
    (1000.0, 1000000.0, 0.01, 1.0)
    >>> factor_of("kN", Peaks((), (), "N"))  # already in SI
    1.0
    """
    if unit is None or isinstance(peaks, Peaks | Curves):
        return 1.0
    with prefixed("unit"):
        return conversion(unit, (si_of(unit),))[0]


def _in_si(given: Any, unit: str | None) -> tuple[Array, str]:
    """Return peaks for a specimen type in SI, and this unit, stated by the values or given.

    >>> values, unit = _in_si([0.5, 2.0], "kPa")
    >>> values.tolist(), unit
    ([500.0, 2000.0], 'Pa')
    >>> import xarray as xr
    >>> in_kn = xr.DataArray([0.5, 2.0], attrs={"units": "kN"})
    >>> _in_si(in_kn, None)[0].tolist(), _in_si(in_kn, "N")[0].tolist(), _in_si(in_kn, "N")[1]
    ([500.0, 2000.0], [500.0, 2000.0], 'N')
    """
    with prefixed("peaks"):
        numbers, stated = with_stated_unit(given, VARIABLES)
    if not (stated or unit):
        raise InputError(
            "unit: is missing. Peaks are stresses, forces or coefficients of friction. Pass their"
            " unit, such as unit='MPa', unit='kN' or unit='1'"
        )
    if stated and unit and si_of(stated) != si_of(unit):
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
    known = stated or unit or ""
    return values * factor_of(known), si_of(known)


@checked
def read_peaks(
    source: FilePath,
    *,
    value: Wanted = None,
    unit: str | None = None,
    normal: Positive | str | None = None,
    surfaces: Count = 1,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
) -> Peaks:
    """Read the peaks of repeated tests from a text file or a workbook (.xlsx).

    A column is read if its heading, or the caller, says that it is the
    wanted quantity. If several columns could be the quantity, an error
    lists them. First plot the peaks in the order of the tests. Peaks
    that drift are not a sample from one distribution.

    Parameters
    ----------
    source : path
        A table with a heading and one test in each line. Rows of
        statistics below the tests (mean, SD, n) are left out. A column
        ``specimen`` may hold the whole number or name of the specimen, and a
        column ``length [mm]`` its length.
    value : str or int, optional
        Column of the peaks: heading, name, or number from 0. By default
        it is the column whose heading says friction, shear, slip load,
        peak, COF, mu, Reibkraft, ... or the only column with numbers
        besides specimens, times and lengths.
    unit : str, optional
        Unit for the peaks if the file does not state it. Forces are in N
        or kN, friction coefficients in 1 or -.
    normal : str or float, optional
        Column of the normal force (or normal stress) of each test, or a
        number for all tests (N or Pa). The result then holds friction
        coefficients, and keeps the forces.
    surfaces : int
        Number of friction surfaces that carry the force together.
    missing, decimal, skip, sheet
        As in `stiction.read_profile`. Tests without a peak are left out.

    Returns
    -------
    Peaks
        For `stiction.infer`. Printing shows what was read.

    Raises
    ------
    InputError
        If a unit is missing or unknown, columns are ambiguous, a number
        is missing, there are fewer than three specimens, the slip
        factors are not between 0.05 and 1, a last row without a name
        holds the mean or the deviation of the tests, or the file is the
        curve of one test.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import stiction as st
    >>> path = Path(tempfile.mkdtemp()) / "peaks.csv"
    >>> _ = path.write_text("test, peak [MPa]\\n1, 0.71\\n2, 0.69\\n3, 0.74\\n")
    >>> st.read_peaks(path).read.column
    "column 1 'peak [MPa]'"
    """
    options = Options(skip, sheet, missing, decimal)
    with prefixed(str(source)):
        return _of_table(
            read_table(Path(source), options), options, value, unit, normal, surfaces
        )


def _of_table(
    table: Table, options: Options, value: Wanted = None, unit: str | None = None,
    normal: float | str | None = None, surfaces: int = 1,
) -> Peaks:  # fmt: skip
    """Return the peaks in a table of tests.

    Specimens, their lengths (mm), and loads that two surfaces carry:

    >>> from stiction.problem.reading.tables import Options
    >>> def read(lines, *given, **options):
    ...     import pathlib, tempfile
    ...     path = pathlib.Path(tempfile.mkdtemp()) / "tests.csv"
    ...     _ = path.write_text(lines.replace("|", chr(10)))
    ...     known = {"missing": None, "decimal": None} | options
    ...     options = Options(0, 0, known["missing"], known["decimal"])
    ...     return _of_table(read_table(path, options), options, *given)
    >>> peaks = read("specimen, length [mm], shear force [kN], clamping force [kN]|"
    ...              "1, 200, 8, 10|1, 200, 9, 10|2, 100, 6, 10|3, 200, 4, 5", None, None,
    ...              "clamping force", 2)
    >>> peaks.lengths, [values.round(3).tolist() for values in peaks.values], peaks.unit
    ((0.1, 0.2), [[0.3], [0.4, 0.45, 0.4]], '1')
    >>> [forces.tolist() for forces in peaks.normal_forces], peaks.surfaces
    ([[10000.0], [10000.0, 10000.0, 5000.0]], 2)
    >>> [names.tolist() for names in peaks.specimens]
    [['2'], ['1', '1', '3']]

    An empty cell, if stated, marks a test without a peak, whose force is left
    out too.
    Letters behind the numbers count the slip loads of a specimen:

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     peaks = read("specimen;slip load (kN);load (kN)|1A;8;10|1B;;9|2-A;6;8|2 b;7;12|3A;4;5",
    ...                  None, None, "load", missing=("",))
    >>> peaks.normal_forces[0].tolist(), peaks.specimens[0].tolist(), len(caught)
    ([10000.0, 8000.0, 12000.0, 5000.0], ['1', '2', '2', '3'], 1)

    The lengths of tests without a peak are left out as well. Here the peaks
    are in N:

    >>> peaks = read("specimen length (cm);specimen;peak|30;a;8|20;b;x|20;c;6|30;d;5", None, "N",
    ...              missing=("x",))
    >>> peaks.lengths, [values.tolist() for values in peaks.values]
    ((0.2, 0.3), [[6.0], [8.0, 5.0]])
    >>> [names.tolist() for names in peaks.specimens], peaks.read.unit
    ([['c'], ['a', 'd']], 'N, which is assumed')

    Names that all differ without their letters are the names of specimens:

    >>> peaks = read("specimen;slip load (kN)|1A;8|2B;7|3A;4")
    >>> peaks.specimens[0].tolist(), peaks.read.unit
    (['1A', '2B', '3A'], 'kN')

    A number is the normal force of each test. Two specimens are too few:

    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore")
    ...     read("slip load (kN)|2|3|5", None, None, 1e4).values[0].tolist()
    [0.2, 0.3, 0.5]
    >>> read("specimen;slip load (kN)|1;8|2;7|2;4", None, None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: holds 2 specimens in column 0 'specimen', but at least ...
    >>> read("specimen;slip load (kN)|1;8|2.5;7|3;4", None, None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ... must be whole, got 2.5 in line 3. Are columns swapped?
    >>> read("slip load (kN)|8|7|4", None, None, None, 2)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: surfaces: needs normal=, the normal force. ...

    A long column of times that only rises belongs to a curve:

    >>> rows = "|".join(f"{n // 2};{2 + n % 3}" for n in range(100))
    >>> read("time (s);force (kN)|" + rows)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: 'time (s)' only rises, as in the curve of a test. ...
    >>> read("time (s);force (kN)|" + rows.rpartition("|")[0]).values[0].size
    99
    >>> read("test;force (kN)|" + rows).values[0].size
    100
    >>> read("peak (kN)|3.1|4.2|5.4||4.2")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: line 6 holds the mean or the deviation of the tests ...
    """
    if table.begins:
        raise InputError(several_tables(table))
    columns = table.columns
    of_specimens = named(columns, SPECIMEN_NAMES)
    lengths = [c for c in columns if role_of(c) == "length"]
    lengths += [c for c in of_specimens if is_in(c.unit, "m") and c not in lengths]
    names = [c for c in of_specimens if c not in lengths and role_of(c) == "specimen"]
    if len(lengths) > 1 or len(names) > 1:
        raise InputError(unclear(columns, "specimen or its length", "value", lengths + names))
    kinds = {"length": lengths, "specimen": names}
    used = {kind: group[0] for kind, group in kinds.items() if group}
    if isinstance(normal, str):
        used["normal force"] = stated_column(columns, "normal", normal)
    left = [c for c in columns if c not in (*lengths, *names, used.get("normal force"))]
    peak = read_column(left, "peak", "value", value, VARIABLES)
    for column in columns:
        timed = column.unit and column.may_be_in("m", "s")
        long = column not in (peak, *used.values()) and column.values.size >= MIN_CURVE_LINES
        if timed and long and np.all(np.diff(column.values) >= 0):
            raise InputError(
                f"{column.label!r} only rises, as in the curve of a test. Call st.read_curve"
            )
    _refuse_statistics(table, peak)
    for column in (*names, *columns[:1]):
        numbers = role_of(column) == "specimen" and not (column.text or column.unit)
        if numbers and (part := column.values % 1.0 > 0.0).any():
            raise InputError(
                f"{column.label!r}: numbers of specimens must be whole, got"
                f" {column.values[part][0]:g} in line {table.lines[part][0]}. Are columns swapped?"
            )
    known = replace(peak, values=without_missing(peak.values, options))
    values, si = column_in_si(known, "peak", unit, VARIABLES, "unit")
    # A stated word or number marks a test without a peak. Any other NaN
    # is a mistake.
    kept = ~np.isnan(values) if options.missing is not None else np.ones(values.size, np.bool_)
    values, forces = values[kept], None
    if normal is not None:
        forces = _normal_forces(used.get("normal force"), normal, si, table, options)[kept]
        values, si = _coefficients(values, forces, si, surfaces), "1"
    elif surfaces != 1:
        raise InputError("surfaces: needs normal=, the normal force. Pass both or neither")
    labels: Array | None = None
    if names:
        labels = np.array(names[0].cells or [f"{n:g}" for n in names[0].values])[kept]
        if (missing := np.isin(labels, ["", "nan"])).any():
            raise InputError(
                f"{names[0].label!r}: has no specimen in line {table.lines[kept][missing][0]}. Give"
                " the number or name of each specimen"
            )
        stems = [part[1] for name in labels if (part := PART.fullmatch(str(name)))]
        if len(stems) == labels.size and len({*stems}) < len({*labels}):
            warn_accuracy(
                f"{names[0].label!r}: {labels[0]}, {labels[1]}, ... are read as slip loads of"
                f" specimens {', '.join(dict.fromkeys(stems))}. If this is wrong, number specimens"
            )
            labels = np.array(stems)
        if (count := len({*labels})) < MIN_PEAKS:
            raise InputError(
                f"holds {count} specimens in {names[0]}, but at least {MIN_PEAKS} are needed."
                " Repeated tests of a specimen say nothing about other specimens"
            )
    elif normal is not None:
        warn_accuracy(
            "no column says which specimen was tested, so each slip load counts as a specimen."
            " Repeated slip loads of a specimen need a column 'specimen'"
        )
    groups: dict[Any, Any] = {None: slice(None)}
    if lengths:
        sizes = column_in_si(lengths[0], "length", None, ("m",))[0][kept]
        if np.isnan(sizes).any():
            line = table.lines[kept][np.isnan(sizes).argmax()]
            raise InputError(f"length: is missing in line {line}. Give each specimen a length")
        groups = {size: sizes == size for size in np.unique(sizes)}
    made = make_peaks({size: values[rows] for size, rows in groups.items()}, si)
    return replace(
        made, read=reading_of(table, peak, unit or si, used), surfaces=int(surfaces),
        normal_forces=None if forces is None else tuple(forces[rows] for rows in groups.values()),
        specimens=None if labels is None else tuple(labels[rows] for rows in groups.values()),
    )  # fmt: skip


def _refuse_statistics(table: Table, peak: Column) -> None:
    """Refuse a last row, apart from the tests, that holds the mean or deviation of the tests.

    A row is apart if it has no number of a specimen, or if no column
    numbers the specimens and the row follows an empty line.

    The mean of 3.1, 4.2 and 5.4 is 4.233, and their deviation is 1.150. The
    last value is printed with one digit, and follows an empty line:

    >>> def refused(*values, lines=(2, 3, 4, 6, 7, 8, 9), cells=()):
    ...     columns = [Column("peak", "N", np.array(values), 1)]
    ...     if cells:
    ...         columns.insert(0, Column("specimen", "", np.zeros(len(values)), 0, cells=cells))
    ...     table = Table(tuple(columns), "", np.array(lines[:len(values)]))
    ...     try:
    ...         _refuse_statistics(table, columns[-1])
    ...     except InputError as error:
    ...         return str(error)[:15]
    >>> [refused(3.1, 4.2, 5.4, last) is not None for last in (4.1, 4.2, 4.3, 1.1, 1.2)]
    [False, True, False, False, True]
    >>> refused(3.1, 4.2, 5.4, 4.2)
    'line 6 holds th'
    >>> refused(3.1, 4.2, 5.4, 4.2, lines=(2, 3, 4, 5))  # no empty line
    >>> refused(3.1, 4.2, 4.2, 4.23)  # not their mean, 3.83
    >>> refused(3.1, 5.4, 4.2, lines=(2, 3, 5))  # two tests only
    >>> refused(3.15, 4.2, 5.4, 4.2)  # the mean would be printed as 4.25

    Missing peaks do not count. At most four rows are apart:

    >>> [refused(3.1, np.nan, 4.2, 5.4, *last, lines=(2, 3, 4, 5, 7, 8, 9, 10, 11))
    ...  for last in ([4.2, 8.0, 8.1, 8.2], [4.2, 8.0, 8.1, 8.2, 8.3])]
    ['line 7 holds th', None]

    Only a row without a number is apart if a column numbers the specimens:

    >>> [refused(3.1, 4.2, 5.4, 4.2, cells=("1", "2", "3", cell)) for cell in ("4", "", "nan")]
    [None, 'line 6 holds th', 'line 6 holds th']
    """
    values, first = peak.values, table.columns[0]
    apart = np.diff(table.lines, prepend=table.lines[:1]) > 1
    if role_of(first) == "specimen":
        apart = np.array([str(cell) in ("", "nan") for cell in first.cells or first.values])
    known = values[np.isfinite(values)].tolist()
    digits = [-int(Decimal(f"{value:.12g}").as_tuple().exponent) for value in known]
    for row in np.flatnonzero(apart):
        tests = values[:row][np.isfinite(values[:row])]
        if tests.size < MIN_PEAKS or values.size - row > MAX_STATISTICS:
            continue
        away = np.abs(values[row] - [tests.mean(), tests.std(ddof=1)])
        if away.min() <= 0.5001 * 10.0 ** -max(digits):
            raise InputError(
                f"line {table.lines[row]} holds the mean or the deviation of the tests above,"
                f" {values[row]:g}. Write 'mean' or 'SD' in front of this value, or delete the"
                " line. If it is a test, give the number of its specimen, or remove the empty line"
            )


def _normal_forces(
    column: Column | None, given: Any, si: str, table: Table, options: Options
) -> Array:
    """Return the normal force (or stress) of each test, in the unit of the peaks.

    >>> table = Table((), "", np.array([2, 3, 5]))
    >>> column = Column("preload", "kN", np.array([2.0, 3.0, 7.0]), 1, "preload [kN]")
    >>> _normal_forces(column, "preload", "N", table, Options()).tolist()
    [2000.0, 3000.0, 7000.0]
    >>> _normal_forces(None, 40, "N", table, Options()).tolist()
    [40.0, 40.0, 40.0]
    >>> lacking = replace(column, values=np.array([2.0, 0.0, -7.0]))
    >>> _normal_forces(lacking, "preload", "N", table, Options())  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: normal: 'preload [kN]' ...in line 3 (2 such tests). ...
    >>> _normal_forces(None, 40, "1", table, Options())
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: normal: the peaks are coefficients already. Leave normal out
    """
    if si == "1":
        raise InputError("normal: the peaks are coefficients already. Leave normal out")
    if column is None:
        return np.full(table.lines.size, float(given))
    values = without_missing(column.values, options)
    forces, _ = column_in_si(replace(column, values=values), "normal force", None, (si,))
    if (missing := np.flatnonzero(~(forces > 0.0))).size:
        raise InputError(
            f"normal: {column.label!r} has no positive force in line {table.lines[missing[0]]}"
            f" ({missing.size} such tests). Remove these tests, or give their forces"
        )
    return forces


def _coefficients(values: Array, forces: Array, si: str, surfaces: int) -> Array:
    """Return friction coefficients, and refuse coefficients as from swapped columns or units.

    >>> forces = np.array([10.0, 20.0, 10.0])
    >>> _coefficients(np.array([6.0, 8.0, 9.0]), forces, "N", 2).tolist()
    [0.3, 0.2, 0.45]
    >>> _coefficients(np.array([1.0, 2.0, 0.5]), forces, "N", 2).tolist()  # the least median
    [0.05, 0.05, 0.025]
    >>> _coefficients(forces, np.array([6.0, 8.0, 9.0]), "N", 1)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: normal: the median friction coefficient would be 1.67, from ...
    >>> _coefficients(np.array([0.9, 2.0, 0.5]), forces, "Pa", 2)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: normal: the median friction coefficient would be 0.045, ...
    """
    coefficients = values / (surfaces * forces)
    typical = float(np.median(coefficients))
    if not SLIP_FACTORS[0] <= typical <= SLIP_FACTORS[1]:
        raise InputError(
            f"normal: the median friction coefficient would be {typical:.3g}, from"
            f" {np.median(values):.4g} {si} over {surfaces} times {np.median(forces):.4g} {si}."
            f" Slip factors lie between {SLIP_FACTORS[0]:g} and {SLIP_FACTORS[1]:g}. Check the"
            " order of the two columns, their units, and surfaces="
        )
    return coefficients
