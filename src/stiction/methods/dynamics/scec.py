"""Ruptures as text files for the SCEC code comparison: stations and rupture times."""

from pathlib import Path
from typing import Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.model import FilePath, Real, Text, checked

STATION_UNITS = {"slip": 1.0, "slip_rate": 1.0, "shear_stress": 1e6}
"""Variables of a station, and their units in a file in SI."""
UNBROKEN_TIME = 1e9
"""Rupture time of nodes that do not break in files of the comparison, s."""
COLUMN_TITLES = (
    "time (s)",
    "horizontal slip (m)", "horizontal slip rate (m/s)", "horizontal shear stress (MPa)",
    "vertical slip (m)", "vertical slip rate (m/s)", "vertical shear stress (MPa)",
    "normal stress (MPa), compression negative",
)  # fmt: skip
MOST_DECIMALS = 9
"""Decimals of places in names of files, in units of 100 m, that tell
stations on a grid apart."""
COLUMN_NAMES = "t h-slip h-slip-rate h-shear-stress v-slip v-slip-rate v-shear-stress n-stress"


@checked
def write_scec(
    run: Any, folder: FilePath, *, origin: Any, normal_stress: Real, benchmark: Text
) -> list[Path]:
    """Write stations and rupture times of a run in the SCEC format (Harris et al., 2009).

    The direction along strike is x, the direction of slip, and the
    direction down-dip is y. On lines y is 0. Slip has no vertical
    component. Times count from the onset of the first event of the run,
    and records begin there.

    Parameters
    ----------
    run : xarray.Dataset
        Result of `simulate_rupture` with slip, slip rate and shear
        stress, and with stations.
    folder : path
    origin : float or (float, float)
        Origin of distances on the interface, m.
    normal_stress : float
        Normal stress, Pa, zero or negative (compression).
    benchmark : str
        Name of the problem, for the headers: "TPV3", or a name of your own.

    Returns
    -------
    list of pathlib.Path
        A file for each station, such as ``faultst075dp045.txt``
        for 7.5 km along strike and 4.5 km down-dip, and
        ``cplot.txt`` with the distances j and k (m) and the
        rupture time t (s), 1e9 for nodes that do not break.
        Names have decimals of 100 m if stations are closer.

    Raises
    ------
    InputError
        If the run has no stations or lacks a variable, if stations
        have the same node, if the normal stress is positive, or if the
        origin has not one finite number for each dimension.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=1.0).sample(
    ...     problem.interface
    ... )[0]
    >>> save = st.Save(
    ...     fields=["slip", "slip_rate", "shear_stress"], stations={"a": 0.03}
    ... )
    >>> method = st.Rupture(loading_rate=1e8)
    >>> run = st.simulate_rupture(
    ...     problem, tau_p, method=method, save=save, progress=False
    ... )
    >>> import tempfile
    >>> folder = tempfile.mkdtemp()
    >>> options = {"origin": 0.05, "normal_stress": -5e6, "benchmark": "block 7"}
    >>> files = st.external.write_scec(run, folder, **options)
    >>> files[-1].name
    'cplot.txt'

    A run by hand: the onset is at 1.5 s, before both steps and after the first
    frame. The station lies 100 m from the origin.

    >>> import xarray as xr
    >>> fields = {name: (("time", "x"), np.zeros((2, 3))) for name in STATION_UNITS}
    >>> values = {
    ...     "slip": [1.0, 2.0],
    ...     "slip_rate": [3.0, 4.0],
    ...     "shear_stress": [5e6, 6e6],
    ... }
    >>> fields |= {
    ...     f"station_{n}": (("step", "station"), np.c_[v])
    ...     for n, v in values.items()
    ... }
    >>> fields |= {"arrival_time": ("x", [np.nan, 2.0, 3.5]), "onset_time": 1.5}
    >>> places = {
    ...     "x": [0.0, 100.0, 200.0],
    ...     "station": ["a"],
    ...     "station_x": ("station", [100.0]),
    ... }
    >>> run = xr.Dataset(
    ...     fields, places | {"time": [1.0, 1.8], "step_time": ("step", [1.6, 2.0])}
    ... )
    >>> options = {"origin": 0.0, "normal_stress": -5e6, "benchmark": "own"}
    >>> record, plot = write_scec(run, folder, **options)
    >>> for line in (record.name, *record.read_text().splitlines()[:5]):
    ...     print(line)
    faultst001dp000.txt
    # problem=own
    # code=stiction
    # element_size=100 m
    # num_time_steps=2
    # location=100 m along strike, 0 m down-dip
    >>> np.loadtxt(record, comments=("#", "t")).round(9).tolist()
    [[0.1, 1.0, 3.0, 5.0, 0.0, 0.0, 0.0, -5.0], [0.5, 2.0, 4.0, 6.0, 0.0, 0.0, 0.0, -5.0]]
    >>> np.loadtxt(plot, comments=("#", "j")).tolist()
    [[0.0, 0.0, 1000000000.0], [100.0, 0.0, 0.5], [200.0, 0.0, 2.0]]
    >>> run = run.drop_vars("onset_time")  # then times count from the first frame
    >>> record, _ = write_scec(run, folder, **options)
    >>> np.loadtxt(record, comments=("#", "t"))[:, :2].round(9).tolist()
    [[0.0, 0.0], [0.6, 1.0], [1.0, 2.0]]
    """
    needed = [*STATION_UNITS, *(f"station_{name}" for name in STATION_UNITS)]
    if lacking := [name for name in needed if name not in getattr(run, "data_vars", ())]:
        raise InputError(
            f"run: lacks {', '.join(lacking)}. Call st.simulate_rupture with save=st.Save("
            f"{list(STATION_UNITS)}, stations=...)"
        )
    if not normal_stress <= 0.0:
        raise InputError(
            f"normal_stress: must be negative (compression) or zero, got {normal_stress!r}."
            " If this is a pressure, change its sign"
        )
    dims = run.arrival_time.dims
    numbers = np.atleast_1d(origin)
    if numbers.shape != (len(dims),) or not np.isfinite(numbers).all():
        raise InputError(
            f"origin: must be a finite number (m) for each of {', '.join(dims)}, got {origin!r}"
        )
    middle = dict(zip(dims, numbers.tolist(), strict=True))
    away = [run[dim].values - middle[dim] for dim in dims] + [np.zeros(1)] * (2 - len(dims))
    size = " x ".join(f"{float(axis[1] - axis[0]):g}" for axis in away[: len(dims)])
    about = [f"# problem={benchmark}", "# code=stiction", f"# element_size={size} m"]
    target = Path(folder)
    places = [
        ([float(at[f"station_{dim}"]) - middle[dim] for dim in dims] + [0.0])[:2]
        for at in (run.sel(station=name) for name in run.station.values)
    ]
    files = _file_names(places, run.station.values.tolist())
    # Times count from the first event or onset, or else from the start.
    known = [run[name].values.ravel() for name in ("event_time", "onset_time") if name in run]
    onsets = np.concatenate([*known, [np.nan]])
    begin = float(np.nanmin(onsets) if np.isfinite(onsets).any() else run.time[0])
    target.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, file, (j, k) in zip(run.station.values, files, places, strict=True):
        record = run.sel(station=name)
        place = {dim: float(record[f"station_{dim}"]) for dim in dims}
        # The record begins after the first step. The first frame is the
        # state before it.
        start = run.isel(time=0).sel(place, method="nearest")
        time = np.append(start.time, record.step_time) - begin
        recorded = time >= 0.0
        time = time[recorded]
        shown = [
            np.append(start[n], record[f"station_{n}"])[recorded] / unit
            for n, unit in STATION_UNITS.items()
        ]
        still = np.zeros_like(time)
        columns = [time, *shown, still, still, still, still + 1e-6 * normal_stress]
        header = [
            *about,
            f"# num_time_steps={time.size}",
            f"# location={j:g} m along strike, {k:g} m down-dip",
            *(f"# Column #{i} = {title}" for i, title in enumerate(COLUMN_TITLES, 1)),
            COLUMN_NAMES,
        ]
        paths.append(target / file)
        _write_table(paths[-1], header, columns, "%21.13e" + 7 * " %15.7e")
    # Unbroken nodes need a number in the format.
    times = np.nan_to_num(run.arrival_time.values - begin, nan=UNBROKEN_TIME).ravel()
    nodes = [grid.ravel() for grid in np.meshgrid(*away, indexing="ij")]
    paths.append(target / "cplot.txt")
    distances = "# Column #1, #2 = distance along strike, down-dip (m)"
    header = [*about, distances, "# Column #3 = rupture time (s)", "j k t"]
    _write_table(paths[-1], header, [*nodes, times], "%15.7e")
    return paths


