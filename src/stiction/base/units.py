"""Numbers and units of measured data, their factors to SI, and quantities from other packages.

A unit is read from its text, and no unit is
guessed. The page `docs/guide/reading-data.md`
has a table of the values that users may pass.
"""

import math
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import AccuracyWarning, InputError, UnitWarning, prefixed, warn_user
from stiction.base.variables import OF_THE_FIELD, QUANTITIES, UNITS


class Unit(NamedTuple):
    """A unit: its factor to SI, and its powers of kilogram, metre and second."""

    factor: float
    powers: tuple[int, ...]


_LENGTH, _STRESS = (0, 1, 0), (1, -1, -2)
_BASE = {
    "m": Unit(1.0, _LENGTH),
    "s": Unit(1.0, (0, 0, 1)),
    "N": Unit(1.0, (1, 1, -2)),
    "J": Unit(1.0, (1, 2, -2)),
    "Pa": Unit(1.0, _STRESS),
    "bar": Unit(1e5, _STRESS),
    "g": Unit(1e-3, (1, 0, 0)),
}
_PREFIXES = {
    "": 1.0, "T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "m": 1e-3, "u": 1e-6,
    "\N{MICRO SIGN}": 1e-6, "\N{GREEK SMALL LETTER MU}": 1e-6, "n": 1e-9,
}  # fmt: skip
_KNOWN = {
    prefix + symbol: Unit(scale * unit.factor, unit.powers)
    for prefix, scale in _PREFIXES.items()
    for symbol, unit in _BASE.items()
} | {
    "\N{ANGSTROM SIGN}": Unit(1e-10, _LENGTH),
    "\N{LATIN CAPITAL LETTER A WITH RING ABOVE}": Unit(1e-10, _LENGTH),
    "1": Unit(1.0, (0, 0, 0)),
    "-": Unit(1.0, (0, 0, 0)),
    "%": Unit(0.01, (0, 0, 0)),
    "in": Unit(0.0254, _LENGTH),
    "ft": Unit(0.3048, _LENGTH),
    "mil": Unit(2.54e-5, _LENGTH),
    **dict.fromkeys(("sec", "secs"), Unit(1.0, (0, 0, 1))),
    "msec": Unit(1e-3, (0, 0, 1)),
    "min": Unit(60.0, (0, 0, 1)),
    **dict.fromkeys(("h", "hr"), Unit(3600.0, (0, 0, 1))),
    **dict.fromkeys(("kgf", "kp"), Unit(9.80665, (1, 1, -2))),
    "gf": Unit(9.80665e-3, (1, 1, -2)),
    "daN": Unit(10.0, (1, 1, -2)),
    "lbf": Unit(4.4482216152605, (1, 1, -2)),
    "kip": Unit(4448.2216152605, (1, 1, -2)),
    "psi": Unit(6894.757293168, _STRESS),
    "ksi": Unit(6894757.293168, _STRESS),
}
_NAMES = {
    **dict.fromkeys(("meter", "metre"), "m"), "micron": "um", "newton": "N", "pascal": "Pa",
    "second": "s", "minute": "min", "hour": "h", "gram": "g", "joule": "J", "bar": "bar",
    "inch": "in", "inche": "in", "percent": "%", "angstrom": "\N{ANGSTROM SIGN}",
}  # fmt: skip
_PREFIX_NAMES = {
    "": "", "tera": "T", "giga": "G", "mega": "M", "kilo": "k", "centi": "c", "milli": "m",
    "micro": "u", "mikro": "u", "nano": "n",
}  # fmt: skip
_WORD = re.compile(rf"({'|'.join(_PREFIX_NAMES)})({'|'.join(_NAMES)})s?$", re.IGNORECASE)
"""Units in words, such as millimeters, Megapascal and microns."""
_COMMON = "m, cm, mm, um, nm, in, ft, Pa, kPa, MPa, GPa, bar, psi, N, kN, lbf, kgf, s, ms, min"
_MULTIPLES: dict[str, tuple[float, dict[str, float]]] = {
    "m": (1.0, {"km": 1e-3, "m": 1.0, "mm": 1e3, "µm": 1e6, "nm": 1e9}),
    "s": (1.0, {"s": 1.0, "ms": 1e3, "µs": 1e6, "ns": 1e9}),
    "Pa": (0.1, {"MPa": 1e-6, "kPa": 1e-3, "Pa": 1.0}),
    "N": (1.0, {"MN": 1e-6, "kN": 1e-3, "N": 1.0}),
}
"""Largest value on a scale from which on a unit is used, in that unit;
units and their factors."""
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴", "-01234")
_POWER = re.compile(r"([^\W\d_]+|%|1(?!\d))(?:\^?([+-]?\d))?$")


