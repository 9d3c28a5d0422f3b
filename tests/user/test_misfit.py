"""The misfit of a simulated rupture: arithmetic on made-up runs, and records of stations."""

import numpy as np
import pytest
import xarray as xr
from refusals import refuses

import stiction as st
from stiction.statistics import misfit

LENGTH, NODES = 0.1, 200
X = np.arange(NODES) * LENGTH / NODES
CLOCK = np.concatenate([np.linspace(0.0, 0.9e-3, 40), np.linspace(0.901e-3, 1.2e-3, 300)])


def slip_at(x, t):
    """A front that passes x at 0.001 + x/1000 s, 20 us wide."""
    return 1e-6 * (1.0 + np.tanh((t - 1e-3 - x / 1000.0) / 2e-5))


RUN = xr.Dataset(
    {"slip": (("time", "x"), slip_at(X[None, :], CLOCK[:, None]))},
    coords={"time": CLOCK, "x": X},
)


def record(shift=0.0, scale=1.0, places=(0.03, 0.05), name="slip"):
    times = np.linspace(0.0, 0.2e-3, 150)
    places = np.array(places)
    values = scale * slip_at(places[None, :], times[:, None] + 0.97e-3 + shift)
    return xr.DataArray(
        values, coords={"time": times, "x": places}, dims=("time", "x"), name=name
    )


@pytest.mark.parametrize("shift", [-3e-5, 0.0, 4.4e-5])
def test_a_shifted_record_fits_and_its_shift_is_found(shift):
    found = misfit(RUN, record(shift))
    # Frames 1 us apart for a front of 20 us, linear in between: 1e-3 of the slip.
    assert found.misfit < 2e-3
    assert found.time_shift == pytest.approx(0.97e-3 + shift, abs=1e-7)
    assert found.by_gauge.shape == (2,)


def test_without_alignment_times_are_those_of_the_run():
    own = record().assign_coords(time=np.linspace(0.0, 0.2e-3, 150) + 0.97e-3)
    assert misfit(RUN, own, align=False).misfit < 2e-3
    assert misfit(RUN, record(), align=False).misfit == pytest.approx(1.0, abs=0.01)


def test_what_is_measured_half_as_large_is_off_by_its_own_size():
    own = record(scale=0.5).assign_coords(time=np.linspace(0.0, 0.2e-3, 150) + 0.97e-3)
    assert misfit(RUN, own, align=False).misfit == pytest.approx(1.0, abs=2e-3)


def test_units_gaps_and_single_gauges():
    stated = record() * 1e6
    stated.attrs["units"] = "um"
    stated.name = "slip"
    assert misfit(RUN, stated).misfit < 2e-3
    holes = record()
    holes[10:20, 0] = np.nan
    assert misfit(RUN, holes).misfit < 2e-3
    assert misfit(RUN, record().isel(x=0)).by_gauge.shape == (1,)


MISTAKES = {
    "one of slip ... 'speed'": (RUN, record(name="speed")),
    "holds no slip_rate": (RUN, record(name="slip_rate")),
    "x = 30 m ... unit": (RUN, record(places=(30.0, 50.0))),
    "at least 5": (RUN, record()[:3]),
    "zero throughout": (RUN, record(scale=0.0)),
    "rising": (RUN, record()[::-1]),
    "measured ... DataArray": (RUN, [1, 2, 3]),
    "run ... Dataset": (record().rename(x="place"), record()),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes(words):
    refuses(words, lambda: misfit(*MISTAKES[words]))


def test_records_of_stations_are_compared_where_gauges_have_them():
    """Every step, and not frames that are too far apart to show the front."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    friction = st.LinearWeakening(weakening_rate=0.2e12)
    problem = st.Problem(solid, st.Interface(length=0.05, nodes=128), friction)
    tau_p = 1e6 - 2e5 * np.cos(2 * np.pi * np.arange(128) / 128)
    save = st.Save(["slip_rate"], every=100, stations={"a": 0.01, "b": 0.0302})
    method = st.Rupture(loading_rate=1e8)
    run = st.simulate_rupture(problem, tau_p, method=method, save=save, progress=False)
    measured = xr.DataArray(
        run.station_slip_rate.values[-400:] * 1.0,
        coords={"time": run.step_time.values[-400:], "x": [0.01, 0.0302]},
        dims=("time", "x"), name="slip_rate",
    )  # fmt: skip
    assert misfit(run, measured, align=False).misfit == 0.0
    found = misfit(run, measured.assign_coords(time=measured.time - 3e-6))
    assert found.misfit < 1e-3
    assert found.time_shift == pytest.approx(3e-6, rel=1e-3)
    frames = run.drop_vars(["station_slip_rate"])
    assert misfit(frames, measured, align=False).misfit > 0.01
