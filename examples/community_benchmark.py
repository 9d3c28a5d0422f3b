"""The test problem of Day, Dalguer, Lapusta and Liu (2005), run by the community as TPV3.

A fault of 30 km by 15 km between two half-spaces, unbreakable outside, held by a strength of
81.24 MPa that falls to 63.0 MPa over 0.40 m of slip. It carries 70.0 MPa, and 81.6 MPa in a square
of 3 km in its middle, which breaks at once. When does the rupture arrive where?

    python examples/community_benchmark.py                    200 m, some seconds
    python examples/community_benchmark.py --spacing 100      about a minute, 0.4 GB of memory
    python examples/community_benchmark.py --convergence      200, 150 and 100 m side by side
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import stiction as st

KM = 1e3
SOLID = st.Solid(shear_modulus=2670.0 * 3464.0**2, poisson_ratio=0.25, density=2670.0)
STRENGTH, RESIDUAL, CRITICAL_SLIP = 81.24e6, 63.0e6, 0.40
NORMAL = -120.0e6  # compression is negative
AROUND, INSIDE = 70.0e6, 81.6e6
FAULT, SQUARE = (30 * KM, 15 * KM), 3 * KM
PERIOD = (60 * KM, 42 * KM)  # images of the fault are 27 km away: 4.5 s for the fastest waves
BROKEN = (
    1e-3  # fraction of the strength lost, at 0.4 mm of slip: soon after a point begins to slip
)
STATIONS = {"along the slip": (7.5, 0.0), "across it": (0.0, 6.0), "oblique": (7.5, 4.5)}  # km
RECORDED = ["slip", "slip_rate", "shear_stress"]


class Found(NamedTuple):
    """Places from the middle of the fault (m), times of rupture (s), and the whole result."""

    x: np.ndarray
    y: np.ndarray
    rupture_time: np.ndarray
    run: xr.Dataset


def benchmark(spacing: float) -> tuple[st.Problem, np.ndarray]:
    """The problem and its peak strength (Pa) on nodes `spacing` (m) apart."""
    nodes = tuple(round(length / spacing) for length in PERIOD)
    ends = [
        (0.5 * (side - fault), 0.5 * (side + fault))
        for side, fault in zip(PERIOD, FAULT, strict=True)
    ]
    plane = st.Interface(length=PERIOD, nodes=nodes, extent=ends)
    places = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    x, y = (np.abs(place - side / 2) for place, side in zip(places, PERIOD, strict=True))
    # A node represents its cell. Half of the cell of a node on the edge lies in the square.
    inside = [np.clip((SQUARE / 2 - away) / spacing + 0.5, 0.0, 1.0) for away in (x, y)]
    initial = AROUND + (INSIDE - AROUND) * inside[0] * inside[1]
    friction = st.LinearWeakening(critical_slip=CRITICAL_SLIP, residual_strength=RESIDUAL)
    load = st.Load(initial_stress=initial)
    return st.Problem(SOLID, plane, friction, load), np.full(nodes, STRENGTH)


def simulate(spacing: float, end_time: float = 9.0) -> Found:
    """Run it, with a record of every step at the stations."""
    problem, tau_p = benchmark(spacing)
    middle = np.array(PERIOD) / 2
    none = ([0.0, 100.0], [0.0, 0.0])  # the initial stress is all there is
    method = st.Rupture(
        load_history=none, implicit=False, stop="time", end_time=end_time, arrival=BROKEN
    )
    stations = {name: middle + KM * np.array(at) for name, at in STATIONS.items()}
    save = st.Save(RECORDED, every=1000, stations=stations)  # of the frames the first is used
    run = st.simulate_rupture(problem, tau_p, method=method, save=save)
    x, y = (run[dim].values - length / 2 for dim, length in zip("xy", PERIOD, strict=True))
    return Found(x, y, run.arrival_time.values, run)


def at_axes(found: Found, distances: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Rupture times (s) at distances (m) from the middle along x and along y, by straight lines."""
    i, j = np.argmin(abs(found.x)), np.argmin(abs(found.y))
    along = np.interp(distances, found.x, found.rupture_time[:, j])
    across = np.interp(distances, found.y, found.rupture_time[i])
    return along, across


def draw(found: Found, title: str) -> Figure:
    """Rupture-time contours, and slip rate and stress at the stations."""
    figure = Figure(figsize=(6.75, 7.6), layout="constrained")
    upper, lower, lowest = figure.subplots(3, 1, height_ratios=[1.3, 1.0, 1.0])
    levels = np.arange(0.5, np.nanmax(found.rupture_time), 0.5)
    places = found.x / KM, found.y / KM
    lines = upper.contour(*places, found.rupture_time.T, levels, cmap="viridis")
    upper.clabel(lines, levels[1::2], fmt="%.0f s")
    upper.set(xlim=(-15.5, 15.5), ylim=(-8, 8), aspect="equal", title=title)
    upper.set(xlabel="$x$, along the slip (km)", ylabel="$y$ (km)")
    for name, (a, b) in STATIONS.items():
        label = f"{name}, ({a:g}, {b:g}) km"
        record = found.run.sel(station=name)
        (line,) = lower.plot(record.step_time, record.station_slip_rate, label=label)
        lowest.plot(record.step_time, record.station_shear_stress / 1e6)
        upper.plot(a, b, "^", color=line.get_color())
    lower.set(ylabel="slip rate (m/s)")
    lowest.set(xlabel="time (s)", ylabel="shear stress (MPa)")
    lower.legend()
    return figure


def report(spacing: float, out: Path) -> None:
    """One run: figure, files as the community exchanges them, a few lines."""
    found = simulate(spacing)
    along, across = at_axes(found, [3 * KM, 6 * KM, 7.5 * KM, 9 * KM, 12 * KM])
    print(f"{spacing:g} m: rupture time (s) at 3, 6, 7.5 km")
    print("  along x:", *along[:3].round(3), " 9, 12 km:", *along[3:].round(3))
    print("  along y:", *across[:3].round(3))
    for name in STATIONS:
        record = found.run.sel(station=name)
        top, slip = float(record.station_slip_rate.max()), float(record.station_slip[-1])
        print(f"  {name}: peak slip rate {top:.2f} m/s, slip at the end {slip:.2f} m")
    files = out / f"{spacing:g}m"  # as the community exchanges them
    origin = np.array(PERIOD) / 2
    st.external.write_scec(
        found.run, files, origin=origin, normal_stress=NORMAL, benchmark="TPV3"
    )
    figure = draw(found, f"rupture time, nodes {spacing:g} m apart")
    figure.savefig(out / f"community_benchmark_{spacing:g}m.png", dpi=200)


def main() -> None:
    """Read the options and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spacing", type=float, default=200.0, help="between nodes, m")
    parser.add_argument("--convergence", action="store_true", help="200, 150 and 100 m")
    parser.add_argument("--out", type=Path, default=Path())
    options = parser.parse_args()
    for spacing in (200.0, 150.0, 100.0) if options.convergence else (options.spacing,):
        report(spacing, options.out)


if __name__ == "__main__":
    main()