def _symbol(text: str) -> str:
    """Return the symbol for a unit in words. Return any other text unchanged.

    >>> [_symbol(text) for text in ("millimeters", "MegaPascal", "inches", "micrometre")]
    ['mm', 'MPa', 'in', 'um']
    >>> [_symbol(text) for text in ("mm", "metress", "mikrometer", "microns", "percent")]
    ['mm', 'metress', 'um', 'um', '%']
    """
    match = _WORD.match(text)
    return _PREFIX_NAMES[match[1].lower()] + _NAMES[match[2].lower()] if match else text


def parse(text: str) -> Unit | None:
    """Return the unit that `text` names (``MPa``, ``N/mm^2``, ``Pa m-1``), if it is known.

    Blanks or dots separate powers of known units. The first unit after
    a slash is a divisor.

    Examples
    --------
    >>> tuple(parse("MPa")), parse("inch").factor, (parse("furlong") or parse("m/")) is None
    ((1000000.0, (1, -1, -2)), 0.0254, True)
    >>> [parse(text).powers for text in ("N/mm^2", "Pa m-1", "J/m2 s", "kg·m⁻³", "1/s", "m**-2")]
    [(1, -1, -2), (1, -2, -2), (1, 0, -1), (1, -3, 0), (0, 0, -1), (0, -2, 0)]
    >>> round(parse("N/mm^2").factor, 3), round(parse("kN mm-1").factor, 3), parse(" % ").factor
    (1000000.0, 1000000.0, 0.01)
    >>> tuple(parse("-"))
    (1.0, (0, 0, 0))
    >>> [text for text in ("10", "m^x", "", "MPa psi-", "N*q", "s^-1") if parse(text)]
    ['s^-1']
    >>> lbf, inch = 0.45359237 * 9.80665, 0.0254  # by definition, N and m
    >>> pressures = parse("psi").factor * inch**2 / lbf, parse("ksi").factor * inch**2 / lbf
    >>> [round(ratio, 9) for ratio in (parse("lbf").factor / lbf, *pressures)]
    [1.0, 1.0, 1000.0]
    >>> print(*[f"{parse(name).factor:.6g}" for name in "mil ft in gf kgf kp daN kip bar".split()])
    2.54e-05 0.3048 0.0254 0.00980665 9.80665 9.80665 10 4448.22 100000
    >>> print(*[f"{parse(name).factor:g}" for name in "h hr min sec secs msec TPa cm ug".split()])
    3600 3600 60 1 1 0.001 1e+12 0.01 1e-09
    """
    text = text.strip()
    if text in _KNOWN:
        return _KNOWN[text]
    plain = re.sub("[⁻⁰¹²³⁴]+", lambda m: "^" + m.group().translate(_SUPERSCRIPTS), text)
    plain = re.sub(r"\*(?!\*)|[·⋅]", " ", plain.replace("**", "^"))
    factor = 1.0
    powers: tuple[int, ...] = (0, 0, 0)
    for place, part in enumerate(plain.split("/")):
        for number, word in enumerate(part.split() or ("",)):
            match = _POWER.match(word)
            unit = _KNOWN.get(_symbol(match[1])) if match else None
            if match is None or unit is None:
                return None
            power = int(match[2] or 1) * (-1 if place and number == 0 else 1)
            factor *= unit.factor**power
            powers = tuple(a + power * b for a, b in zip(powers, unit.powers, strict=True))
    return Unit(factor, powers)


