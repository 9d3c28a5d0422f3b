"""What can be a profile: quantities, their units, and the names under which files know them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, UnitWarning, warn_user
from stiction.model import describe, real_array
from stiction.plausible import is_strength, warn_of_mapped
from stiction.units import factor_to, parse

Map = Callable[[Array], Array]
"""From a measured quantity in SI units, such as heights, to what is wanted of it."""

UNITS = {
    "strength": "Pa",
    "residual_strength": "Pa",
    "residual_ratio": "1",
    "initial_stress": "Pa",
    "normal_pressure": "Pa",
    "weakening_rate": "Pa/m",
    "critical_slip": "m",
    "fracture_energy": "J/m2",
    "load_profile": "1",
    "slip": "m",
    "friction_coefficient": "1",
}
"""What can be a profile, and its SI unit."""
_SIGNED = ("initial_stress", "load_profile", "slip")
"""What may be negative."""

_NAMES = {
    "strength": ("tau_p", "taup", "tau", "peak_strength", "shear_strength"),
    "residual_strength": ("tau_r", "taur"),
    "residual_ratio": (),
    "initial_stress": ("tau_i", "taui"),
    "normal_pressure": ("pressure", "normal_stress", "sigma_n", "sigma"),
    "weakening_rate": ("w",),
    "critical_slip": ("d_c", "dc"),
    "fracture_energy": ("gamma",),
    "load_profile": ("profile", "load"),
    "slip": ("d", "delta"),
    "friction_coefficient": ("mu", "coefficient"),
}
HEIGHTS = ("height", "heights", "topography", "z")
"""Names of what a map from heights to strength is applied to."""
_OTHER_STRESSES = ("hardness", "normal_pressure", *_NAMES["normal_pressure"])
"""Names of stresses of which a map may make a strength."""
OF_A_PLANE = (
    "; a map over x and y is read with the plane it belongs to,"
    " interface=st.Interface(length=(Lx, Ly), nodes=(nx, ny))"
)
"""What to do with two dimensions where a line was expected."""
PLACES = ("x", "position", "pos", "distance", "coordinate")
"""Names of the coordinate along the interface."""


def factor_of(given: str | None, stated: str | None, quantity: str) -> float:
    """To SI, from what the caller says and what the source states."""
    si = "m" if quantity in ("x", "y") else UNITS[quantity]
    return _factor(given, stated, quantity, lambda text: factor_to(si, text))


def _factor(
    given: str | None, stated: str | None, what: str, factor: Callable[[str], float]
) -> float:
    try:
        if given is None:
            return 1.0 if stated is None else factor(stated)
        result = factor(given)
        known = None if stated is None else parse(stated)
        if known is not None and not np.isclose(factor(str(stated)), result, rtol=1e-12):
            raise InputError(f"is said to be in {given}, the source states {stated}")
    except InputError as error:
        raise InputError([f"{what} {text}" for text in error.problems]) from None
    return result


def converted(
    values: Array,
    given: str | None,
    stated: str | None,
    quantity: str,
    strength: Map | None = None,
    name: object = None,
) -> Array:
    """Values in SI; with a map `strength` what it makes of them, called `name` in the source."""
    if strength is None:
        return values * factor_of(given, stated, quantity)
    values = values * _factor_to_map(name, given, stated, quantity)
    found = mapped_by(strength, values, quantity)
    if given is None and stated is None and quantity == "strength":
        _warn_of_length(strength, values, found, quantity)
    return found


def _factor_to_map(name: object, given: str | None, stated: str | None, quantity: str) -> float:
    """To SI of what a map gets: heights in most cases, but no strength."""
    called = "the quantity to map" if name is None else repr(name)
    if is_called(name, quantity):
        raise InputError(
            f"{called} is the {quantity} already, and strength= makes one of something else, such"
            " as heights; leave strength= out, or say what it is applied to with value=..."
        )

    def factor(text: str) -> float:
        unit = parse(text)
        return factor_to("m", text) if unit is None or is_height(name) else unit.factor

    found = _factor(given, stated, called, factor)
    unit = given or stated
    if _of_dimension(unit, "Pa") and _plain(name) not in _OTHER_STRESSES:
        warn_user(
            f"{called} is in {unit}, a stress, and strength= is applied to it as to heights; if it"
            " is the strength, leave strength= out",
            UnitWarning,
        )
    return found


def _plain(name: object) -> str:
    return "" if name is None else str(name).casefold().replace(" ", "_")


def is_height(name: object) -> bool:
    """Whether the name says that it is a height."""
    return _plain(name) in HEIGHTS


def is_called(name: object, quantity: str) -> bool:
    """Whether the name says that it is the quantity, as 'peak strength' and 'tau' do."""
    own = _plain(name)
    return own in (quantity, *_NAMES[quantity]) or (quantity == "strength" and quantity in own)


def _of_dimension(unit: str | None, si: str) -> bool:
    given, wanted = None if unit is None else parse(unit), parse(si)
    assert wanted is not None
    return given is not None and given.dimension == wanted.dimension


def check_only(name: object, value: object) -> None:
    """Refuse the name of another variable than the only one there is."""
    if value is not None and value != name:
        raise InputError(f"value: {describe(value)} is not the one variable here, {name!r}")


def choose(
    known: Sequence[tuple[str | None, str | None]], quantity: str, strength: Map | None
) -> int:
    """Which of several variables (name, unit) is the quantity, if that is beyond doubt.

    With a map `strength`: which of them it is applied to.
    """
    if strength is not None:
        return _choose_to_map(known, quantity)
    if len(known) == 1 and known[0][0] is None:
        return 0
    for name in (quantity, *_NAMES[quantity], *(("value", "values") if len(known) == 1 else ())):
        for number, (own, _) in enumerate(known):
            if own is not None and _plain(own) == name:
                return number
    wanted = parse(UNITS[quantity])
    assert wanted is not None
    units = [None if unit is None else parse(unit) for _, unit in known]
    # Any number is dimensionless: for such a quantity a unit says nothing.
    fitting = [
        number
        for number, unit in enumerate(units)
        if unit and unit.dimension == wanted.dimension and any(wanted.dimension)
    ]
    if len(fitting) == 1:
        return fitting[0]
    raise InputError(
        f"holds no variable that is plainly the {quantity} ({UNITS[quantity]}): got"
        f" {_described(known)}. Call it {quantity!r}, state its unit, or say which it is with"
        " value=... (--value) and unit=... (--unit)"
    )


def _choose_to_map(known: Sequence[tuple[str | None, str | None]], quantity: str) -> int:
    """What is called heights, or is in a unit of length, or is the only one that is no strength."""
    if len(known) == 1:
        return 0  # whether it can be mapped is seen where its unit is
    left = [
        number
        for number, (name, unit) in enumerate(known)
        if not is_called(name, quantity) and not _of_dimension(unit, "Pa")
    ]
    called = [number for number in left if is_height(known[number][0])]
    lengths = [number for number in left if _of_dimension(known[number][1], "m")]
    for found in (called, lengths, left):
        if len(found) == 1:
            return found[0]
    raise InputError(
        f"does not say which variable strength= is applied to: got {_described(known)}. Call it"
        " 'height', or name it with value=..."
    )


def _described(known: Sequence[tuple[str | None, str | None]]) -> str:
    return ", ".join(f"{n!r} in {u}" if u else f"{n!r}" for n, u in known) or "none"


def mapped_by(strength: Map, values: Array, quantity: str) -> Array:
    """What a user makes of measured values, such as heights: one value for each; gaps stay gaps."""
    try:
        found = real_array(np.ma.filled(strength(values.copy()), np.nan))
    except Exception as error:  # whatever a user's function raises
        raise InputError(
            f"strength: failed with {type(error).__name__}: {error}; it is called with one array of"
            f" shape {values.shape} and returns one of real numbers"
        ) from error
    if found.shape != values.shape:
        raise InputError(
            f"strength: must return one value a point, shape {values.shape}, got shape"
            f" {found.shape}"
        )
    found = np.where(np.isnan(values), np.nan, found)
    wrong = ~np.isnan(values) & ~np.isfinite(found)
    valid = "finite"
    if quantity not in _SIGNED:
        wrong |= found < 0.0
        valid = "finite and not negative"
    if wrong.any():
        first = np.flatnonzero(wrong)[0]
        raise InputError(
            f"strength: must return {quantity} that is {valid}, got {found.flat[first]:g} for"
            f" {values.flat[first]:g} (SI units), and such at {int(wrong.sum())} of"
            f" {values.size} points"
        )
    return found


def _warn_of_length(strength: Map, values: Array, found: Array, quantity: str) -> None:
    """Warn where values without a unit give a strength that no solid has."""
    if np.isnan(found).all() or is_strength(float(np.nanmean(found))):
        return
    fitting = {}
    for unit in ("mm", "um", "nm"):
        with contextlib.suppress(InputError), np.errstate(all="ignore"):
            other = mapped_by(strength, values * factor_to("m", unit), quantity)
            fitting[unit] = float(np.nanmean(other))
    warn_of_mapped(float(np.nanmean(found)), fitting)
