"""Units of measured data, their factors to SI, and quantities from other packages.

A unit is read from its text, and no unit is
guessed. The page `docs/guide/reading-data.md`
has a table of the values that users may pass.
"""

import math
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from stiction.base.errors import InputError, UnitWarning, warn_user
from stiction.base.variables import OF_THE_FIELD, UNITS


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
"""Largest value on a scale from which on a unit is used, in that unit; units and their factors."""
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴", "-01234")
_POWER = re.compile(r"([^\W\d_]+|%|1(?!\d))(?:\^?([+-]?\d))?$")


def _symbol(text: str) -> str:
    """Return the symbol for a unit in words. Return any other text unchanged."""
    match = _WORD.match(text)
    return _PREFIX_NAMES[match[1].lower()] + _NAMES[match[2].lower()] if match else text


def parse(text: str) -> Unit | None:
    """Return the unit that `text` names (``MPa``, ``N/mm^2``, ``Pa m-1``), if it is known.

    Blanks or dots separate powers of known units. The first unit after
    a slash is a divisor.
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
    """Return whether a text names a unit of the same dimension as an SI unit."""
    given, wanted = parse(text or ""), parse(si)
    return given is not None and wanted is not None and given.powers == wanted.powers


def number_and_unit(text: str) -> tuple[float, str]:
    """Return the number and the unit, which may be empty, in a text such as '4 cm'."""
    number, _, unit = text.strip().partition(" ")
    return float(number), unit


def states_unit(text: str) -> bool:
    """Return whether a text is a number, with a known unit or without, such as '4 cm'."""
    with suppress(ValueError):
        number, unit = number_and_unit(text)
        return math.isfinite(number) and (not unit or parse(unit) is not None)
    return False


def factor_to(si: str, text: str) -> float:
    """Return the factor from the unit `text` to the SI unit `si`."""
    wanted, given = parse(si), parse(text)
    assert wanted is not None
    if given is None:
        near = [name for name in _COMMON.split(", ") if name.lower() == text.strip().lower()]
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(
            f"unknown unit {text!r}{hint} (known: {_COMMON}, products and quotients such as MPa/mm)"
        )
    if given.powers != wanted.powers:
        raise InputError(f"is in {text}, which cannot be converted to {si}")
    return given.factor / wanted.factor


def unit_for(units: str, values: Any) -> tuple[float, str]:
    """Return the factor and name of the unit that suits the size of SI values."""
    if units not in _MULTIPLES:
        return 1.0, "" if units == "1" else units
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.max(np.abs(array[np.isfinite(array)]), initial=0.0))
    least, multiples = _MULTIPLES[units]
    suited = [unit for unit, f in multiples.items() if largest * f >= least * (1.0 - 1e-9)]
    unit = suited[0] if suited else list(multiples)[-1] if largest else units
    return multiples[unit], unit


def in_words(units: str, value: float) -> str:
    """Return an SI value in the unit that suits its size, such as '40 kN'."""
    value = float(f"{value:.3g}")  # 999.6 N are 1 kN
    factor, unit = unit_for(units, value)
    return f"{value * factor:.3g} {unit}".rstrip()


def as_texts(units: str, values: Sequence[float]) -> tuple[list[str], str]:
    """Return SI values in one suitable unit, with digits that distinguish them, and the unit.

    A value alone has six digits. A value with an interval has two
    digits more than the interval resolves.
    """
    factor, unit = unit_for(units, values)
    finite = [value for value in values if math.isfinite(value)]
    spread = max(finite, default=0.0) - min(finite, default=0.0)
    ratio = max(map(abs, finite), default=0.0) / spread if spread else 1e4
    digits = min(max(math.ceil(math.log10(ratio)) + 2, 3), 9)
    return [f"{value * factor:.{digits}g}" for value in values], unit


# -- quantities ---------------------------------------------------------------------------------


def is_quantity(value: Any) -> bool:
    """Return whether a value, or an array, has a unit of pint or astropy."""
    pint = hasattr(value, "magnitude") and hasattr(value, "to")
    return pint or (hasattr(value, "to_value") and hasattr(value, "unit"))


def magnitude_in_one_of(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return a quantity as a number in the first SI unit that fits, and the unit.

    A value without a unit is returned as given.
    """
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
    """Return the SI units that a quantity for this argument may have."""
    if name in UNITS:
        return (UNITS[name],)
    return ("Pa", "1", "m") if name in OF_THE_FIELD else ("1",)


def plain(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return numbers in SI, with NaN for missing values, and the unit that they state.

    A list of quantities becomes an array. Other values are returned as given.
    """
    units = tuple(units)
    if isinstance(value, list | tuple) and value and all(map(is_quantity, value)):
        pairs = [magnitude_in_one_of(item, units) for item in value]
        if len({unit for _, unit in pairs}) > 1:
            raise InputError(
                "holds quantities of several kinds: give all of them in the same unit"
            )
        return np.array([number for number, _ in pairs], dtype=np.float64), pairs[0][1]
    if isinstance(value, list | tuple) and any(map(is_quantity, value)):
        raise InputError("holds quantities and numbers without a unit: give all of them a unit")
    number, unit = magnitude_in_one_of(value, units)
    if isinstance(number, np.ma.MaskedArray):
        if number.size and np.ma.getmaskarray(number).all():
            raise InputError("has no value: its mask covers all entries")
        number = np.ma.filled(number.astype(np.float64), np.nan)
    has_none = isinstance(number, list | tuple) and any(item is None for item in number)
    if has_none or (isinstance(number, np.ndarray) and number.dtype == object):
        try:
            number = np.array(number, dtype=np.float64)  # None becomes NaN
        except OverflowError:
            raise InputError("must be numbers below 1e308") from None
        except (TypeError, ValueError):
            pass  # texts are refused where numbers are checked
    return number, unit


# -- doubts -------------------------------------------------------------------------------------


class Doubt(NamedTuple):
    """A ratio that shows whether two values are in the assumed units."""

    text: str
    ratio: float
    usual: tuple[float, float]
    possible: tuple[float, float]


def doubt_units(doubts: Iterable[Doubt]) -> bool:
    """Warn about the first unusual ratio, and return whether there is any.

    If a ratio is impossible, an `InputError` lists all unusual ratios.
    """
    unusual = [doubt for doubt in doubts if not doubt.usual[0] <= doubt.ratio <= doubt.usual[1]]
    if any(not one.possible[0] <= one.ratio <= one.possible[1] for one in unusual):
        raise InputError(one.text for one in unusual)
    if unusual:
        warn_user(unusual[0].text, UnitWarning)
    return bool(unusual)
