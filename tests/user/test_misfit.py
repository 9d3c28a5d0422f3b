"""The misfit of a simulated rupture: arithmetic on made-up runs, and records of stations."""

import numpy as np
import pytest
import xarray as xr
from refusals import refusals
from setups import make_problem

import stiction as st
from stiction.statistics import misfit

X = np.arange(200) * 0.1 / 200
CLOCK = np.concatenate([np.linspace(0.0, 0.9e-3, 40), np.linspace(0.901e-3, 1.2e-3, 300)])
START = 0.97e-3


def slip_at(x, t):
    """A front that passes x at 0.001 + x/1000 s, 20 us wide."""
    return 1e-6 * (1.0 + np.tanh((t - 1e-3 - x / 1000.0) / 2e-5))


def history(values, times, places, name="slip"):
    return xr.DataArray(values, {"time": times, "x": places}, ("time", "x"), name=name)


PLACES = np.array([0.03, 0.05])
RUN = xr.Dataset(
    {"station_slip": (("step", "station"), slip_at(PLACES, CLOCK[:, None]))},
    coords={"step_time": ("step", CLOCK), "station_x": ("station", PLACES), "x": X},
)


def record(shift=0.0, scale=1.0, places=(0.03, 0.05), name="slip", begin=0.0):
    times, places = np.linspace(0.0, 0.2e-3, 150), np.array(places)
    values = scale * slip_at(places, times[:, None] + START + shift)
    return history(values, times + begin, places, name)


@pytest.mark.parametrize("shift", [-3e-5, 0.0, 4.4e-5])
def test_a_shifted_record_fits_and_its_shift_is_found(shift):
    found = misfit(RUN, record(shift))
    # Steps 1 us apart for a front of 20 us, linear in between: 1e-3 of the slip.
    assert found.misfit < 2e-3
    assert found.time_shift == pytest.approx(START + shift, abs=1e-7)
    assert found.by_gauge.shape == (2,)


def test_without_alignment_times_are_those_of_the_run():
    assert misfit(RUN, record(begin=START), align=False).misfit < 2e-3
    assert misfit(RUN, record(), align=False).misfit == pytest.approx(1.0, abs=0.01)
    # What is measured half as large is off by its own size.
    half = misfit(RUN, record(scale=0.5, begin=START), align=False)
    assert half.misfit == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("seed", [23, 29, 49, 53, 58])
def test_the_shift_is_found_between_steps_of_any_length(seed):
    """A run that is linear between few steps, and its own values, with noise, at shifted times."""
    rng = np.random.default_rng(seed)
    clock = np.cumsum(rng.exponential(3e-5, 40) + 1e-6)
    values = np.cumsum(
        rng.exponential(1e-6, (40, 2)) * np.hypot(1.0, 30.0 * (clock > 4e-4))[:, None], axis=0
    )
    run = RUN.isel(step=slice(40)).assign_coords(step_time=("step", clock))
    run = run.assign(station_slip=(("step", "station"), values))
    times, shift = np.linspace(0.0, 2e-4, 400), rng.uniform(2e-4, 8e-4)
    measured = np.stack([np.interp(times + shift, clock, own) for own in values.T], axis=1)
    measured += rng.uniform(-1e-6, 1e-6, measured.shape)  # steepest anywhere
    found = misfit(run, history(measured, times, PLACES))
    assert found.time_shift == pytest.approx(shift, abs=5e-7)


def test_units_gaps_and_single_gauges():
    stated = (record() * 1e6).assign_attrs(units="um").rename("slip")
    assert misfit(RUN, stated).misfit < 2e-3
    holes = record()
    holes[10:20, 0] = np.nan
    assert misfit(RUN, holes).misfit < 2e-3
    assert misfit(RUN, record().isel(x=0)).by_gauge.shape == (1,)


test_mistakes = refusals({
    "one of slip ... 'speed'": lambda: misfit(RUN, record(name="speed")),
    "run ... with stations": lambda: misfit(RUN, record(name="slip_rate")),
    "x = 30 m ... unit": lambda: misfit(RUN, record(places=(30.0, 50.0))),
    "at least 5": lambda: misfit(RUN, record()[:3]),
    "zero throughout": lambda: misfit(RUN, record(scale=0.0)),
    "rising": lambda: misfit(RUN, record()[::-1]),
    "measured ... DataArray": lambda: misfit(RUN, [1, 2, 3]),
    "run ... Dataset": lambda: misfit(record().rename(x="place"), record()),
})  # fmt: skip


def test_records_of_stations_are_compared():
    problem = make_problem(128, 0.05, weakening_rate=0.2e12)
    tau_p = 1e6 - 2e5 * np.cos(2 * np.pi * np.arange(128) / 128)
    save = st.Save(["slip_rate"], every=100, stations={"a": 0.01, "b": 0.0302})
    run = st.simulate_rupture(problem, tau_p, method=st.Rupture(loading_rate=1e8), save=save)
    rates, times = run.station_slip_rate.values[-400:], run.step_time.values[-400:]
    measured = history(rates, times, [0.01, 0.0302], "slip_rate")
    assert misfit(run, measured, align=False).misfit == 0.0
    found = misfit(run, measured.assign_coords(time=measured.time - 3e-6))
    assert found.misfit < 1e-3
    assert found.time_shift == pytest.approx(3e-6, rel=1e-3)
