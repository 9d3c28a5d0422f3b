"""Records: measured values at equal distances, on a line or a plane, with their gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.model import describe, real_array
from stiction.profiles import MEASURED, UNITS, is_labelled, points_of, simplified
from stiction.units import factor_to

FEWEST = 64
"""Measured points below which a record says nothing of a spectrum."""
UNEVEN = 0.02
"""Of a spacing: what rounding in a file may move a point."""
OUTLYING = 8.0
"""Times the robust standard deviation: where a value is called an outlier."""
LONGEST_NAMED = 3


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


def records_of(
    profiles: Any, interface: Interface | None, quantity: str, skip_gaps: bool
) -> list[Record]:
    """All profiles as records; errors name the profile and the place.

    Parameters
    ----------
    profiles : array, DataArray or sequence of them
        See `stiction.fit_field`.
    interface : Interface, optional
        Says how far the points of plain arrays are apart.
    quantity : str
        One of `stiction.profiles.UNITS`.
    skip_gaps : bool
        Whether missing values are left out or refused.
    """
    several = isinstance(profiles, list | tuple) and not _is_row(profiles)
    found: list[Record] = []
    problems: list[str] = []
    for number, one in enumerate(profiles if several else [profiles]):
        name = f"profiles[{number}]" if several else "profiles"
        try:
            for record in _records(one, interface, quantity):
                _check(record, skip_gaps)
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


def _is_row(values: Sequence[Any]) -> bool:
    return len(values) > 0 and all(isinstance(value, int | float | np.number) for value in values)


def _records(source: Any, interface: Interface | None, quantity: str) -> list[Record]:
    source = simplified(source, quantity)
    if isinstance(source, str) or hasattr(source, "__fspath__"):
        raise InputError(f"read the file first: st.read_profile({str(source)!r}, ...)")
    if is_labelled(source):
        dims = {str(dim) for dim in source.dims}
        return _of_map(source, quantity) if "y" in dims else _of_line(source, interface, quantity)
    try:
        array = real_array(source)
    except TypeError as error:
        raise InputError(f"must be numbers; {error}") from None
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


def _of_line(source: Any, interface: Interface | None, quantity: str) -> list[Record]:
    points = points_of(source, quantity)
    rows = np.atleast_2d(points.values)
    if points.measured is not None:  # what was filled in is no measurement
        rows = np.where(points.measured, rows, np.nan)
    if points.places:
        x = points.places["x"]
        place, spacing = evenly(x)
        full = np.full((rows.shape[0], int(place[-1]) + 1), np.nan)
        full[:, place] = rows[:, np.argsort(x, kind="stable")]
        return [Record(row, (spacing,), (float(x.min()),)) for row in full]
    if interface is None or rows.shape[1:] != interface.shape:
        raise InputError(
            "has no coordinate 'x' (m), so that nobody knows how far its points are apart; give it"
            " one, or an interface with as many nodes"
        )
    return [Record(row, interface.spacings, (0.0,)) for row in rows]


def _of_map(source: Any, quantity: str) -> list[Record]:
    if hasattr(source, "data_vars"):
        raise InputError(f"is a Dataset; give one of its variables: {', '.join(source.data_vars)}")
    samples = [dim for dim in source.dims if dim not in ("x", "y")]
    if "x" not in source.dims or len(samples) > 1:
        raise InputError(
            f"a map needs the dimensions 'x' and 'y', and at most one of samples, got"
            f" ({', '.join(map(str, source.dims))})"
        )
    source = source.transpose(*samples, "x", "y")
    stated = str(source.attrs.get("units", source.attrs.get("unit", ""))).strip()
    values = real_array(source.values) * (factor_to(UNITS[quantity], stated) if stated else 1.0)
    if MEASURED in source.coords:
        values = np.where(source.coords[MEASURED].broadcast_like(source), values, np.nan)
    values = values.reshape(-1, *values.shape[-2:])
    spacings, starts, places = [], [], []
    for dim in ("x", "y"):
        if dim not in source.coords:
            raise InputError(f"has no coordinate {dim!r} (m)")
        unit = str(source[dim].attrs.get("units", "m"))
        at = real_array(source[dim].values) * factor_to("m", unit)
        place, spacing = evenly(at, dim)
        spacings.append(spacing)
        starts.append(float(at.min()))
        places.append((place, np.argsort(at, kind="stable")))
    (px, ox), (py, oy) = places
    full = np.full((values.shape[0], int(px[-1]) + 1, int(py[-1]) + 1), np.nan)
    full[:, px[:, None], py[None, :]] = values[:, ox[:, None], oy[None, :]]
    return [Record(one, tuple(spacings), tuple(starts)) for one in full]


def evenly(x: Array, name: str = "x") -> tuple[NDArray[np.int64], float]:
    """Places 0, 1, ... of sorted points at equal distances, some of which may be missing.

    Raises
    ------
    InputError
        If points repeat or lie at unequal distances.
    """
    if not np.all(np.isfinite(x)):
        raise InputError(f"{name} must be finite; entry {int(np.argmin(np.isfinite(x)))} is not")
    x = np.sort(x)
    steps = np.diff(x)
    if steps.size == 0:
        raise InputError(f"{name} has a single point")
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
            f"{name} is not equally spaced: {spacing:.6g} m apart on the whole, but {x[worst]:.6g}"
            f" m lies {off[worst]:.2g} of that beside its place; put the profile on equally spaced"
            " points first, such as the nodes of an interface:"
            " st.read_profile(..., interface=..., interpolate=True)"
        )
    return place.astype(np.int64), spacing


def _check(record: Record, skip_gaps: bool) -> None:
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
    if not known.all() and not skip_gaps:
        raise InputError(
            f"there {_gaps(record)}; a fit leaves them out if you say so (gaps='skip', --gaps"
            " skip): nothing is filled in"
        )
    _warn_of_outliers(record, measured)


def _gaps(record: Record) -> str:
    missing = ~record.measured
    count = f"{int(missing.sum())} of {missing.size} points"
    if missing.ndim == 2:
        x, y = np.argwhere(missing)[0]
        at = [s + i * d for s, i, d in zip(record.starts, (x, y), record.spacings, strict=True)]
        return f"are no values (NaN) at {count}, first at x = {at[0]:.6g} m, y = {at[1]:.6g} m"
    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False]))))
    spans = edges.reshape(-1, 2) - np.array([0, 1])
    place = record.starts[0] + spans * record.spacings[0]
    named = ", ".join(
        f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in place[:LONGEST_NAMED]
    )
    more = f" and {len(place) - LONGEST_NAMED} more gaps" * (len(place) > LONGEST_NAMED)
    return f"are no values (NaN) at x = {named}{more} ({count})"


def _warn_of_outliers(record: Record, measured: Array) -> None:
    middle = float(np.median(measured))
    deviation = 1.4826 * float(np.median(np.abs(measured - middle)))
    far = np.abs(record.values - middle) > OUTLYING * deviation
    if deviation <= 0.0 or not far.any():
        return
    first = np.argwhere(far)[0]
    at = ", ".join(
        f"{name} = {s + i * d:.6g} m"
        for name, s, i, d in zip("xy", record.starts, first, record.spacings, strict=False)
    )
    warn_accuracy(
        f"{int(far.sum())} of {measured.size} values are outliers, more than {OUTLYING:g} robust"
        f" standard deviations from the median, such as {record.values[tuple(first)]:.4g} at {at};"
        " if they are not real, make them NaN and fit with gaps='skip'"
    )


def check_quantity(quantity: Any) -> None:
    """Refuse what is no profile."""
    if not isinstance(quantity, str) or quantity not in UNITS:
        raise InputError(f"quantity: must be one of {', '.join(UNITS)}, got {describe(quantity)}")
