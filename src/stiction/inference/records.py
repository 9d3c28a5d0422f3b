"""Records: measured values at equal distances, on a line or a plane, with their gaps."""

from typing import Any, NamedTuple

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


class Record(NamedTuple):
    """Values at equal distances.

    Attributes
    ----------
    values : (n,) or (nx, ny) array
        SI; NaN where nothing was measured.
    spacings : tuple of float
        Distance of points along each direction, m.
    """

    values: Array
    spacings: tuple[float, ...]

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Where there is a value."""
        return np.isfinite(self.values)


def records_of(profiles: Any, interface: Interface | None, quantity: str) -> list[Record]:
    """All profiles as records, see `stiction.fit_field`; errors name the profile and the place."""
    several = isinstance(profiles, list | tuple) and not (
        profiles and all(map(np.isscalar, profiles))
    )
    found: list[Record] = []
    problems: list[str] = []
    for number, one in enumerate(profiles if several else [profiles]):
        name = f"profiles[{number}]" if several else "profiles"
        try:
            own = _records(one, interface, quantity)
            for record in own:
                _check(record)
            found += own
        except InputError as error:
            problems += [f"{name}: {text}" for text in error.problems]
    if not found:
        problems = problems or ["profiles: none were given"]
    elif len({record.values.ndim for record in found}) > 1:
        problems.append("profiles: are of lines and of planes; fit them one after the other")
    if problems:
        raise InputError(problems)
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
    return [Record(one, tuple(spacings)) for one in full]


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
    if shape not in (array.shape, array.shape[1:]):
        raise InputError(
            f"must have shape {shape} or (samples, {', '.join(map(str, shape))}) on this"
            f" interface, got shape {array.shape}"
        )
    return [Record(row, interface.spacings) for row in array.reshape(-1, *shape)]


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
        raise InputError(f"{name} repeats: there are two values at {x[steps.argmin()]:.9g} m")
    last = np.round((x[-1] - x[0]) / spacing)
    spacing = float((x[-1] - x[0]) / last)
    place = (x - x[0]) / spacing
    off = np.abs(place - np.round(place))
    if (
        off.max() > 10.0 * UNEVEN
        or np.median(off) > UNEVEN
        or np.diff(np.round(place)).min() < 1
    ):
        raise InputError(
            f"{name} is not equally spaced: the mean spacing is {spacing:.6g} m, but the point at"
            f" {x[off.argmax()]:.6g} m is off by {off.max():.2g} of it; first put the profile on"
            " the nodes of an interface: st.read_profile(..., interface=..., interpolate=True)"
        )
    return int(last) + 1, spacing


def _check(record: Record) -> None:
    values = record.values[~np.isnan(record.values)]
    if np.isinf(values).any():
        first = int(np.argmax(np.isinf(record.values.ravel())))
        raise InputError(f"must be finite; entry {first} is not")
    if values.size < FEWEST:
        raise InputError(
            f"holds {values.size} measured points, too short for a spectrum: at least {FEWEST} are"
            " needed, and about ten correlation lengths"
        )
    if min(record.values.shape) < 8:
        raise InputError(
            f"must have at least 8 points in each direction, got {record.values.shape}"
        )
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise InputError(f"is constant, {values[0]:g} everywhere; there is nothing to fit")
    aside = np.abs(values - np.median(values))
    far = aside > OUTLYING * 1.4826 * np.median(aside)
    if np.median(aside) > 0.0 and far.any():
        warn_accuracy(
            f"{int(far.sum())} of {values.size} values are outliers, more than {OUTLYING:g} robust"
            f" standard deviations from the median, such as {values[aside.argmax()]:.4g}; if they"
            " are not real, make them NaN: missing values are left out"
        )
