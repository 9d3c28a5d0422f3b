"""Records: measured values at equal distances, on a line or a plane, with their gaps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.model import real_array
from stiction.profiles import is_labelled, points_of, simplified

FEWEST = 64
"""Measured points below which a record says nothing of a spectrum."""
UNEVEN = 0.02
"""Of a spacing: what rounding in a file may move a point."""
OUTLYING = 8.0
"""Times the robust standard deviation: where a value is called an outlier."""


@dataclass(frozen=True, eq=False)
class Record:
    """Values at equal distances.

    Attributes
    ----------
    values : (n,) or (nx, ny) array
        SI; NaN where nothing was measured.
    spacings : tuple of float
        Distance of points along each direction, m.
    starts : tuple of float
        Position of the first point, m.
    """

    values: Array
    spacings: tuple[float, ...]
    starts: tuple[float, ...]

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Where there is a value."""
        known: NDArray[np.bool_] = np.isfinite(self.values)
        return known

    @property
    def lengths(self) -> tuple[float, ...]:
        """Extent along each direction, m."""
        return tuple(n * d for n, d in zip(self.values.shape, self.spacings, strict=True))

    @property
    def geometry(self) -> tuple[Any, ...]:
        """What two records must share to have the same window."""
        return self.values.shape, self.spacings, self.measured.tobytes()


def records_of(profiles: Any, interface: Interface | None, quantity: str) -> list[Record]:
    """All profiles as records; errors name the profile and the place.

    Parameters
    ----------
    profiles : array, DataArray or sequence of them
        See `stiction.fit_field`.
    interface : Interface, optional
        Says how far the points of plain arrays are apart.
    quantity : str
        One of `stiction.profiles.UNITS`.
    """
    several = isinstance(profiles, list | tuple) and not (
        profiles and all(map(np.isscalar, profiles))
    )
    found: list[Record] = []
    problems: list[str] = []
    for number, one in enumerate(profiles if several else [profiles]):
        name = f"profiles[{number}]" if several else "profiles"
        try:
            for record in _records(one, interface, quantity):
                _check(record)
                found.append(record)
        except InputError as error:
            problems += [f"{name}: {text}" for text in error.problems]
    if problems:
        raise InputError(problems)
    if not found:
        raise InputError("profiles: none were given")
    if len({record.values.ndim for record in found}) > 1:
        raise InputError("profiles: are of lines and of planes; fit them one after the other")
    return found


def _records(source: Any, interface: Interface | None, quantity: str) -> list[Record]:
    source = simplified(source, quantity)
    if not is_labelled(source):
        return _of_array(source, interface)
    dims = ("x", "y") if "y" in source.dims else ("x",)
    points = points_of(source, quantity, dims)
    values = points.values
    if points.measured is not None:  # what was filled in is no measurement
        values = np.where(points.measured, values, np.nan)
    if not points.places:
        return _of_array(values, interface)
    shape, spacings, index = [], [], []
    for dim, at in points.places.items():
        count, spacing = _evenly(np.sort(at) if len(dims) == 1 else np.unique(at), dim)
        shape.append(count)
        spacings.append(spacing)
        index.append(np.round((at - at.min()) / spacing).astype(np.int64))
    rows = values.reshape(-1, values.shape[-1])
    full = np.full((rows.shape[0], *shape), np.nan)
    full[(slice(None), *index)] = rows
    starts = tuple(float(at.min()) for at in points.places.values())
    return [Record(one, tuple(spacings), starts) for one in full]


def _of_array(values: Any, interface: Interface | None) -> list[Record]:
    """Records of values at the nodes of an interface, (*shape) or (samples, *shape)."""
    try:
        array = real_array(values)
    except TypeError as error:
        raise InputError(
            f"must be numbers, or a DataArray such as st.read_profile returns; {error}"
        ) from None
    if interface is None:
        raise InputError(
            f"an array of shape {array.shape} does not say how far its points are apart; give the"
            " interface, or a DataArray over 'x' (m) such as st.read_profile returns"
        )
    shape = interface.shape
    if array.shape != shape and array.shape[1:] != shape:
        raise InputError(
            f"must have shape {shape} or (samples, {', '.join(map(str, shape))}) on this"
            f" interface, got shape {array.shape}"
        )
    rows = array.reshape(-1, *shape)
    return [Record(row, interface.spacings, (0.0,) * len(shape)) for row in rows]


def _evenly(x: Array, name: str) -> tuple[int, float]:
    """Number and distance (m) of points at equal distances, of which sorted ones are known.

    Raises
    ------
    InputError
        If points repeat or lie at unequal distances.
    """
    if not np.all(np.isfinite(x)) or x.size < 2:
        raise InputError(f"{name}: must be finite and have more than one point")
    steps = np.diff(x)
    spacing = float(np.median(steps))
    if not steps.min() > 1e-6 * spacing:
        again = int(np.argmin(steps))
        raise InputError(
            f"{name} repeats: {x[again]:.9g} and {x[again + 1]:.9g} m are one place; keep one of"
            " the two values, or their mean"
        )
    place = np.round((x - x[0]) / spacing)
    spacing = float((x[-1] - x[0]) / place[-1]) if place[-1] > 0 else spacing
    place = np.round((x - x[0]) / spacing)
    off = np.abs((x - x[0]) / spacing - place)
    if off.max() > 10.0 * UNEVEN or np.median(off) > UNEVEN or np.diff(place).min() < 1:
        worst = int(np.argmax(off))
        raise InputError(
            f"{name} is not equally spaced: the mean spacing is {spacing:.6g} m, but the point at"
            f" {x[worst]:.6g} m is off by {off[worst]:.2g} of it; put the profile on equally spaced"
            " points first, such as the nodes of an interface:"
            " st.read_profile(..., interface=..., interpolate=True)"
        )
    return int(place[-1]) + 1, spacing


def _check(record: Record) -> None:
    values, known = record.values, record.measured
    if np.isinf(values).any():
        raise InputError(f"must be finite; entry {int(np.argmax(np.isinf(values.ravel())))} is not")
    if known.sum() < FEWEST:
        raise InputError(
            f"holds {int(known.sum())} measured points, too short for a spectrum: at least"
            f" {FEWEST} are needed, and about ten correlation lengths"
        )
    if min(values.shape) < 8:
        raise InputError(f"must have at least 8 points in each direction, got {values.shape}")
    measured = values[known]
    if np.ptp(measured) <= 1e-12 * np.abs(measured).max():
        raise InputError(f"is constant, {measured[0]:g} everywhere; there is nothing to fit")
    middle = float(np.median(measured))
    far = np.abs(values - middle) > OUTLYING * 1.4826 * float(np.median(np.abs(measured - middle)))
    if np.median(np.abs(measured - middle)) > 0.0 and far.any():
        first = np.argwhere(far)[0]
        places = zip("xy", record.starts, first, record.spacings, strict=False)
        at = ", ".join(f"{name} = {start + i * step:.6g} m" for name, start, i, step in places)
        warn_accuracy(
            f"{int(far.sum())} of {measured.size} values are outliers, more than {OUTLYING:g}"
            f" robust standard deviations from the median, such as {values[tuple(first)]:.4g} at"
            f" {at}; if they are not real, make them NaN: missing values are left out"
        )
