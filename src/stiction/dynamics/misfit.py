"""How far is a simulated rupture from what gauges recorded, after the best shift in time?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.units import factor_to

if TYPE_CHECKING:
    import xarray as xr

UNITS = {"slip": "m", "slip_rate": "m/s", "shear_stress": "Pa"}
"""What can be compared."""
FEWEST = 5
FINEST = 60
"""Steps of the search for the shift, each with 0.6 times as far to go on either side."""


class Misfit(NamedTuple):
    """Distance of a simulated rupture from a record.

    Attributes
    ----------
    misfit : float
        Root of the mean square difference over the root of the mean square of the record, all
        gauges together: 0 is perfect, 1 as bad as a record of zeros.
    time_shift : float
        s, added to the times of the record.
    by_gauge : (gauges,) array
        The misfit of each gauge alone, at the common shift.
    """

    misfit: float
    time_shift: float
    by_gauge: Array


def misfit(run: xr.Dataset, measured: xr.DataArray, *, align: bool = True) -> Misfit:
    """Return how far a simulated rupture on a line is from what gauges recorded.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`, with stations at the gauges, or with the quantity that was
        measured among its fields and frames dense enough in time.
    measured : xarray.DataArray
        Over 'time' (s) and 'x' (m), named 'slip', 'slip_rate' or 'shear_stress', in SI units or
        those that its attributes state. NaN where nothing was recorded.
    align : bool
        Shift the record in time for the best fit, the same for all gauges; otherwise its times are
        those of the run.

    Returns
    -------
    Misfit
        `misfit`, `time_shift` (s) and `by_gauge`.

    Raises
    ------
    InputError
        If the run lacks the quantity, a gauge is not on the interface, or the record is too short,
        unsorted or all zero.

    Notes
    -----
    Where every gauge has a station within half a spacing of nodes, the records of its steps are
    compared, else frames, linear between nodes; both are linear in time, and stay as they were
    before the first and after the last. The search begins at every shift that puts the steepest
    moment of the record on a step or frame, and closes in on the best three.
    """
    kind = str(getattr(measured, "name", None))
    if kind not in UNITS:
        raise InputError(
            f"measured: must be a DataArray named one of {', '.join(UNITS)}, got {kind!r}"
        )
    times, values, places = _checked(measured)
    clock, simulated = _at_gauges(run, kind, places)
    held = np.isfinite(values)
    weight = float(np.sum(values[held] ** 2))
    if weight == 0.0:
        raise InputError("measured: is zero throughout; there is nothing to compare")

    def squares(shift: float) -> Array:
        at = times + shift
        model = np.stack([np.interp(at, clock, own) for own in simulated.T], axis=1)
        return np.asarray(np.sum(np.where(held, model - values, 0.0) ** 2, axis=0))

    shift = _best_shift(squares, clock, times, values) if align else 0.0
    own = squares(shift)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_gauge = np.sqrt(own / np.nansum(values**2, axis=0))
    return Misfit(float(np.sqrt(own.sum() / weight)), shift, by_gauge)


def _best_shift(squares: Any, clock: Array, times: Array, values: Array) -> float:
    """Return the shift with the least sum of squares."""
    slope = np.abs(np.diff(np.nan_to_num(values), axis=0)).sum(axis=1) / np.diff(times)
    steepest = int(slope.argmax())
    anchor = 0.5 * (times[steepest] + times[steepest + 1])
    starts = clock - anchor
    found = np.array([squares(shift).sum() for shift in starts])
    step = float(np.diff(times).min())
    gaps = np.diff(clock)
    best, least = 0.0, np.inf
    for first in np.argsort(found)[:3]:
        beside = gaps[max(0, first - 2) : first + 1].max()
        shift, reach, lowest = float(starts[first]), max(10.0 * step, beside), np.inf
        for _ in range(FINEST):
            around = shift + reach * np.linspace(-1.0, 1.0, 9)
            sums = np.array([squares(one).sum() for one in around])
            shift, lowest = float(around[sums.argmin()]), float(sums.min())
            reach *= 0.6
            if reach < 1e-4 * step:
                break
        if lowest < least:
            best, least = shift, lowest
    return best


def _checked(record: xr.DataArray) -> tuple[Array, Array, Array]:
    """Return times, values (times, gauges) and places of a record, SI."""
    if "time" not in record.dims or "x" not in record.coords:
        raise InputError(
            "measured: must have a dimension 'time' with coordinates (s) and a coordinate 'x' (m),"
            f" got dimensions {', '.join(map(str, record.dims))}"
        )
    if "x" not in record.dims:
        record = record.expand_dims("x")
    record = record.transpose("time", "x")

    def si(part: xr.DataArray, unit: str) -> Array:
        scale = factor_to(unit, str(part.attrs["units"])) if "units" in part.attrs else 1.0
        return scale * np.asarray(part.values, dtype=np.float64)

    times, values = si(record["time"], "s"), si(record, UNITS[str(record.name)])
    if times.size < FEWEST:
        raise InputError(f"measured: has {times.size} times, at least {FEWEST} are needed")
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise InputError("measured: its times must be finite and rising")
    if np.isinf(values).any() or not np.isfinite(values).any(axis=0).all():
        raise InputError(
            "measured: every gauge needs finite values; nan where none was recorded"
        )
    return times, values, si(record["x"], "m")


def _at_gauges(run: xr.Dataset, kind: str, places: Array) -> tuple[Array, Array]:
    """Return moments, s, and the quantity at the gauges then, (moments, gauges)."""
    if "x" not in getattr(run, "dims", ()) or "y" in run.dims:
        raise InputError("run: must be the Dataset of a rupture on a line")
    x = np.asarray(run["x"].values, dtype=np.float64)
    spacing = x[1] - x[0]
    length = x.size * spacing
    outside = places[(places < 0.0) | (places > length)]
    if outside.size:
        raise InputError(
            f"measured: a gauge at x = {outside[0]:g} m is not on the interface, 0 to {length:g} m;"
            " check its unit"
        )
    if f"station_{kind}" in run:
        away = np.abs(run["station_x"].values - places[:, None])
        if np.all(away.min(axis=1) <= 0.5 * spacing * (1.0 + 1e-9)):
            recorded = run[f"station_{kind}"].transpose("step", "station").values
            return run["step_time"].values, recorded[:, away.argmin(axis=1)]
    if kind not in run or "x" not in run[kind].dims:
        raise InputError(
            f"run: holds no {kind} at the gauges; give save=st.Save([{kind!r}]), or stations at "
            "the gauges, to st.simulate_rupture"
        )
    field = np.asarray(run[kind].transpose("time", "x").values, dtype=np.float64)
    around = np.concatenate([x, [length]])
    closed = np.concatenate([field, field[:, :1]], axis=1)
    values = np.stack([[np.interp(p, around, row) for row in closed] for p in places], axis=1)
    return np.asarray(run["time"].values, dtype=np.float64), values
