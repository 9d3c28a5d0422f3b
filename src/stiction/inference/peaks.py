"""Measured peaks: checked, in SI units, one array for each kind of specimen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stiction._checks import as_path, is_finite, numbers
from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import describe
from stiction.profile_files import decoded
from stiction.profile_text import read_table
from stiction.units import factor_to, parse

FEWEST = 3
"""Peaks in all; two numbers tell neither a spread nor a mistake."""
PEAK = ("peak", "tau", "stress", "strength", "force", "friction")
LENGTH = ("length", "specimen")
POSITION = ("position", "place", "x")


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peaks of repeated tests, by the length of the specimens.

    Attributes
    ----------
    lengths : tuple of float or None
        m, one for each kind of specimen; None for that of the problem.
    values : tuple of arrays
        Peaks of each kind: Pa, or coefficients of friction.
    positions : tuple of arrays or None
        Where slip began, m, NaN where it was not seen; None for a kind where none was.
    coefficients : bool
        Whether the peaks are coefficients of friction.
    """

    lengths: tuple[float | None, ...]
    values: tuple[Array, ...]
    positions: tuple[Array | None, ...]
    coefficients: bool

    @property
    def count(self) -> int:
        """Number of peaks in all."""
        return sum(values.size for values in self.values)

    @property
    def variable(self) -> str:
        """Name of what was measured among the results of a method."""
        return "friction_coefficient" if self.coefficients else "critical_stress"

    def __str__(self) -> str:
        kinds = [
            f"{values.size} peaks{'' if length is None else f' at {length:g} m'}"
            for length, values in zip(self.lengths, self.values, strict=True)
        ]
        return ", ".join(kinds)


def make_peaks(peaks: Any, positions: Any = None, unit: str = "Pa") -> Peaks:
    """Checked peaks from an array, a mapping of arrays by length, or `Peaks` as they are.

    Raises
    ------
    InputError
        Naming all that is wrong.
    """
    if isinstance(peaks, Peaks):
        if positions is not None:
            raise InputError("positions: are given with the peaks already; leave them out")
        return peaks
    factor, coefficients = _unit(unit)
    if isinstance(peaks, Mapping):
        groups = dict(peaks)
        wrong = [key for key in groups if not (is_finite(key) and key > 0.0)]
        if wrong or not groups:
            raise InputError(
                "peaks: of several specimens must map each length (m) to its peaks, such as"
                f" {{0.1: [...], 0.2: [...]}}, got the lengths {describe(list(groups))}"
            )
        where: dict[Any, Any] = dict.fromkeys(groups) if positions is None else positions
        if not isinstance(where, Mapping) or set(where) - set(groups):
            raise InputError("positions: must map the same lengths to positions as the peaks do")
    else:
        groups, where = {None: peaks}, {None: positions}
    problems: list[str] = []
    values, places = [], []
    for length, given in groups.items():
        name = "peaks" if length is None else f"peaks at {length:g} m"
        try:
            values.append(_values(name, given, factor, unit))
            places.append(_places(where.get(length), values[-1].size, name))
        except InputError as error:
            problems += error.problems
    if not problems:
        problems = _doubtful(np.concatenate(values), coefficients)
    if problems:
        raise InputError(problems)
    lengths = tuple(None if length is None else float(length) for length in groups)
    return Peaks(lengths, tuple(values), tuple(places), coefficients)


def _unit(unit: Any) -> tuple[float, bool]:
    """Factor to SI, and whether it is a pure number."""
    if not isinstance(unit, str):
        raise InputError(f"unit: must be text such as 'MPa' or '1', got {describe(unit)}")
    known = parse(unit)
    if known is not None and known.dimension == (0, 0, 0):
        return known.factor, True
    if known is not None and known.dimension == (1, 1, -2):
        raise InputError(
            f"unit: peaks are in {unit}, a force; divide by the area of the interface and give a"
            " stress, or by the normal force and give a coefficient of friction (unit = '1')"
        )
    try:
        return factor_to("Pa", unit), False
    except InputError as error:
        raise InputError([f"unit: {text}" for text in error.problems]) from None


def _values(name: str, given: Any, factor: float, unit: str) -> Array:
    stated = getattr(given, "attrs", {}).get("units")
    if stated is not None:
        own, coefficient = _unit(str(stated))
        if coefficient != _unit(unit)[1]:
            raise InputError(f"{name}: are in {stated}, but unit = {unit!r}")
        factor = own
    ragged = isinstance(given, list | tuple) and any(np.ndim(one) for one in given)
    values = numbers(name, getattr(given, "values", given)) if not ragged else np.empty((0, 0))
    if values.ndim != 1:
        raise InputError(
            f"{name}: must be one list of numbers for one kind of specimen, got"
            f" {describe(given)}; of several specimens map each length (m) to its peaks:"
            " {0.1: [...], 0.2: [...]}"
        )
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"{name}: number {bad[0]} is {values[bad[0]]:g}"
            f"{f', and {bad.size - 1} more' if bad.size > 1 else ''}; leave out tests that gave no"
            " peak, and count them"
        )
    if values.size and values.min() <= 0.0:
        raise InputError(
            f"{name}: must be positive, number {int(values.argmin())} is {values.min():g}"
        )
    if not values.size:
        raise InputError(f"{name}: are none")
    return values * factor


