"""Profiles in labelled arrays and in quantities with units: names decide what runs along x."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.errors import InputError, unknown_name
from stiction.model import real_array
from stiction.profile_nodes import Points
from stiction.quantities import (
    OF_A_PLANE,
    PLACES,
    UNITS,
    Map,
    check_only,
    choose,
    converted,
    factor_of,
)

_SAMPLES = ("sample", "samples", "kept_sample")
MEASURED = "measured"
"""Coordinate along x of a profile with gaps: False where there was no value."""


def is_labelled(value: Any) -> bool:
    """Whether it is an xarray object, told without importing xarray."""
    return hasattr(value, "dims") and hasattr(value, "coords")


def simplified(value: Any, quantity: str) -> Any:
    """`value` as one of the kinds that are told apart here: labelled, or plain numbers in SI.

    A pandas Series over numbers that are no count is labelled; a quantity of pint or astropy and
    a labelled number are plain.
    """
    try:
        if is_labelled(value):
            plain = not value.dims and not hasattr(value, "data_vars")
            factor = factor_of(None, _unit_of(value), quantity) if plain else 1.0
            return _magnitude(value.data, UNITS[quantity]) * factor if plain else value
        index = getattr(value, "index", None)
        if (
            hasattr(value, "to_xarray")
            and getattr(getattr(index, "dtype", None), "kind", "") == "f"
        ):
            return value.to_xarray()
    except TypeError as error:
        raise InputError(f"must be numbers; {error}") from None
    return _magnitude(value, UNITS[quantity])


def labelled(
    source: Any,
    quantity: str,
    x: Any = None,
    value: Any = None,
    unit: str | None = None,
    x_unit: str | None = None,
    strength: Map | None = None,
) -> Points:
    """Values and coordinates of a DataArray, or of one variable of a Dataset; names decide."""
    if hasattr(source, "data_vars"):
        names = [str(name) for name in source.data_vars if str(name) != str(x)]
        known = [(name, _unit_of(source[name])) for name in names]
        if not names:
            raise InputError(
                f"holds no profile (a variable of numbers along one dimension){OF_A_PLANE}"
            )
        chosen = names.index(value) if value in names else None
        if value is not None and chosen is None:
            raise InputError(unknown_name("value", str(value), names))
        number = choose(known, quantity, strength) if chosen is None else chosen
        extra = {x: source[x]} if x is not None and x in source.data_vars else {}
        source = source[names[number]].assign_coords(extra)
    else:
        check_only(source.name, value)
    si = UNITS[quantity] if strength is None else "m"
    nodes = _dimension_along(source, x)
    samples = [name for name in source.dims if name != nodes]
    if len(samples) > 1:
        sizes = ", ".join(f"{name}: {size}" for name, size in source.sizes.items())
        raise InputError(f"must have one dimension beside x, got ({sizes}); select one point")
    if nodes is None:  # one value a sample
        values = real_array(_magnitude(source.data, si))[:, np.newaxis]
        return Points(converted(values, unit, _unit_of(source), quantity, strength, source.name))
    source = source.transpose(*samples, nodes)
    try:
        values = real_array(_magnitude(source.data, si))
    except TypeError as error:
        raise InputError(f"must be numbers; {error}") from None
    values = converted(values, unit, _unit_of(source), quantity, strength, source.name)
    measured = None
    if MEASURED in source.coords and nodes in source.coords[MEASURED].dims:
        mask = source.coords[MEASURED].broadcast_like(source).transpose(*samples, nodes)
        measured = mask.values.astype(bool)
    place = _coordinate(source, nodes, x)
    if place is None:
        return Points(values, None, measured)
    at = real_array(_magnitude(place.data, "m")) * factor_of(x_unit, _unit_of(place), "x")
    return Points(values, at, measured)


def _unit_of(array: Any) -> str | None:
    for key in ("units", "unit"):
        if key in array.attrs and str(array.attrs[key]).strip():
            return str(array.attrs[key]).strip()
    return None


def _dimension_along(source: Any, x: Any) -> Any:
    """The dimension along the interface; None if there is none, only one of samples."""
    dims = list(source.dims)
    if x is not None and x in source.coords and source.coords[x].ndim == 1:
        return source.coords[x].dims[0]
    if x is not None:
        raise InputError(unknown_name("x", str(x), [str(name) for name in source.coords]))
    called = [name for name in dims if str(name).casefold() in PLACES]
    called = called or [
        coordinate.dims[0]
        for name, coordinate in source.coords.items()
        if str(name).casefold() in PLACES and coordinate.ndim == 1
    ]
    if called:
        return called[0]
    rest = [name for name in dims if str(name).casefold() not in _SAMPLES]
    if len(rest) == 1:
        return rest[0]
    if not rest and len(dims) == 1:
        return None
    if dims and all(str(name).startswith("dim_") for name in dims):  # never named: order counts
        return dims[-1]
    raise InputError(
        f"which dimension runs along the interface is not clear from ({', '.join(map(str, dims))});"
        " call it 'x', and the other 'sample'"
    )


def _coordinate(source: Any, nodes: Any, x: Any) -> Any:
    if x is not None:
        return source.coords[x]
    if nodes in source.coords:
        return source.coords[nodes]
    named = [
        coordinate
        for name, coordinate in source.coords.items()
        if str(name).casefold() in PLACES and coordinate.dims == (nodes,)
    ]
    return named[0] if named else None


def _magnitude(value: Any, si: str) -> Any:
    """The plain number of a pint or astropy quantity in an SI unit; anything else as it is."""
    try:
        if hasattr(value, "magnitude") and hasattr(value, "to"):
            return value.to(si).magnitude
        if hasattr(value, "to_value") and hasattr(value, "unit"):
            return value.to_value(si)
    except Exception as error:  # each library has its own for 'no such unit'
        raise InputError(f"cannot be converted to {si}: {error}") from None
    return value
