"""The misfit of a simulated rupture: arithmetic on made-up runs, and a sweep that finds d_c."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.dynamics.misfit import read_record
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
    return xr.DataArray(values, coords={"time": times, "x": places}, dims=("time", "x"), name=name)


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


def test_strain_is_half_the_derivative_of_slip():
    wave = 2.0 * np.pi / LENGTH
    growth = np.linspace(0.0, 1.0, 60)
    run = xr.Dataset(
        {"slip": (("time", "x"), 1e-6 * growth[:, None] * np.sin(wave * X)[None, :])},
        coords={"time": np.linspace(0.0, 1e-3, 60), "x": X},
    )
    times = np.linspace(0.0, 1e-3, 60)
    strain = 0.5e-6 * wave * growth[:, None] * np.cos(wave * np.array([[0.02, 0.06]]))
    measured = xr.DataArray(
        strain, coords={"time": times, "x": [0.02, 0.06]}, dims=("time", "x"), name="strain"
    )
    assert misfit(run, measured, align=False).misfit < 1e-9


def write(path, text):
    path.write_text(text)
    return path


def test_a_record_from_a_file(tmp_path):
    text = "time [us], slip rate at 30 mm [mm/s], slip rate at 5 cm [mm/s]\n0,1,2\n10,3,4\n"
    found = read_record(write(tmp_path / "gauges.csv", text))
    assert found.name == "slip_rate"
    np.testing.assert_allclose(found.x, [0.03, 0.05])
    np.testing.assert_allclose(found.time, [0.0, 1e-5])
    np.testing.assert_allclose(found, [[1e-3, 2e-3], [3e-3, 4e-3]])


BAD = {
    "no such quantity": (
        lambda: misfit(RUN, record(name="speed")),
        ["one of slip", "'speed'"],
    ),
    "not in the run": (
        lambda: misfit(RUN, record(name="slip_rate")),
        ["holds no slip_rate"],
    ),
    "gauge elsewhere": (
        lambda: misfit(RUN, record(places=(30.0, 50.0))),
        ["x = 30 m", "unit"],
    ),
    "too short": (lambda: misfit(RUN, record()[:3]), ["at least 5"]),
    "zero": (lambda: misfit(RUN, record(scale=0.0)), ["zero throughout"]),
    "unsorted": (lambda: misfit(RUN, record()[::-1]), ["rising"]),
    "a table": (lambda: misfit(RUN, [1, 2, 3]), ["measured", "DataArray"]),
    "no run": (lambda: misfit(record(), record()), ["run", "Dataset"]),
}


@pytest.mark.parametrize("name", BAD)
def test_mistakes(name):
    call, texts = BAD[name]
    with pytest.raises(st.InputError) as caught:
        call()
    for text in texts:
        assert text in str(caught.value)


FILES = {
    "no unit of time": ("time, slip at 3 mm [um]\n0,1\n1,2\n", "unit of 'time'"),
    "no place": ("time [us], slip [um]\n0,1\n1,2\n", "what and where"),
    "mixed": ("time [us], slip at 3 mm [um], strain at 4 mm [1]\n0,1,1\n1,2,2\n", "one quantity"),
    "wrong unit": ("time [us], slip at 3 mm [MPa]\n0,1\n1,2\n", "no unit of length"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_not_taken(name, tmp_path):
    text, part = FILES[name]
    with pytest.raises(st.InputError, match=part):
        read_record(write(tmp_path / "gauges.csv", text))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_a_sweep_in_a_study_file_finds_the_critical_slip(tmp_path):
    """The record is of a run with d_c = 2 um: in the sweep that one fits best."""
    problem = st.paper.problem(nodes=512)
    rates = st.LinearWeakening(critical_slip=2e-6)
    problem = dataclasses.replace(problem, friction=rates)
    strength = st.paper.strength(st.paper.problem(nodes=512), correlation_ratio=2.0)
    tau_p = strength.sample(problem.interface, seed=3)[0]
    run = st.simulate_rupture(
        problem, tau_p, method=st.Rupture(loading_rate=2e7), every=5, progress=False
    )
    onset = run.onset_time.item()
    part = run.slip.sel(time=slice(onset - 5e-5, onset + 1.5e-4)).isel(x=[150, 300])
    lines = ["time [us], slip at 29.296875 mm [um], slip at 58.59375 mm [um]"]
    lines += [
        f"{1e6 * (t - onset) + 50.0:.4f},{1e6 * a:.5f},{1e6 * b:.5f}"
        for t, (a, b) in zip(part.time.values, part.values, strict=True)
    ]
    write(tmp_path / "gauges.csv", "\n".join(lines) + "\n")
    study = st.Study(
        problem=problem,
        random=strength,
        method=st.RuptureMisfit(loading_rate=2e7, record=tmp_path / "gauges.csv"),
        ensemble=st.Ensemble(samples=1, seed=3),
        sweep=[{"problem.friction.critical_slip": [1.6e-6, 2e-6, 2.4e-6]}],
    )
    study.to_toml(tmp_path / "study.toml")
    found = st.Study.from_toml(tmp_path / "study.toml").run(progress=False)
    assert found.misfit.isel(sample=0).argmin().item() == 1
    # Frames and digits of the file.
    assert found.misfit.isel(sample=0, critical_slip=1).item() < 0.01