def _places(given: Any, count: int, name: str) -> Array | None:
    if given is None:
        return None
    places = numbers("positions", getattr(given, "values", given))
    if places.shape != (count,):
        raise InputError(
            f"positions: must be one for each of the {count} {name} (nan where it was not seen),"
            f" got shape {places.shape}"
        )
    if np.isinf(places).any():
        raise InputError("positions: must be finite, or nan where slip was not seen")
    return None if np.isnan(places).all() else places


def _doubtful(values: Array, coefficients: bool) -> list[str]:
    if values.size < FEWEST:
        return [
            f"peaks: are {values.size}; at least {FEWEST} are needed, and fewer than about ten tell"
            " little: see st.design_of_tests"
        ]
    if np.ptp(values) == 0.0:
        return [
            f"peaks: are all {values[0]:g}; tests scatter, so digits were lost or one test was"
            " written down many times"
        ]
    if coefficients and np.median(values) > 50.0:
        return [f"peaks: coefficients of friction of {np.median(values):g}? give their unit"]
    return []


def read_peaks(path: str | Path, *, unit: str | None = None) -> Peaks:
    """Peaks of repeated tests from a text file.

    Parameters
    ----------
    path : path
        A table, separated by commas, semicolons, tabs or blanks, one test a line, with a heading.
        One column is called peak, stress, strength or friction, with its unit: ``peak [MPa]``; a
        coefficient of friction has the unit 1 or -. Others may be length, of the specimen, and
        position, where slip began, empty where it was not seen: ``length [mm]``,
        ``position [mm]``. Columns of other names are not read.
    unit : str, optional
        Of the peaks, where the file states none.

    Returns
    -------
    Peaks
        For `stiction.infer`.

    Raises
    ------
    InputError
        If a unit is missing or unknown, columns cannot be told apart, or a number is missing.

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
    path = as_path("path", path)
    try:
        table = read_table(decoded(path))
    except InputError as error:
        raise InputError([f"{path}: {text}" for text in error.problems]) from None
    peak = _column(path, table.names, PEAK, "peak")
    if peak is None and table.columns.shape[0] == 1:
        peak = 0
    if peak is None:
        found = ", ".join(str(name) for name in table.names)
        raise InputError(f"{path}: no column is called peak [MPa] or the like; found {found}")
    stated = table.units[peak] or unit
    if stated is None:
        raise InputError(
            f"{path}: the unit of the peaks is not stated; write it into the heading, 'peak [MPa]',"
            " or give unit="
        )
    if unit is not None and unit != stated:
        raise InputError(f"{path}: the peaks are in {stated} by the heading, but unit = {unit!r}")
    metres = {
        name: _metres(path, table, name, kinds)
        for name, kinds in (("length", LENGTH), ("position", POSITION))
    }
    values, lengths, places = table.columns[peak], metres["length"], metres["position"]
    try:
        if lengths is None:
            return make_peaks(values, places, stated)
        if not np.isfinite(lengths).all():
            line = int(np.argmin(np.isfinite(lengths)))
            raise InputError(
                f"length: missing in row {line}; specimens of unknown length are mixed in"
            )
        own = {float(one): lengths == one for one in np.unique(lengths)}
        return make_peaks(
            {length: values[rows] for length, rows in own.items()},
            None if places is None else {length: places[rows] for length, rows in own.items()},
            stated,
        )
    except InputError as error:
        raise InputError([f"{path}: {text}" for text in error.problems]) from None


def _column(path: Path, names: Any, kinds: tuple[str, ...], what: str) -> int | None:
    """The one column whose name begins with one of some words."""
    words = [str(name or "").lower().split() for name in names]
    found = [i for i, word in enumerate(words) if word and word[0].strip("_:.") in kinds]
    if len(found) > 1:
        both = " and ".join(repr(names[i]) for i in found)
        raise InputError(f"{path}: {both} may both be the {what}; rename one")
    return found[0] if found else None


def _metres(path: Path, table: Any, name: str, kinds: tuple[str, ...]) -> Array | None:
    column = _column(path, table.names, kinds, name)
    if column is None:
        return None
    stated = table.units[column]
    if stated is None:
        raise InputError(f"{path}: the unit of the {name} is not stated; write '{name} [mm]'")
    try:
        values: Array = table.columns[column] * factor_to("m", stated)
    except InputError as error:
        raise InputError([f"{path}: {name}: {text}" for text in error.problems]) from None
    return values