def _write_table(path: Path, header: list[str], columns: list[Any], form: str) -> None:
    """Write columns below the lines of a header.

    >>> import sys
    >>> columns = [np.array([1.0, 2.0]), np.array([0.5, 7.0])]
    >>> _write_table(sys.stdout, ["# about", "a b"], columns, "%.1f")
    # about
    a b
    1.0 0.5
    2.0 7.0
    """
    np.savetxt(path, np.column_stack(columns), form, header="\n".join(header), comments="")


def _file_names(places: list[list[float]], stations: list[str]) -> list[str]:
    """Return file names with as few decimals as distinguish the places along both axes (m).

    >>> _file_names([[7500.0, 4500.0], [-2000.0, -30.0]], ["a", "b"])
    ['faultst075dp045.txt', 'faultst-20dp000.txt']
    >>> _file_names([[7500.0, 4500.0], [7520.0, 4500.0]], ["a", "b"])
    ['faultst075.0dp045.0.txt', 'faultst075.2dp045.0.txt']
    >>> _file_names(
    ...     [[7.0, 4.0], [1.0, 4.0], [7.0, 4.0]], ["a", "b", "c"]
    ... )  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: run: some of the stations a, c share a node, ...
    """
    for decimals in range(MOST_DECIMALS + 1):
        width = 3 if decimals == 0 else 4 + decimals
        texts = [
            # Adding zero leaves no negative zero.
            [f"{round(at / 100.0, decimals) + 0.0:0{width}.{decimals}f}" for at in place]
            for place in places
        ]
        names = [f"faultst{along}dp{down}.txt" for along, down in texts]
        if len(set(names)) == len(names):
            return names
    twins = [name for name, file in zip(stations, names, strict=True) if names.count(file) > 1]
    raise InputError(
        f"run: some of the stations {', '.join(twins)} share a node, after which their files would"
        " be named. Place each station at a different node"
    )
