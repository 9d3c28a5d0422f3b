"""What users hold, as numbers in SI: quantities with units, masked arrays, lists of either, None.

A quantity is told by what it can do: one of pint has `magnitude` and `to`, one of astropy `unit`
and `to_value`. The docs have the table of what is accepted (`docs/measured-profiles.md`).
"""

import re
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.variables import OF_THE_FIELD, UNITS


def is_quantity(value: Any) -> bool:
    """Return whether a value is a quantity of pint or astropy, a number or an array."""
    pint = hasattr(value, "magnitude") and hasattr(value, "to")
    return pint or (hasattr(value, "to_value") and hasattr(value, "unit"))


def magnitude(value: Any, si: str) -> Any:
    """Return the number of a quantity in an SI unit; anything else as it is."""
    if not is_quantity(value):
        return value
    text = re.sub(r"(-\d)", r"**\1", si).replace(" ", "*")  # Pa m-1: Pa*m**-1
    text = "" if text == "1" else text
    try:
        if hasattr(value, "to_value"):
            return value.to_value(text)
        return value.to(text).magnitude
    except Exception as error:  # each library has its own for 'no such unit'
        raise InputError(f"cannot be converted to {si}: {error}") from None


def magnitude_in_one_of(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return a value in the one SI unit of several to which it can be converted, and that unit.

    What has no unit is returned as it is, with None.
    """
    if not is_quantity(value):
        return value, None
    for si in units:
        try:
            return magnitude(value, si), si
        except InputError:
            continue
    stated = getattr(value, "unit", None) or getattr(value, "units", "another unit")
    raise InputError(f"is in {stated}, which cannot be converted to {' or '.join(units)}")


def units_of_argument(name: str) -> tuple[str, ...]:
    """Return the SI units that a quantity for this argument may have."""
    if name in UNITS:
        return (UNITS[name],)
    return ("Pa", "1", "m") if name in OF_THE_FIELD else ("1",)


def plain(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return numbers in SI, NaN where a value is masked or None, and their unit if they state it.

    A list of quantities becomes one array. What is none of these is returned as it is.
    """
    units = tuple(units)
    if isinstance(value, list | tuple) and value and all(map(is_quantity, value)):
        pairs = [magnitude_in_one_of(item, units) for item in value]
        if len({unit for _, unit in pairs}) > 1:
            raise InputError("holds quantities of several kinds; give them in one unit")
        return np.array([number for number, _ in pairs], dtype=np.float64), pairs[0][1]
    if isinstance(value, list | tuple) and any(map(is_quantity, value)):
        raise InputError("holds quantities and numbers without a unit; give all of them a unit")
    number, unit = magnitude_in_one_of(value, units)
    if isinstance(number, np.ma.MaskedArray):
        if number.size and np.ma.getmaskarray(number).all():
            raise InputError("has no value: its mask covers all entries")
        number = np.ma.filled(number.astype(np.float64), np.nan)
    has_none = isinstance(number, list | tuple) and any(item is None for item in number)
    if has_none or (isinstance(number, np.ndarray) and number.dtype == object):
        with suppress(
            TypeError, ValueError
        ):  # else whoever checks the numbers says what they are
            number = np.array(number, dtype=np.float64)  # None becomes NaN
    return number, unit