def is_in(text: str | None, si: str) -> bool:
    """Return whether a text names a unit of the same dimension as an SI unit.

    >>> [is_in(text, "Pa") for text in ("N/mm2", "psi", "N", "", None, "x")]
    [True, True, False, False, False, False]
    >>> is_in("m", "x")
    False
    """
    given, wanted = parse(text or ""), parse(si)
    return given is not None and wanted is not None and given.powers == wanted.powers


def states_unit(text: str) -> bool:
    """Return whether a text is a number, with a known unit or without, such as '4 cm'.

    >>> [states_unit(text) for text in ("4 cm", " 4e3 ", "4 N mm-2", "4 apples", "cm", "inf m", "")]
    [True, True, True, False, False, False, False]
    """
    number, _, unit = text.strip().partition(" ")
    with suppress(ValueError):
        return math.isfinite(float(number)) and (not unit or parse(unit) is not None)
    return False


def conversion(text: str, units: Sequence[str]) -> tuple[float, str]:
    """Return the factor from a unit to the first SI unit of its dimension, and this SI unit.

    >>> conversion("mm", ("Pa", "m")), conversion("%", ("Pa", "1", "m"))
    ((0.001, 'm'), (0.01, '1'))
    >>> conversion("kN mm-1", ("N m-1",))
    (1000000.0, 'N m-1')
    >>> conversion("mpa", ("Pa",))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: unknown unit 'mpa'; did you mean MPa? (known: m, cm, ...
    >>> conversion("mm", ("Pa", "1"))
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is in mm, which cannot be converted to Pa or 1
    """
    given = parse(text)
    if given is None:
        near = [name for name in _COMMON.split(", ") if name.lower() == text.strip().lower()]
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(
            f"unknown unit {text!r}{hint} (known: {_COMMON}, products and quotients such as MPa/mm)"
        )
    for si in units:
        wanted = parse(si)
        assert wanted is not None
        if given.powers == wanted.powers:
            return given.factor / wanted.factor, si
    raise InputError(f"is in {text}, which cannot be converted to {' or '.join(units)}")


def unit_for(units: str, values: Any) -> tuple[float, str]:
    """Return the factor and name of the unit that suits the size of SI values.

    The largest value decides, and pressures change their unit at a tenth.

    >>> [unit_for("m", [size, 0.0])[1] for size in (1000.0, -999.0, 1e-3, 0.99e-3, 1e-12, 0.0)]
    ['km', 'm', 'mm', 'µm', 'nm', 'm']
    >>> print([f"{unit_for('m', size)[0]:g}" for size in (1e3, 1.0, 1e-3, 1e-6, 1e-9)])
    ['0.001', '1', '1000', '1e+06', '1e+09']
    >>> [unit_for("Pa", [value, float("nan")])[1] for value in (1.1e5, 0.9e5, 101.0, 99.0, 0.01)]
    ['MPa', 'kPa', 'kPa', 'Pa', 'Pa']
    >>> unit_for("N", [2.0, -3e6, 4e3]), unit_for("s", 2.5e-6)
    ((1e-06, 'MN'), (1000000.0, 'µs'))
    >>> unit_for("1", 3e9), unit_for("kg", 5.0)
    ((1.0, ''), (1.0, 'kg'))
    """
    if units not in _MULTIPLES:
        return 1.0, "" if units == "1" else units
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.max(np.abs(array[np.isfinite(array)]), initial=0.0))
    least, multiples = _MULTIPLES[units]
    suited = [unit for unit, f in multiples.items() if largest * f >= least * (1.0 - 1e-9)]
    unit = suited[0] if suited else list(multiples)[-1] if largest else units
    return multiples[unit], unit


def in_words(units: str, value: float) -> str:
    """Return an SI value in the unit that suits its size, such as '40 kN'.

    >>> [in_words("N", force) for force in (40321.0, 999.6, 999.4, -0.0123)]
    ['40.3 kN', '1 kN', '999 N', '-0.0123 N']
    >>> in_words("1", 0.12345)
    '0.123'
    """
    value = float(f"{value:.3g}")  # 999.6 N are 1 kN
    factor, unit = unit_for(units, value)
    return f"{value * factor:.3g} {unit}".rstrip()


