"""Measured peaks: validated, in SI units, one array for each kind of specimen."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, prefixed
from stiction.model import FilePath, Numbers, check, describe, is_finite
from stiction.profiles.tables import read_table
from stiction.profiles.units import factor_to, is_in

FEWEST = 3
"""Fewest peaks in all: of two numbers, one may be a mistake."""
PEAK = ("peak", "tau", "stress", "strength", "force", "friction")
LENGTH = ("length", "specimen")


class Peaks(NamedTuple):
    """Peaks of repeated tests, by the length of the specimens.

    Attributes
    ----------
    lengths : tuple of float or None
        Length of each kind of specimen, m; None for that of the problem.
    values : tuple of arrays
        Peaks of each kind: Pa, or coefficients of friction.
    coefficients : bool
        Whether the peaks are coefficients of friction.
    """

    lengths: tuple[float | None, ...]
    values: tuple[Array, ...]
    coefficients: bool

    @property
    def variable(self) -> str:
        """Name of the measured quantity among the results of a method."""
        return "friction_coefficient" if self.coefficients else "critical_stress"

    def __str__(self) -> str:
        kinds = [
            f"{values.size} peaks{'' if length is None else f' at {length:g} m'}"
            for length, values in zip(self.lengths, self.values, strict=True)
        ]
        return ", ".join(kinds)


def make_peaks(peaks: Any, unit: str = "Pa") -> Peaks:
    """Validate an array, or a mapping of arrays by length; `Peaks` are returned as they are.

    Raises
    ------
    InputError
        Naming all that is wrong.
    """
    if isinstance(peaks, Peaks):
        return peaks
    factor = _factor(unit)
    groups: dict[Any, Any] = dict(peaks) if isinstance(peaks, Mapping) else {None: peaks}
    if not all(key is None or (is_finite(key) and key > 0.0) for key in groups):
        raise InputError(
            "peaks: for several specimens, map each length (m) to its peaks, such"
            f" as {{0.1: [...], 0.2: [...]}}, got the lengths {describe(list(groups))}"
        )
    problems: list[str] = []
    values = []
    for length, given in groups.items():
        name = "peaks" if length is None else f"peaks at {length:g} m"
        try:
            values.append(factor * _values(name, given, unit))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    every = np.concatenate([np.zeros(0), *values])
    if every.size < FEWEST or np.ptp(every) == 0.0:
        raise InputError(
            f"peaks: at least {FEWEST} different values are needed, got"
            f" {np.unique(every).size} in {every.size} peaks; fewer than about ten"
            " constrain little: see st.design_of_tests"
        )
    lengths = tuple(None if length is None else float(length) for length in groups)
    return Peaks(lengths, tuple(values), is_in(unit, "1"))


def _factor(unit: str) -> float:
    """Return the factor from a unit of stress, or of a pure number, to SI."""
    try:
        return factor_to("1" if is_in(unit, "1") else "Pa", unit)
    except InputError as error:
        raise InputError(
            f"unit: {error}; divide a force by the area of the interface, or by the normal force"
            " for a coefficient of friction (unit = '1')"
        ) from None


def _values(name: str, given: Any, unit: str) -> Array:
    """Return the peaks of one kind of specimen, in `unit`."""
    ragged = isinstance(given, list | tuple) and any(np.ndim(one) for one in given)
    values = (
        np.empty((0, 0)) if ragged else check(name, getattr(given, "values", given), Numbers)
    )
    if values.ndim != 1:
        raise InputError(
            f"{name}: must be one list of numbers for one kind of specimen, got {describe(given)};"
            " for several, map each length (m) to its peaks: {0.1: [...], 0.2: [...]}"
        )
    bad = np.flatnonzero(~(values > 0.0) | np.isinf(values))
    if bad.size:
        raise InputError(
            f"{name}: must be positive numbers; number {bad[0]} is {values[bad[0]]:g}; leave out"
            " tests that gave no peak"
        )
    stated = str(getattr(given, "attrs", {}).get("units", unit))
    if is_in(stated, "1") != is_in(unit, "1"):
        raise InputError(f"{name}: are in {stated}, but unit = {unit!r}")
    return values * (_factor(stated) / _factor(unit))


def read_peaks(path: str | Path, *, unit: str | None = None) -> Peaks:
    """Read the peaks of repeated tests from a text file.

    Parameters
    ----------
    path : path
        A table, separated by commas, semicolons, tabs or blanks, one test a line, with a heading.
        One column is called peak, stress, strength or friction, with its unit: ``peak [MPa]``; a
        coefficient of friction has the unit 1 or -. Another may be the length of the specimen:
        ``length [mm]``. Columns of other names are not read.
    unit : str, optional
        Unit of the peaks if the file states none.

    Returns
    -------
    Peaks
        For `stiction.infer`.

    Raises
    ------
    InputError
        If a unit is missing or unknown, columns are ambiguous, or a number is missing.

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
    path = check("path", path, FilePath)
    with prefixed(str(path)):
        return _from_table(read_table(Path(path)), unit)


def _from_table(table: Any, unit: str | None) -> Peaks:
    names = list(table.data_vars)
    peak, length = _column(names, PEAK), _column(names, LENGTH)
    if peak is None and len(names) == 1:
        peak = names[0]
    if peak is None:
        raise InputError(f"no column has a name like 'peak [MPa]'; found {', '.join(names)}")
    stated = table[peak].attrs.get("units", unit)
    if stated is None:
        raise InputError(
            "the unit of the peaks is not stated; write it into the heading, 'peak [MPa]', or give"
            " unit="
        )
    if unit is not None and unit != stated:
        raise InputError(f"the heading gives the peaks in {stated}, but unit = {unit!r}")
    values = table[peak].values
    if length is None:
        return make_peaks(values, stated)
    if "units" not in table[length].attrs:
        raise InputError("the unit of the length is not stated; write 'length [mm]'")
    lengths = table[length].values * factor_to("m", table[length].attrs["units"])
    if not np.isfinite(lengths).all():
        line = int(np.argmin(np.isfinite(lengths)))
        raise InputError(
            f"length: missing in row {line}; specimens of unknown length are mixed in"
        )
    return make_peaks({one: values[lengths == one] for one in np.unique(lengths)}, stated)


def _column(names: Sequence[str], kinds: tuple[str, ...]) -> str | None:
    """Return the one column whose name begins with one of some words."""
    words = [(name, name.lower().split()) for name in names]
    found = [name for name, word in words if word and word[0].strip("_:.") in kinds]
    if len(found) > 1:
        both = " and ".join(map(repr, found))
        raise InputError(f"{both} may both be the {kinds[0]}; rename one")
    return found[0] if found else None
