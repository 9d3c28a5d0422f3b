"""The misfit between a simulated rupture and gauge records, after the best shift in time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.profiles.units import factor_to

if TYPE_CHECKING:
    import xarray as xr

UNITS = {"slip": "m", "slip_rate": "m/s", "shear_stress": "Pa"}
"""Quantities that can be compared."""
FEWEST = 5
"""Fewest times of a record from which a misfit is computed."""


class Misfit(NamedTuple):
    """Distance of a simulated rupture from a record.

    Attributes
    ----------
    misfit : float
        Root of the mean square difference over the root of the mean square of the record, all
        gauges together: 0 is perfect, 1 as bad as a record of zeros.
    time_shift : float
        Shift, s, that is added to the times of the record.
    by_gauge : (gauges,) array
        The misfit of each gauge alone, at the common shift.
    """

    misfit: float
    time_shift: float
    by_gauge: Array


def misfit(run: xr.Dataset, measured: xr.DataArray, *, align: bool = True) -> Misfit:
    """Return the misfit between a simulated rupture on a line and gauge records.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`, with stations at the gauges, or with the measured quantity
        among its fields and frames dense enough in time.
    measured : xarray.DataArray
        Over 'time' (s) and 'x' (m), named 'slip', 'slip_rate' or 'shear_stress', in SI
        units or in the units of its attributes. NaN where nothing was recorded.
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
    If every gauge has a station within half a node spacing, records at every step are compared;
    otherwise frames, interpolated linearly between nodes. Both are interpolated linearly in
    time, and constant before the first and after the last. The search starts from every shift
    that puts the steepest point of the record on a step or frame, and refines the best three.
    """
    times, values, places, kind = _checked(measured)
    clock, simulated = _at_gauges(run, kind, places)
    weight = np.nansum(values**2, axis=0)
    if not weight.sum() > 0.0:
        raise InputError("measured: is zero throughout; there is nothing to compare")

    def squares(shift: float) -> Array:
        model = [np.interp(times + shift, clock, own) for own in simulated.T]
        return np.asarray(np.nansum((np.stack(model, axis=1) - values) ** 2, axis=0))

    shift = 0.0
    if align:
        shift = _best_shift(lambda shift: squares(shift).sum(), clock, times, values)
    own = squares(shift)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_gauge = np.sqrt(own / weight)
    return Misfit(float(np.sqrt(own.sum() / weight.sum())), shift, by_gauge)


def _best_shift(
    squares: Callable[[float], float], clock: Array, times: Array, values: Array
) -> float:
    """Return the shift with the least sum of squares."""
    slope = np.abs(np.diff(np.nan_to_num(values), axis=0)).sum(axis=1) / np.diff(times)
    steepest = int(slope.argmax())
    starts = clock - 0.5 * (times[steepest] + times[steepest + 1])
    order = np.argsort([squares(shift) for shift in starts])
    step, gaps = float(np.diff(times).min()), np.diff(clock)
    found = []
    for first in order[:3]:
        reach = max(10.0 * step, gaps[max(0, first - 2) : first + 1].max())
        bounds = starts[first] - reach, starts[first] + reach
        found.append(minimize_scalar(squares, bounds=bounds, options={"xatol": 1e-4 * step}))
    return float(min(found, key=lambda one: one.fun).x)


def _checked(record: Any) -> tuple[Array, Array, Array, str]:
    """Return times, values (times, gauges) and places of a record, SI, and its quantity."""
    kind, dims = str(getattr(record, "name", None)), getattr(record, "dims", ())
    if kind not in UNITS or "time" not in dims or "x" not in record.coords:
        raise InputError(
            f"measured: must be a DataArray named one of {', '.join(UNITS)}, over a dimension"
            f" 'time' (s), with a coordinate 'x' (m); got {kind!r} over {', '.join(dims)}"
        )
    if "x" not in record.dims:
        record = record.expand_dims("x")
    record = record.transpose("time", "x")

    def si(part: xr.DataArray, unit: str) -> Array:
        scale = factor_to(unit, str(part.attrs["units"])) if "units" in part.attrs else 1.0
        return scale * np.asarray(part.values, dtype=np.float64)

    times, values = si(record["time"], "s"), si(record, UNITS[kind])
    if times.size < FEWEST or not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise InputError(
            f"measured: needs at least {FEWEST} times, finite and rising; got {times.size}"
        )
    if np.isinf(values).any() or not np.isfinite(values).any(axis=0).all():
        raise InputError("measured: every gauge needs finite values, and NaN in its gaps")
    return times, values, si(record["x"], "m"), kind


def _at_gauges(run: xr.Dataset, kind: str, places: Array) -> tuple[Array, Array]:
    """Return moments, s, and the quantity at the gauges then, (moments, gauges)."""
    if "x" not in getattr(run, "dims", ()) or "y" in run.dims:
        raise InputError("run: must be the Dataset of a rupture on a line")
    x = np.asarray(run["x"].values, dtype=np.float64)
    spacing = x[1] - x[0]
    length = x.size * spacing
    outside = places[~((places >= 0.0) & (places <= length))]
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
    values = [[np.interp(place, x, row, period=length) for row in field] for place in places]
    return np.asarray(run["time"].values, dtype=np.float64), np.stack(values, axis=1)
