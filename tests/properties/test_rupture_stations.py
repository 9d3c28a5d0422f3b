"""Stations: what fields show at their nodes, after every step, and nothing else changes."""

import numpy as np
import pytest
import xarray as xr
from ruptures import BREAKING_PLANE, dip
from setups import QUARTER, make_problem

import stiction as st
from stiction.methods.dynamics.save import open_rupture

LINE = make_problem(64, 0.04, solid=QUARTER, weakening_rate=3e11, residual_strength=2e5)
METHOD = st.Rupture(loading_rate=1e8)
RECORDED = {f"station_{name}": name for name in ("slip", "slip_rate", "shear_stress")}
CASES = {
    "line": (LINE, {"weak": 0.012, "far": 0.0304}, (19, 49)),
    "plane": (
        BREAKING_PLANE, {"weak": (0.012, 0.012), "far": (0.0302, 0.0201)}, ((12, 14), (30, 24)),
    ),
}  # fmt: skip


def simulate(problem, method=METHOD, **save):
    interface = problem.interface
    strength = 1e6 - 3e5 * dip(interface, [0.012] * len(interface.shape), 0.007)
    save = st.Save(**save)
    return st.simulate_rupture(problem, strength, method=method, save=save, progress=False)


def test_an_end_of_the_interface_is_its_first_node():
    """It is periodic; half a node before the end is its last node."""
    for problem, place, node in (
        (LINE, 0.04, 0), (LINE, 0.03963, 63), (BREAKING_PLANE, (0.04, 0.0124), 15),
        (BREAKING_PLANE, (0.0124, 0.03), 12 * 36),
    ):  # fmt: skip
        assert st.Save(stations={"a": place}).nodes(problem.interface) == node


@pytest.fixture(scope="module", params=list(CASES))
def case(request):
    problem, stations, nodes = CASES[request.param]
    return problem, stations, nodes, simulate(problem, every=1, stations=stations)


def test_stations_show_the_fields_at_their_nodes(case):
    """Frames after every step are the same numbers, but for the first, which no step led to."""
    problem, stations, nodes, run = case
    assert run.station.values.tolist() == list(stations)
    assert np.array_equal(run.step_time, run.time[1:])
    for own, field in RECORDED.items():
        for name, node in zip(stations, nodes, strict=True):
            at_node = run[field].values[(slice(1, None), *np.atleast_1d(node))]
            assert np.array_equal(run[own].sel(station=name), at_node), own
        assert run[own].attrs["units"] == run[field].attrs["units"]
    far = [float(run[f"station_{dim}"][1]) for dim in problem.interface.dims]
    axes = problem.interface.coordinates.values()
    expected = [at[i] for at, i in zip(axes, np.atleast_1d(nodes[1]), strict=True)]
    assert far == pytest.approx(expected)


def test_stations_change_nothing_and_need_no_frames(case):
    problem, stations, _, run = case
    plain = simulate(problem, fields=[], every=50)
    recorded = simulate(problem, fields=[], every=50, stations=stations)
    places = {f"station_{dim}" for dim in problem.interface.dims}
    assert set(recorded.variables) - set(plain.variables) == {*RECORDED, "station"} | places
    assert plain.identical(recorded[list(plain.variables)])
    for name in RECORDED:
        assert np.array_equal(recorded[name], run[name])


def test_a_restart_records_the_rest_to_the_bit(case, tmp_path):
    problem, stations, _, run = case
    for method in (st.Rupture(loading_rate=1e8, max_steps=60), METHOD):
        simulate(problem, method, stations=stations, to=tmp_path / "run")
    streamed = open_rupture(tmp_path / "run", fields=())
    assert len(list((tmp_path / "run").glob("frames-*.nc"))) > 1
    for name in (*RECORDED, "step_time"):
        assert np.array_equal(streamed[name], run[name])
    streamed.to_netcdf(tmp_path / "whole.nc")
    with xr.open_dataset(tmp_path / "whole.nc") as read:
        assert read.station.values.tolist() == list(stations)
