"""How far is a simulated rupture from what gauges recorded, after the best shift in time?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, prefixed
from stiction.model import FilePath, Flag, checked, describe
from stiction.tables import read_table
from stiction.units import factor_to

if TYPE_CHECKING:
    import xarray as xr

UNITS = {"slip": "m", "slip_rate": "m/s", "shear_stress": "Pa", "strain": "1"}
"""What can be compared; strain is that along the interface, of the upper solid's face."""
FEWEST = 5
FINEST = 60
"""Steps of the search for the shift, each with 0.6 times as far to go on either side."""
_HEADING = re.compile(
    r"(?P<what>slip[ _]rate|slip|shear[ _]stress|strain)\s+at\s+(?P<x>[\d.eE+-]+)\s*(?P<unit>\w+)$"
)


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


@checked
def read_record(path: FilePath) -> xr.DataArray:
    """Read a record of gauges from a text file.

    Parameters
    ----------
    path : path
        A table with a heading: ``time [ms]``, then a column for each gauge, such as
        ``slip rate at 30 mm [m/s]``. One quantity a file: slip, slip rate, shear stress or strain.

    Returns
    -------
    xarray.DataArray
        Over ('time', 'x'), in SI units, named by the quantity.

    Raises
    ------
    InputError
        If a unit or a place is missing, or quantities are mixed.
    """
    import xarray as xr

    with prefixed(str(path)):
        table: Any = read_table(path)
    if not next(iter(table.data_vars)).lower().startswith("t"):
        raise InputError(f"{path}: the first column must be the time, with its unit: 'time [ms]'")
    columns: list[Array] = []
    places: list[float] = []
    kinds: list[str] = []
    for name, column in table.data_vars.items():
        unit, values = column.attrs.get("units"), column.values
        if unit is None:
            raise InputError(f"{path}: the unit of {name!r} is not stated; write it in brackets")
        if not columns:
            columns.append(values * factor_to("s", unit))
            continue
        found = _HEADING.match(str(name).strip())
        if found is None:
            raise InputError(
                f"{path}: {name!r} does not say what and where; write 'slip rate at 30 mm [m/s]'"
            )
        kinds.append(found["what"].replace(" ", "_"))
        places.append(float(found["x"]) * factor_to("m", found["unit"]))
        columns.append(values * factor_to(UNITS[kinds[-1]], unit))
    if len(set(kinds)) != 1:
        raise InputError(f"{path}: must hold one quantity, got {', '.join(sorted(set(kinds)))}")
    coordinates = {"time": columns[0], "x": places}
    values = np.stack(columns[1:], axis=1)
    return xr.DataArray(values, coords=coordinates, dims=("time", "x"), name=kinds[0])


def misfit(run: xr.Dataset, measured: xr.DataArray | str | Path, *, align: Flag = True) -> Misfit:
    """Return how far a simulated rupture is from what gauges recorded.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate_rupture`, with stations at the gauges, or with the quantity that was
        measured among its fields ('slip' for strain) and frames dense enough in time.
    measured : xarray.DataArray or path
        Over 'time' (s) and 'x' (m), named 'slip', 'slip_rate', 'shear_stress' or 'strain', in SI
        units or those that its attributes state; or a file for `read_record`. NaN where nothing
        was recorded. Strain is that along the interface on the face of the upper solid, half the
        derivative of slip.
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
    record = read_record(Path(measured)) if isinstance(measured, str | Path) else measured
    kind = str(getattr(record, "name", None))
    if kind not in UNITS:
        raise InputError(
            f"measured: must be a DataArray named one of {', '.join(UNITS)}, got {kind!r}"
        )
    times, values, places = _checked(record)
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
    best, least = 0.0, np.inf
    for start in starts[np.argsort(found)[:3]]:
        shift, reach, lowest = float(start), max(10.0 * step, _gap(clock, start + anchor)), np.inf
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


def _gap(clock: Array, moment: float) -> float:
    """Return the larger distance of a moment from those beside it."""
    i = int(np.clip(np.searchsorted(clock, moment), 1, clock.size - 1))
    return float(np.diff(clock)[max(0, i - 2) : i + 1].max())


def _checked(record: xr.DataArray) -> tuple[Array, Array, Array]:
    """Return times, values (times, gauges) and places of a record, SI."""
    if "time" not in record.dims or "time" not in record.coords or "x" not in record.coords:
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
        raise InputError("measured: every gauge needs finite values; nan where none was recorded")
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
            f" check its unit, got {describe(places.tolist())}"
        )
    recorded = f"station_{kind}"
    if recorded in run:
        away = np.abs(run["station_x"].values - places[:, None])
        nearest = away.argmin(axis=1)
        if np.all(away.min(axis=1) <= 0.5 * spacing * (1.0 + 1e-9)):
            values = run[recorded].transpose("step", "station").values[:, nearest]
            return run["step_time"].values, values
    name = "slip" if kind == "strain" else kind
    if name not in run or "x" not in run[name].dims:
        raise InputError(
            f"run: holds no {name} at the gauges; give save=st.Save([{name!r}]), or stations at "
            "the gauges, to st.simulate_rupture"
        )
    field = np.asarray(run[name].transpose("time", "x").values, dtype=np.float64)
    if kind == "strain":
        waves = 2.0j * np.pi * np.fft.rfftfreq(x.size, spacing)
        waves[-1] = 0.0  # the highest wave of the grid has no derivative
        field = 0.5 * np.fft.irfft(waves * np.fft.rfft(field, axis=1), x.size, axis=1)
    around = np.concatenate([x, [length]])
    closed = np.concatenate([field, field[:, :1]], axis=1)
    values = np.stack([[np.interp(p, around, row) for row in closed] for p in places], axis=1)
    return np.asarray(run["time"].values, dtype=np.float64), values
