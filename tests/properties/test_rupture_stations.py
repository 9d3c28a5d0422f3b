"""Stations: what fields show at their nodes, after every step, and nothing else changes."""

import numpy as np
import pandas as pd
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


def test_files_of_a_line_read_back(tmp_path):
    """Times count from the onset, and stations a node apart have files of their own."""
    stations = {"a": 0.0131, "b": 0.004}
    run = simulate(LINE, stations=stations, fields=["slip", "slip_rate", "shear_stress"])
    about = {"origin": 0.004, "normal_stress": -7e6, "benchmark": "block"}
    path, other, contours = st.external.write_scec(run, tmp_path, **about)
    rows, table = (pd.read_csv(one, comment="#", sep=r"\s+") for one in (path, contours))
    assert path.name == "faultst000.0001dp000.0000.txt"
    assert other.name == "faultst000.0000dp000.0000.txt"
    onset = float(run.onset_time)
    assert onset > 0.0
    assert rows["t"][0] == 0.0
    assert rows.columns[1:4].tolist() == ["h-slip", "h-slip-rate", "h-shear-stress"]
    assert rows["n-stress"].to_numpy() == pytest.approx(-7.0)
    own = run.sel(station="a")
    own = own.isel(step=own.step_time >= onset)
    np.testing.assert_allclose(rows["h-slip"], own.station_slip, rtol=1e-6)
    np.testing.assert_allclose(
        rows["h-shear-stress"] * 1e6, own.station_shear_stress, rtol=1e-6
    )
    np.testing.assert_allclose(table["j"], run.x - 0.004, atol=1e-9)
    np.testing.assert_allclose(table["t"], (run.arrival_time - onset).fillna(1e9), rtol=1e-6)
    with pytest.raises(st.InputError, match="lacks station_slip. Call st.simulate_rupture"):
        st.external.write_scec(run.drop_vars("station_slip"), tmp_path, **about)
    with pytest.raises(st.InputError, match="normal_stress: must be negative"):
        st.external.write_scec(run, tmp_path, **(about | {"normal_stress": 7e6}))
    run["station_x"] = run.station_x * 0.0
    with pytest.raises(st.InputError, match="the stations a, b are not"):
        st.external.write_scec(run, tmp_path, **about)


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
