"""What can be a profile: quantities, their units, and the names under which files know them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from stiction._typing import Array
from stiction.errors import InputError
from stiction.units import factor_to, parse

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
PLACES = ("x", "position", "pos", "distance", "coordinate")
"""Names of the coordinate along the interface."""


def factor_of(
    given: str | None, stated: str | None, quantity: str, any_dimension: bool = False
) -> float:
    """To SI, from what the caller says and what the source states.

    With `any_dimension` the unit may measure something else, such as heights that are mapped.
    """
    si, what = ("m", quantity) if quantity in ("x", "y") else (UNITS[quantity], quantity)

    def factor(text: str) -> float:
        if not any_dimension:
            return factor_to(si, text)
        unit = parse(text)
        return unit.factor if unit is not None else factor_to(si, text)

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


def choose(known: Sequence[tuple[str | None, str | None]], quantity: str, mapped: bool) -> int:
    """Which of several variables (name, unit) is the quantity, if that is beyond doubt."""
    if len(known) == 1 and (mapped or known[0][0] is None):
        return 0
    for name in (quantity, *_NAMES[quantity], *(("value", "values") if len(known) == 1 else ())):
        for number, (own, _) in enumerate(known):
            if own is not None and own.casefold().replace(" ", "_") == name:
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
    described = ", ".join(f"{n!r} in {u}" if u else f"{n!r}" for n, u in known) or "none"
    raise InputError(
        f"holds no variable that is plainly the {quantity} ({UNITS[quantity]}): got {described}."
        f" Call it {quantity!r}, state its unit, or say which it is with value=... (--value) and"
        " unit=... (--unit)"
    )


def mapped_by(strength: Callable[[Array], Array], values: Array) -> Array:
    """What a user makes of measured values, such as heights: one value for each."""
    found = np.asarray(strength(values), dtype=np.float64)
    if found.shape != values.shape:
        raise InputError(
            f"strength: must return one value a point, shape {values.shape}, got shape"
            f" {found.shape}"
        )
    return found
