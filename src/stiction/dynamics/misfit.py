"""The misfit between a simulated rupture and gauge records, after the best shift in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.units import factor_to

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
        From `simulate_rupture`, with a station within half a node spacing of every gauge.
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
        If a gauge has no station, or the record is too short, unsorted or all zero.

    Notes
    -----
    Between steps the run is interpolated linearly in time; before the first and after the last it
    is constant. The search starts from the best of the shifts that put the steepest point of the
    record on a step.
    """
    times, values, places, kind = _checked(measured)
    clock, simulated = _at_gauges(run, kind, places)
    weight = np.nansum(values**2, axis=0)
    if not weight.sum() > 0.0:
        raise InputError("measured: is zero throughout; there is nothing to compare")

    def squares(shift: float) -> Array:
        model = [np.interp(times + shift, clock, own) for own in simulated.T]
        return np.asarray(np.nansum((np.stack(model, axis=1) - values) ** 2, axis=0))

    def total(shift: float) -> float:
        return float(squares(shift).sum())

    shift = 0.0
    if align:
        slope = np.abs(np.diff(np.nan_to_num(values), axis=0)).sum(axis=1) / np.diff(times)
        steepest, step = int(slope.argmax()), float(np.diff(times).min())
        starts = clock - 0.5 * (times[steepest] + times[steepest + 1])
        first = int(np.argmin([total(start) for start in starts]))
        reach = max(10.0 * step, np.diff(clock)[max(0, first - 2) : first + 1].max())
        bounds = starts[first] - reach, starts[first] + reach
        shift = float(minimize_scalar(total, bounds=bounds, options={"xatol": 1e-4 * step}).x)
    own = squares(shift)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_gauge = np.sqrt(own / weight)
    return Misfit(float(np.sqrt(own.sum() / weight.sum())), shift, by_gauge)


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
    rising = np.isfinite(times).all() and np.all(np.diff(times) > 0.0)
    known = not np.isinf(values).any() and np.isfinite(values).any(axis=0).all()
    if times.size < FEWEST or not (rising and known):
        raise InputError(
            f"measured: needs at least {FEWEST} times, finite and rising, and in every gauge finite"
            f" values, with NaN in its gaps; got {times.size} times"
        )
    return times, values, si(record["x"], "m"), kind


def _at_gauges(run: xr.Dataset, kind: str, places: Array) -> tuple[Array, Array]:
    """Return the times of steps, s, and the quantity at the gauges then, (steps, gauges)."""
    if f"station_{kind}" not in run or "y" in run.dims:
        raise InputError("run: must be the Dataset of a rupture on a line, with stations")
    x = run["x"].values
    away = np.abs(run["station_x"].values - places[:, None])
    missed = away.min(axis=1) > 0.5 * (x[1] - x[0]) * (1.0 + 1e-9)
    if missed.any():
        raise InputError(
            f"run: has no station at the gauge at x = {places[missed][0]:g} m; give its place to"
            " st.Save(stations=...), and check its unit"
        )
    recorded = run[f"station_{kind}"].transpose("step", "station").values
    return run["step_time"].values, recorded[:, away.argmin(axis=1)]
