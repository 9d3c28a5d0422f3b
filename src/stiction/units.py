"""Units that measured data state, and what they are in SI: nothing is converted by guessing."""

from __future__ import annotations

import re
from typing import NamedTuple

from stiction.errors import InputError

Dimension = tuple[int, int, int]
"""Powers of kilogram, metre and second."""


class Unit(NamedTuple):
    """A unit as a factor to SI and a dimension."""

    factor: float
    dimension: Dimension


_BASE = {
    "m": Unit(1.0, (0, 1, 0)),
    "s": Unit(1.0, (0, 0, 1)),
    "g": Unit(1e-3, (1, 0, 0)),
    "N": Unit(1.0, (1, 1, -2)),
    "Pa": Unit(1.0, (1, -1, -2)),
    "bar": Unit(1e5, (1, -1, -2)),
}
_PREFIXES = {"": 1.0, "T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "m": 1e-3}
_PREFIXES |= {"u": 1e-6, "\N{MICRO SIGN}": 1e-6, "\N{GREEK SMALL LETTER MU}": 1e-6, "n": 1e-9}
_LONG_PREFIXES = {"giga": "G", "mega": "M", "kilo": "k", "centi": "c", "milli": "m"}
_LONG_PREFIXES |= {"micro": "u", "nano": "n", "": ""}
_LONG_BASE = {"meter": "m", "metre": "m", "pascal": "Pa", "newton": "N", "second": "s"}
_SINGLE = {
    prefix + name: Unit(scale * unit.factor, unit.dimension)
    for prefix, scale in _PREFIXES.items()
    for name, unit in _BASE.items()
}
_SINGLE |= {
    long_prefix + long_name + plural: _SINGLE[prefix + name]
    for long_prefix, prefix in _LONG_PREFIXES.items()
    for long_name, name in _LONG_BASE.items()
    for plural in ("", "s")
}
_SINGLE |= {
    "micron": _SINGLE["um"],
    "microns": _SINGLE["um"],
    "psi": Unit(6894.757293168, (1, -1, -2)),
    "%": Unit(0.01, (0, 0, 0)),
    "1": Unit(1.0, (0, 0, 0)),
    "-": Unit(1.0, (0, 0, 0)),
    "dimensionless": Unit(1.0, (0, 0, 0)),
}
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴", "-01234")
_FACTOR = re.compile(r"(?P<name>[^\W\d_]+|%|1(?!\d))(?:\^?(?P<power>[+-]?\d+))?$")


def parse(text: str) -> Unit | None:
    """The unit that `text` names (``MPa``, ``N/mm^2``, ``Pa m-1``), or None if it is not known."""
    text = text.strip()
    whole = _SINGLE.get(text) or _SINGLE.get(text.lower() if len(text) > 4 else text)
    if whole is not None:
        return whole
    plain = re.sub(r"[⁻⁰¹²³⁴]+", lambda m: "^" + m.group().translate(_SUPERSCRIPTS), text)
    plain = re.sub(r"\*(?!\*)|[·⋅]", " ", plain.replace("**", "^")).replace("/", " / ")
    factor, dimension, sign = 1.0, (0, 0, 0), 1
    for word in plain.split():
        if word == "/":
            if sign < 0:
                return None
            sign = -1
            continue
        match = _FACTOR.match(word)
        unit = _SINGLE.get(match["name"]) if match else None
        if match is None or unit is None:
            return None
        power = sign * int(match["power"] or 1)
        factor *= unit.factor**power
        a, b, c = dimension
        d, e, f = unit.dimension
        dimension, sign = (a + power * d, b + power * e, c + power * f), 1
    return Unit(factor, dimension) if plain.split() and sign > 0 else None


def factor_to(si: str, text: str) -> float:
    """What a value in the unit `text` is multiplied by to be in the SI unit `si`.

    Units that the small table here does not know are looked up with pint where it is installed.

    Raises
    ------
    InputError
        If the unit is not known, or measures something else.
    """
    wanted, given = parse(si), parse(text)
    assert wanted is not None
    if given is None:
        return _by_pint(si, text)
    if given.dimension != wanted.dimension:
        raise InputError(f"is in {text}, which is no unit of {_meaning(si)}; give it in {si}")
    return given.factor / wanted.factor


def _by_pint(si: str, text: str) -> float:
    try:
        import pint
    except ImportError:
        pass
    else:
        try:
            return float(pint.UnitRegistry().Quantity(1.0, text).to(si).magnitude)
        except pint.DimensionalityError:
            raise InputError(
                f"is in {text}, which is no unit of {_meaning(si)}; give it in {si}"
            ) from None
        except Exception:  # pint's parser raises many kinds for text that is no unit
            pass
    near = [name for name in _COMMON if name.lower() == text.strip().lower()]
    hint = f"; did you mean {near[0]}?" if near else ""
    raise InputError(
        f"unknown unit {text!r}{hint} (known: {', '.join(_COMMON)}, products and quotients of them"
        " such as MPa/mm, and all that pint knows if it is installed)"
    )


_COMMON = ("m", "cm", "mm", "um", "nm", "km", "Pa", "kPa", "MPa", "GPa", "bar", "psi", "N", "kN")


def _meaning(si: str) -> str:
    names = {"Pa": "stress", "m": "length", "Pa/m": "a weakening rate", "1": "a pure number"}
    return names.get(si, si)
