"""Units that measured data state, and what they are in SI: nothing is converted by guessing."""

import re
from typing import NamedTuple

from stiction.errors import InputError


class Unit(NamedTuple):
    """A unit: its factor to SI, and its powers of kilogram, metre and second."""

    factor: float
    dimension: tuple[int, int, int]


_NUMBER, _LENGTH, _STRESS = (0, 0, 0), (0, 1, 0), (1, -1, -2)
_BASE = {
    ("m", "meter", "metre"): Unit(1.0, _LENGTH),
    ("s", "second"): Unit(1.0, (0, 0, 1)),
    ("N", "newton"): Unit(1.0, (1, 1, -2)),
    ("J", "joule"): Unit(1.0, (1, 2, -2)),
    ("Pa", "pascal"): Unit(1.0, _STRESS),
    ("bar",): Unit(1e5, _STRESS),
    ("g",): Unit(1e-3, (1, 0, 0)),
}
_PREFIXES = {
    "": ("", 1.0), "T": ("tera", 1e12), "G": ("giga", 1e9), "M": ("mega", 1e6),
    "k": ("kilo", 1e3), "c": ("centi", 1e-2), "m": ("milli", 1e-3), "u": ("micro", 1e-6),
    "\N{MICRO SIGN}": ("micro", 1e-6), "\N{GREEK SMALL LETTER MU}": ("micro", 1e-6),
    "n": ("nano", 1e-9),
}  # fmt: skip
_UNITS = {
    **dict.fromkeys(("1", "-", "dimensionless"), Unit(1.0, _NUMBER)),
    **dict.fromkeys(("in", "inch"), Unit(0.0254, _LENGTH)),
    **dict.fromkeys(("micron", "microns"), Unit(1e-6, _LENGTH)),
    "%": Unit(0.01, _NUMBER),
    "psi": Unit(6894.757293168, _STRESS),
    "ksi": Unit(6894757.293168, _STRESS),
}
for _short, (_long, _scale) in _PREFIXES.items():
    for (_name, *_words), _unit in _BASE.items():
        _names = [_short + _name, *(_long + word + s for word in _words for s in ("", "s"))]
        _UNITS |= dict.fromkeys(_names, Unit(_scale * _unit.factor, _unit.dimension))
_KNOWN = "m, cm, mm, um, nm, km, in, Pa, kPa, MPa, GPa, bar, psi, ksi, N, kN, s, ms"
_MEANING = {"Pa": "stress", "m": "length", "Pa/m": "a weakening rate", "1": "a pure number"}
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴", "-01234")
_FACTOR = re.compile(r"([^\W\d_]+|%|1(?!\d))(?:\^?([+-]?\d+))?$")


def parse(text: str) -> Unit | None:
    """Return the unit that `text` names (``MPa``, ``N/mm^2``, ``Pa m-1``), None if it is unknown.

    Units are powers of the known ones, separated by blanks or dots, and one of them or several in
    turn after a slash.
    """
    text = text.strip()
    whole = _UNITS.get(text) or _UNITS.get(text.lower() if len(text) > 4 else text)
    if whole is not None:
        return whole
    plain = re.sub(r"[⁻⁰¹²³⁴]+", lambda m: "^" + m.group().translate(_SUPERSCRIPTS), text)
    plain = re.sub(r"\*(?!\*)|[·⋅]", " ", plain.replace("**", "^"))
    factor, dimension = 1.0, _NUMBER
    for place, part in enumerate(plain.split("/")):
        words = part.split()
        if not words:
            return None
        for number, word in enumerate(words):
            match = _FACTOR.match(word)
            unit = _UNITS.get(match[1]) if match else None
            if match is None or unit is None:
                return None
            power = int(match[2] or 1) * (-1 if place and number == 0 else 1)
            factor *= unit.factor**power
            a, b, c = (d + power * e for d, e in zip(dimension, unit.dimension, strict=True))
            dimension = (a, b, c)
    return Unit(factor, dimension)


def is_in(text: str | None, si: str) -> bool:
    """Whether a text names a unit of the same dimension as an SI unit."""
    given, wanted = None if text is None else parse(text), parse(si)
    return given is not None and wanted is not None and given.dimension == wanted.dimension


def factor_to(si: str, text: str) -> float:
    """Return what a value in the unit `text` is multiplied by to be in the SI unit `si`."""
    wanted, given = parse(si), parse(text)
    assert wanted is not None
    if given is None:
        near = [name for name in _KNOWN.split(", ") if name.lower() == text.strip().lower()]
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(
            f"unknown unit {text!r}{hint} (known: {_KNOWN}, products and quotients such as MPa/mm)"
        )
    if given.dimension != wanted.dimension:
        what = _MEANING.get(si, si)
        raise InputError(f"is in {text}, which is not a unit of {what}; give it in {si}")
    return given.factor / wanted.factor
