"""Ruptures as text files of the SCEC code comparison: one for each station, and rupture times."""

from pathlib import Path
from typing import Any

import numpy as np

from stiction.base.errors import InputError

STATION_UNITS = {"slip": 1.0, "slip_rate": 1.0, "shear_stress": 1e6}
"""Variables of a station, and their units in a file in SI."""
UNBROKEN_TIME = 1e9
"""Rupture time of nodes that do not break in files of the comparison, s."""
COLUMN_TITLES = ("slip (m)", "slip rate (m/s)", "shear stress (MPa)")
COLUMN_NAMES = "t h-slip h-slip-rate h-shear-stress v-slip v-slip-rate v-shear-stress n-stress"


def write_scec(
    run: Any, folder: Any, *, origin: Any, normal_stress: float, benchmark: str
) -> list[Path]:
    """Write stations and rupture times of a run in the SCEC format (Harris et al., 2009).

    The direction along strike is x, the direction of slip, and the direction
    down-dip is y. On lines y is 0. Slip has no vertical component.

    Parameters
    ----------
    run : xarray.Dataset
        Result of `simulate_rupture` with slip, slip rate and shear stress, and
        with stations.
    folder : path
    origin : float or (float, float)
        Origin of distances on the interface, m.
    normal_stress : float
        Normal stress, Pa, negative in compression.
    benchmark : str
        Name of the problem, for the headers: "TPV3", or a name of your own.

    Returns
    -------
    list of pathlib.Path
        A file for each station, such as ``faultst075dp045.txt`` for 7.5 km along
        strike and 4.5 km down-dip, and ``cplot.txt`` with the distances j and k
        (m) and the rupture time t (s), 1e9 for nodes that do not break.

    Raises
    ------
    InputError
        If the run has no stations or lacks a variable.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=1.0).sample(problem.interface)[0]
    >>> save = st.Save(fields=["slip", "slip_rate", "shear_stress"], stations={"a": 0.03})
    >>> method = st.Rupture(loading_rate=1e8)
    >>> run = st.simulate_rupture(problem, tau_p, method=method, save=save, progress=False)
    >>> import tempfile
    >>> folder = tempfile.mkdtemp()
    >>> options = {"origin": 0.05, "normal_stress": -5e6, "benchmark": "block 7"}
    >>> files = st.external.write_scec(run, folder, **options)
    >>> files[-1].name
    'cplot.txt'
    """
    lacking = [
        name
        for variable in STATION_UNITS
        for name in (variable, f"station_{variable}")
        if name not in run
    ]
    if lacking:
        raise InputError(
            f"run: lacks {', '.join(lacking)}. Call st.simulate_rupture with save=st.Save("
            f"{list(STATION_UNITS)}, stations=...)"
        )
    dims = run.arrival_time.dims
    middle = dict(zip(dims, np.atleast_1d(origin).tolist(), strict=True))
    away = [run[dim].values - middle[dim] for dim in dims] + [np.zeros(1)] * (2 - len(dims))
    size = " x ".join(f"{float(axis[1] - axis[0]):g}" for axis in away[: len(dims)])
    about = f"# problem={benchmark}\n# code=stiction\n# element_size={size} m\n"
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in run.station.values:
        record = run.sel(station=name)
        place = {dim: float(record[f"station_{dim}"]) for dim in dims}
        j, k, *_ = [place[dim] - middle[dim] for dim in dims] + [0.0]
        # The record begins after the first step. The first frame is the state
        # before it.
        start = run.isel(time=0).sel(place, method="nearest")
        time = np.append(start.time, record.step_time)
        shown = [
            np.append(start[n], record[f"station_{n}"]) / unit
            for n, unit in STATION_UNITS.items()
        ]
        still = np.zeros_like(time)
        columns = [time, *shown, still, still, still, still + 1e-6 * normal_stress]
        header = (
            f"{about}# num_time_steps={time.size}\n# location={j:g} m along strike, {k:g} m"
        )
        header += " down-dip\n# Column #1 = time (s)\n"
        titles = [
            f"{way} {text}" for way in ("horizontal", "vertical") for text in COLUMN_TITLES
        ]
        titles.append("normal stress (MPa), compression negative")
        header += "".join(f"# Column #{i} = {text}\n" for i, text in enumerate(titles, 2))
        header += COLUMN_NAMES
        paths.append(target / f"faultst{j / 100.0:03.0f}dp{k / 100.0:03.0f}.txt")
        np.savetxt(
            paths[-1], np.column_stack(columns), "%21.13e" + 7 * " %15.7e", header=header,
            comments="",
        )  # fmt: skip
    # Unbroken nodes need a number in the format.
    times = np.nan_to_num(run.arrival_time.values, nan=UNBROKEN_TIME).ravel()
    places = [grid.ravel() for grid in np.meshgrid(*away, indexing="ij")]
    paths.append(target / "cplot.txt")
    header = (
        f"{about}# Column #1, #2 = distance along strike, down-dip (m)\n# Column #3 = rupture"
    )
    header += " time (s)\nj k t"
    np.savetxt(
        paths[-1], np.column_stack([*places, times]), "%15.7e", header=header, comments=""
    )
    return paths
