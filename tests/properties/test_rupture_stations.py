"""Stations: what fields show at their nodes, after every step, and nothing else changes."""

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.dynamics.save import open_rupture

pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0)
FRICTION = st.LinearWeakening(weakening_rate=3e11, residual_strength=2e5)
LINE = st.Problem(SOLID, st.Interface(length=0.04, nodes=64), FRICTION)
PLANE = st.Problem(SOLID, st.Interface(length=(0.04, 0.03), nodes=(40, 36)), FRICTION)
METHOD = st.Rupture(loading_rate=1e8)
RECORDED = {"station_slip": "slip", "station_slip_rate": "slip_rate"} | {
    "station_shear_stress": "shear_stress"
}


def strength(problem):
    places = np.meshgrid(*problem.interface.coordinates.values(), indexing="ij")
    return 1e6 - 3e5 * np.exp(-sum(((place - 0.012) / 0.007) ** 2 for place in places))


CASES = {
    "line": (LINE, {"weak": 0.012, "far": 0.0304}, (19, 49)),
    "plane": (PLANE, {"weak": (0.012, 0.012), "far": (0.0302, 0.0201)}, ((12, 14), (30, 24))),
}


@pytest.fixture(scope="module", params=list(CASES))
def case(request):
    problem, stations, nodes = CASES[request.param]
    run = st.simulate_rupture(
        problem, strength(problem), method=METHOD, save=st.Save(every=1, stations=stations),
        progress=False,
    )  # fmt: skip
    return problem, stations, nodes, run


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
    options = {"method": METHOD, "progress": False}
    plain, recorded = (
        st.simulate_rupture(problem, strength(problem), save=save, **options)
        for save in (st.Save([], every=50), st.Save([], every=50, stations=stations))
    )
    assert set(recorded.variables) - set(plain.variables) == {
        *RECORDED, "station", *(f"station_{d}" for d in problem.interface.dims)
    }  # fmt: skip
    assert plain.identical(recorded[list(plain.variables)])
    for name in RECORDED:
        assert np.array_equal(recorded[name], run[name])


def test_a_restart_records_the_rest_to_the_bit(case, tmp_path):
    problem, stations, _, run = case
    save = st.Save(stations=stations, to=tmp_path / "run")
    short = st.Rupture(loading_rate=1e8, max_steps=60)
    for method in (short, METHOD):
        st.simulate_rupture(
            problem, strength(problem), method=method, save=save, progress=False
        )
    streamed = open_rupture(tmp_path / "run", fields=())
    assert len(list((tmp_path / "run").glob("frames-*.nc"))) > 1
    for name in (*RECORDED, "step_time"):
        assert np.array_equal(streamed[name], run[name])
    streamed.to_netcdf(tmp_path / "whole.nc")
    with xr.open_dataset(tmp_path / "whole.nc") as read:
        assert read.station.values.tolist() == list(stations)


@pytest.mark.parametrize(
    ("problem", "stations", "text"),
    [
        (LINE, {"a": 7.5}, r"stations\['a'\]: \(7.5,\) is not on the interface of 0.04 m"),
        (LINE, {"a": (0.01, 0.01)}, "give x in m"),
        (PLANE, {"a": 0.01}, "give x and y in m"),
        (PLANE, {"a": (0.01, np.nan)}, "must be a finite number, got nan"),
        (PLANE, {"a": (-0.01, 0.0)}, "from the first node"),
        (LINE, {3: 0.01}, "stations.*must be .*got 3"),
        (LINE, [0.01], "stations: must be a valid dictionary"),
    ],
)
def test_stations_that_are_no_places_are_refused(problem, stations, text):
    def simulate():
        save = st.Save(stations=stations)
        st.simulate_rupture(problem, strength(problem), method=METHOD, save=save)

    with pytest.raises(st.InputError, match=text):
        simulate()