def as_texts(units: str, values: Sequence[float]) -> tuple[list[str], str]:
    """Return SI values in one suitable unit, with digits that distinguish them, and the unit.

    A value alone has six digits. A value with an interval has two
    digits more than the interval resolves.

    >>> as_texts("Pa", [1234567.8]), as_texts("m", [0.0])
    ((['1.23457'], 'MPa'), (['0'], 'm'))

    The largest value is 138 times the spread. Three digits resolve it, and two are added.

    >>> as_texts("N", [-1424.345, -1420.123, -1430.456])
    (['-1.4243', '-1.4201', '-1.4305'], 'kN')
    >>> as_texts("1", [-0.5, 0.5123456, math.inf]), as_texts("1", [math.nan])
    ((['-0.5', '0.512', 'inf'], ''), (['nan'], ''))
    >>> as_texts("1", [1.0, 1.0 + 1e-12])[0], as_texts("1", [2.0, 1.98123456])[0]
    (['1', '1'], ['2', '1.9812'])
    """
    factor, unit = unit_for(units, values)
    finite = [value for value in values if math.isfinite(value)]
    spread = max(finite, default=0.0) - min(finite, default=0.0)
    ratio = max(map(abs, finite), default=0.0) / spread if spread else 1e4
    digits = min(max(math.ceil(math.log10(ratio)) + 2, 3), 9)
    return [f"{value * factor:.{digits}g}" for value in values], unit


# -- quantities ---------------------------------------------------------------------------------


def is_quantity(value: Any) -> bool:
    """Return whether a value, or an array, has a unit of pint or astropy.

    >>> from types import SimpleNamespace
    >>> pint, astropy = {"magnitude": 3.0, "to": None}, {"to_value": None, "unit": "m"}
    >>> [is_quantity(SimpleNamespace(**given)) for given in (pint, astropy)]
    [True, True]
    >>> [is_quantity(SimpleNamespace(**{name: None})) for name in (*pint, *astropy)]
    [False, False, False, False]
    """
    pint = hasattr(value, "magnitude") and hasattr(value, "to")
    return pint or (hasattr(value, "to_value") and hasattr(value, "unit"))


def magnitude_in_one_of(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return a quantity as a number in the first SI unit that fits, and the unit.

    A list of quantities becomes an array. A value without a unit is
    returned as given.

    A quantity of astropy converts by `to_value`, and a quantity of pint by `to`.

    >>> class Length:
    ...     unit = "mm"
    ...     def __init__(self, number):
    ...         self.number = number
    ...     def to_value(self, text):
    ...         return self.number * {"m": 1e-3, "Pa*m**-1": 5.0, "": 2.0}[text]
    >>> magnitude_in_one_of(Length(7), ("Pa", "m")), magnitude_in_one_of(7, ("Pa",))[0]
    ((0.007, 'm'), 7)
    >>> magnitude_in_one_of(Length(7), ("Pa m-1",))
    (35.0, 'Pa m-1')
    >>> from types import SimpleNamespace
    >>> pint = SimpleNamespace(magnitude=7, to=lambda text: SimpleNamespace(magnitude=len(text)))
    >>> magnitude_in_one_of(Length(7), ("1",)), magnitude_in_one_of(pint, ("Pa",))
    ((14.0, '1'), (2, 'Pa'))
    >>> numbers, unit = magnitude_in_one_of([Length(7), Length(9)], ("Pa", "m"))
    >>> numbers.round(6).tolist(), unit
    ([0.007, 0.009], 'm')
    >>> magnitude_in_one_of([Length(7), 9], ("m",))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: holds quantities of several kinds, or numbers without a unit...
    >>> magnitude_in_one_of(Length(7), ("Pa", "N"))
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is in mm, which cannot be converted to Pa or N
    """
    if isinstance(value, list | tuple) and any(map(is_quantity, value)):
        pairs = [magnitude_in_one_of(item, units) for item in value]
        if len({unit for _, unit in pairs}) > 1:
            raise InputError(
                "holds quantities of several kinds, or numbers without a unit. Give all values in"
                " the same unit"
            )
        return np.array([number for number, _ in pairs], dtype=np.float64), pairs[0][1]
    if not is_quantity(value):
        return value, None
    for si in units:
        text = re.sub(r"(-\d)", r"**\1", "" if si == "1" else si).replace(" ", "*")  # Pa*m**-1
        with suppress(Exception):  # each library has its own for 'no such unit'
            number = value.to_value(text) if hasattr(value, "to_value") else value.to(text)
            return getattr(number, "magnitude", number), si
    stated = getattr(value, "unit", None) or getattr(value, "units", "another unit")
    raise InputError(f"is in {stated}, which cannot be converted to {' or '.join(units)}")


def units_of_argument(name: str) -> tuple[str, ...]:
    """Return the SI units that a quantity for this argument may have.

    >>> [units_of_argument(name) for name in ("strength", "mean", "poisson_ratio")]
    [('Pa',), ('Pa', '1', 'm'), ('1',)]
    """
    if name in UNITS:
        return (UNITS[name],)
    return ("Pa", "1", "m") if name in OF_THE_FIELD else ("1",)


def as_numbers(value: Any) -> Array:
    """Return `value` as a float64 array, or raise an `InputError` that names its type.

    None and masked entries are missing values, NaN.

    >>> as_numbers([[1, 2, 3], (4, 5, 6)]).tolist(), as_numbers([1, None]).tolist()
    ([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], [1.0, nan])
    >>> as_numbers(np.ma.masked_equal([3, 7, 3], 3)).tolist(), as_numbers(7).shape
    ([nan, 7.0, nan], ())
    >>> for given in ([1, [2]], "a.csv", ["a", "b"], True, [1e3, 10**400], np.ma.masked_all(2)):
    ...     try:
    ...         as_numbers(given)
    ...     except InputError as error:
    ...         print(error)
    must be numbers in rows of equal length, got [1, [2]]
    must be numbers, got str. Read files by st.read_profile(path) or st.read_peaks(path)
    must be numbers, got elements of type <U1
    must be numbers, got bool
    must be numbers below 1e308
    has no values: its mask covers all entries
    """
    if isinstance(value, np.ma.MaskedArray):
        if value.size and np.ma.getmaskarray(value).all():
            raise InputError("has no values: its mask covers all entries")
        value = np.ma.filled(value.astype(np.float64), np.nan)
    try:
        given = np.asarray(value)
        if given.dtype == object and given.ndim:
            given = given.astype(np.float64)  # None becomes NaN
    except OverflowError:
        raise InputError("must be numbers below 1e308") from None
    except (TypeError, ValueError):
        raise InputError(
            f"must be numbers in rows of equal length, got {value!r:.40}"
        ) from None
    if given.dtype.kind not in "fiu":
        kind = type(value).__name__ if given.ndim == 0 else f"elements of type {given.dtype}"
        text = str(given.flat[0]) if given.dtype.kind == "U" and given.size else ""
        read = (
            ". Read files by st.read_profile(path) or st.read_peaks(path)"
            if Path(text).suffix
            else ""
        )
        raise InputError(f"must be numbers, got {kind}{read}")
    return np.ascontiguousarray(given, dtype=np.float64).reshape(given.shape)


def stated_unit(array: Any) -> str:
    """Return the unit that a labelled array states, '' if it states no unit.

    >>> import xarray as xr
    >>> stated = {"unit": " mm "}, {}, {"units": 1}, {"unit": "m", "units": "cm"}
    >>> [stated_unit(xr.DataArray(0, attrs=given)) for given in stated]
    ['mm', '', '1', 'cm']
    """
    return str(array.attrs.get("units") or array.attrs.get("unit") or "").strip()


def in_si(array: Any, units: Sequence[str], given: str | None = None) -> tuple[Array, str]:
    """Return the values of a labelled array in SI, and their unit, the first that fits.

    The unit comes from a quantity, from the caller (`given`) or from
    the source.

    Examples
    --------
    >>> import xarray as xr
    >>> x = xr.DataArray(np.array([3.0, 7.0]), attrs={"units": "mm"})
    >>> in_si(x, ("Pa", "m")), in_si(x.drop_attrs(), ("m", "Pa"))
    ((array([0.003, 0.007]), 'm'), (array([3., 7.]), 'm'))
    >>> in_si(x.drop_attrs(), ("Pa", "m"), "cm")[0].tolist()
    [0.03, 0.07]
    >>> in_si(x, ("m",), "cm")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is given in cm, but the source states mm. Leave the unit out...
    >>> in_si(xr.DataArray([3, None]), ("1",))[0].tolist()
    [3.0, nan]
    """
    numbers, stated = array.data, stated_unit(array)
    if type(numbers) is not np.ndarray or numbers.dtype != np.float64:
        numbers, of_quantity = magnitude_in_one_of(numbers, units)
        numbers, stated = as_numbers(numbers), of_quantity or stated
    factor, si = conversion(given or stated or units[0], units)
    if given:
        check_agreement(given, stated)
    return np.multiply(numbers, factor, order="C"), si


def check_agreement(given: str, stated: str) -> None:
    """Refuse a unit of the caller that differs from the unit that the source states.

    >>> for given, stated in (("N/mm2", "MPa"), ("mm", ""), ("mm", "metr"), ("metr", "mm")):
    ...     check_agreement(given, stated)
    >>> check_agreement("mm", "um")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is given in mm, but the source states um...
    """
    ours, theirs = parse(given), parse(stated)
    if ours and theirs and not math.isclose(ours.factor, theirs.factor, rel_tol=1e-12):
        raise InputError(
            f"is given in {given}, but the source states {stated}. Leave the unit out, or correct"
            " the source"
        )


# -- measured values ----------------------------------------------------------------------------

POSITIVE = (
    "strength", "normal_pressure", "critical_slip", "weakening_rate", "fracture_energy",
    "friction_coefficient",
)  # fmt: skip
"""Quantities whose values lie above zero."""
STRENGTHS = ("strength", "residual_strength")
"""Quantities in Pa that may be given as friction coefficients."""
OVERLOAD = 9.9e37
"""Smallest number with which an instrument marks an overload or a
missing value (SCPI)."""
MARKS = np.array([-99.0, -999.0, -999.25, -9999.0, -99999.0, -32768.0, 1e20, 1e30, 9.96921e36])
"""Further numbers that instruments and formats write for a missing value."""
TALL = 1e-3
"""Range of heights without a unit, m, above which they are probably in
um or nm."""


def check_measured(
    values: Array, quantity: str, lines: Any = (), given: Any = None, doubted: bool = True
) -> None:
    """Refuse measured values that mark an overload, or violate the sign of their quantity.

    With `doubted`, warn about a number that is far from all others and
    often marks a missing value. In messages, values are written as
    `given`, with their line in a table or their number.

    Examples
    --------
    The warning asks for a distance beyond the range of all other values, here 8 - (-99) > 9 - 8.

    >>> from stiction.base.errors import collect_warnings
    >>> values = np.array([8.0, -99.0, 9.0, -99.0])
    >>> with collect_warnings() as caught:
    ...     check_measured(values, "slip", (4, 5, 6, 7))
    ...     check_measured(values, "slip", doubted=False)
    ...     check_measured(np.array([8.0, -99.0, 120.0]), "slip")
    ...     check_measured(np.array([-99.0, -99.0]), "slip")
    >>> [warned.text[:66] for warned in caught]
    ['slip: -99 occurs in line 5 (2 such values), and often marks a miss']
    >>> with collect_warnings() as caught:
    ...     check_measured(np.array([1.0, 2.0, 9.96921e36]), "slip", given=np.array([3, 7, 1e30]))
    >>> caught[0].text[:39]
    'slip: 1e+30 occurs in entry 2 (1 such v'
    >>> for values in ([3.0, -9.9e37], [3.0, 0.0, -2.0]):
    ...     try:
    ...         check_measured(np.array(values), "strength", (), 10.0 * np.array(values))
    ...     except InputError as error:
    ...         print(str(error)[:68])
    strength holds -9.9e+38 in entry 1, which marks an overload. Cut the
    strength must be positive, but is 0 in entry 1 (2 such values). If 0
    >>> check_measured(np.array([0.0, -9.8e37, np.nan]), "slip")
    >>> check_measured(np.array([np.nan]), "slip")
    """
    shown = np.ravel(values if given is None else given)
    known = shown[np.isfinite(shown)]
    if known.size and np.abs(known).max() >= OVERLOAD:
        number = f"{known[np.abs(known).argmax()]:.9g}"
        raise InputError(
            f"{quantity} holds {number} in {_entry(np.abs(shown) >= OVERLOAD, lines)}, which marks"
            f" an overload. Cut the record there, or pass missing={number} if a value is missing"
        )
    if quantity in POSITIVE and (wrong := np.ravel(values) <= 0.0).any():
        number = f"{shown[wrong][0]:.9g}"
        raise InputError(
            f"{quantity} must be positive, but is {number} in {_entry(wrong, lines)}"
            f" ({np.count_nonzero(wrong)} such values). If {number} marks a missing value, pass"
            f" missing={number} to st.read_profile, or write NaN"
        )
    for end in (known.min(), known.max()) if doubted and known.size else ():
        rest = known[known != end]
        usual = np.isclose(end, MARKS, rtol=1e-5, atol=0.0).any()
        if usual and rest.size and min(abs(rest - end)) > np.ptp(rest):
            warn_user(
                f"{quantity}: {end:.9g} occurs in {_entry(shown == end, lines)}"
                f" ({known.size - rest.size} such values), and often marks a missing value. Pass"
                f" missing={end:.9g}, or missing=() to keep it",
                AccuracyWarning,
            )


def _entry(wrong: Array, lines: Any) -> str:
    """Describe the place of the first wrong value: its line in a table, or its number.

    >>> wrong = np.array([False, True, True])
    >>> _entry(wrong, [11, 13, 17]), _entry(wrong, [11, 13]), _entry(wrong, ())
    ('line 13', 'entry 1', 'entry 1')
    """
    entry = int(np.argmax(wrong))
    return f"line {lines[entry]}" if np.size(lines) == wrong.size else f"entry {entry}"


def profile_in_si(
    value: Any,
    quantity: str,
    units: Sequence[str] = (),
    *,
    unit: str | None = None,
    x_unit: str | None = None,
    doubted: bool = True,
) -> Any:
    r"""Return a profile with its values, and its coordinates x and y, in SI and checked.

    Numbers become an array. A DataArray states its unit in the
    attribute `units`: a strength may also be a friction coefficient, 1.

    Examples
    --------
    >>> import xarray as xr
    >>> places = xr.DataArray([1.0, 3.0], dims="x", attrs={"units": "cm"})
    >>> given = xr.DataArray([5.0, 7.0], coords={"x": places}, attrs={"units": "kPa"})
    >>> profile = profile_in_si(given, "strength")
    >>> profile.values.tolist(), profile.x.values.tolist(), profile.attrs
    ([5000.0, 7000.0], [0.01, 0.03], {'units': 'Pa'})
    >>> profile_in_si(given.drop_attrs(), "strength", unit="%", x_unit="mm").x.values.tolist()
    [0.001, 0.003]
    >>> profile_in_si([5, 7], "strength").tolist()
    [5.0, 7.0]
    >>> profile_in_si(given.assign_attrs(units="1"), "strength").attrs
    {'units': '1'}
    >>> profile_in_si(given.rename(x="y"), "strength", ("N m-2",)).y.values.tolist()
    [0.01, 0.03]
    >>> profile_in_si(given.assign_attrs(units="kN"), "slip", ("N",)).attrs
    {'units': 'N'}
    >>> profile_in_si(given.assign_attrs(units="1"), "slip")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: slip is in 1, which cannot be converted to m
    >>> profile_in_si(given, "strength", x_unit="kg")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: x is in kg, which cannot be converted to m
    >>> profile_in_si(given.assign_coords(x=[1.0, np.inf]), "strength")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: x must be finite, but is not in entry 1

    Units that a table or a profile of heights does not state are doubted.

    >>> from stiction.base.errors import collect_warnings
    >>> bare = given.drop_attrs().assign_attrs(read="table.txt")
    >>> low = xr.DataArray([0.0, 0.001, np.nan], dims="x")
    >>> with collect_warnings() as caught:
    ...     _ = profile_in_si(bare, "strength"), profile_in_si(bare.drop_attrs(), "slip")
    ...     _ = profile_in_si(bare, "slip", unit="m"), profile_in_si(bare, "slip", x_unit="m")
    ...     _ = profile_in_si(low, "height"), profile_in_si(low + low**2, "height")
    ...     _ = profile_in_si(low + low**2, "height", unit="m")
    ...     _ = profile_in_si((low + low**2).assign_attrs(units="m"), "height")
    ...     _ = profile_in_si(bare, "residual_ratio", x_unit="m")
    >>> print(*[warned.text.split(". ")[0][:70] for warned in caught], sep="\n")
    strength is read in Pa and x is read in m, because no unit is stated
    x is read in m, because no unit is stated
    slip is read in m, because no unit is stated
    height: has no unit and is read in m
    >>> caught[-1].text.split(". ")[1]
    'The heights span 0.001 m'
    """
    units = units or (QUANTITIES[quantity].units, *["1"] * (quantity in STRENGTHS))
    if not hasattr(value, "dims"):
        return as_numbers(magnitude_in_one_of(value, units[:1])[0])
    parts = {quantity: (value, units, unit)}
    parts |= {dim: (value[dim], ("m",), x_unit) for dim in ("x", "y") if dim in value.coords}
    converted, lines, assumed = {}, value.attrs.get("lines", ()), []
    for name, (array, valid, given) in parts.items():
        with prefixed(name, " "):
            converted[name] = in_si(array, valid, given)
        stated = given or stated_unit(array) or converted[name][1] == "1"
        if value.attrs.get("read") and not stated:  # a table, whose headings state units
            assumed.append(f"{name} is read in {converted[name][1]}")
    values, si = converted.pop(quantity)
    shown = value.values if isinstance(value.data, np.ndarray) else values
    check_measured(values, quantity, lines, shown, doubted)
    if assumed:
        warn_user(
            f"{' and '.join(assumed)}, because no unit is stated. Write units into the headings,"
            " such as 'x (mm)', or pass unit= and x_unit= to st.read_profile",
            UnitWarning,
        )
    elif quantity == "height" and not (unit or stated_unit(value)):
        known = np.isfinite(values)
        span = values.max(where=known, initial=-np.inf) - values.min(
            where=known, initial=np.inf
        )
        if span > TALL:
            warn_user(
                f"height: has no unit and is read in m. The heights span {span:.3g} m. Pass"
                " unit='um' or another unit, or unit='m' if metres are right",
                UnitWarning,
            )
    profile = value.copy(data=values)
    profile.attrs = {"units": si}
    for dim, (places, _) in converted.items():
        if not np.isfinite(places).all():
            raise InputError(
                f"{dim} must be finite, but is not in {_entry(~np.isfinite(places), lines)}"
            )
        profile = profile.assign_coords({dim: (value[dim].dims, places)})
    return profile


# -- doubts -------------------------------------------------------------------------------------


class Doubt(NamedTuple):
    """A ratio that shows whether two values are in the assumed units."""

    text: str
    ratio: float
    usual: tuple[float, float]
    possible: tuple[float, float] = (0.0, math.inf)


def doubt_units(doubts: Iterable[Doubt]) -> bool:
    """Warn about the first unusual ratio, and return whether there is any.

    If a ratio is impossible, an `InputError` lists all unusual ratios.

    >>> from stiction.base.errors import collect_warnings
    >>> usual, possible = (2.0, 5.0), (1.0, 9.0)
    >>> with collect_warnings() as caught:
    ...     [doubt_units([Doubt("a", ratio, usual, possible)]) for ratio in (1.0, 2.0, 5.0, 9.0)]
    ...     doubt_units([Doubt("b", 3.0, usual), Doubt("c", 99.0, usual), Doubt("d", 0.0, usual)])
    [True, False, False, True]
    True
    >>> [warned.text for warned in caught]
    ['a', 'a', 'c']
    >>> doubts = Doubt("a", 6.0, usual), Doubt("b", 3.0, usual), Doubt("c", 0.9, usual, possible)
    >>> doubt_units(doubts)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: a
    c
    """
    unusual = [doubt for doubt in doubts if not doubt.usual[0] <= doubt.ratio <= doubt.usual[1]]
    if any(not one.possible[0] <= one.ratio <= one.possible[1] for one in unusual):
        raise InputError(one.text for one in unusual)
    if unusual:
        warn_user(unusual[0].text, UnitWarning)
    return bool(unusual)
