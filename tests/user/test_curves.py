"""Measured curves: peak, precursors and plateau, by hand and back from predicted ones."""

import shutil
from pathlib import Path

import astropy.units as u
import numpy as np
import pandas as pd
import pytest
from recording import refusals
from refusals import refuses
from setups import beta_strength
from specimens import crooked

import stiction as st
from stiction.inference.agreement import summary_of
from stiction.inference.curves import Curves, noise_of, turning_points
from stiction.inference.peaks import make_peaks

FILES = Path(__file__).parents[1] / "files"
RNG = np.random.default_rng(0)
TRAVEL = np.linspace(0.0, 1e-3, 2001)  # m


def machine(travel=TRAVEL, noise=0.0, seed=0):
    """200 N/mm; drops of 12, 5 and 30 N at 0.2, 0.35 and 0.6 mm; then sliding at 73 N."""
    force = 2e5 * travel - 12.0 * (travel > 2e-4) - 5.0 * (travel > 3.5e-4)
    force = np.where(travel > 6e-4, 73.0, force)
    return force + noise * np.random.default_rng(seed).standard_normal(travel.size)


def is_machine(curve, noise):
    assert curve.peak == pytest.approx(103.0, abs=4.0 * noise + 0.11)
    assert curve.peak_travel == pytest.approx(6e-4, abs=1e-6 + 2e-5 * (noise > 0.0))
    np.testing.assert_allclose(curve.drops.travel, [2e-4, 3.5e-4], atol=1e-6 + 1e-5 * noise)
    np.testing.assert_allclose(curve.drops.size, [12.0, 5.0], atol=0.11 + 5.0 * noise)
    np.testing.assert_allclose(curve.drops.force, [40.0, 58.0], atol=0.11 + 4.0 * noise)
    assert curve.plateau == pytest.approx(73.0, abs=0.1 * noise + 1e-9)
    return True


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_what_a_curve_says(noise):
    force = machine(noise=noise)
    (curve,) = st.read_curve((TRAVEL * 1e3 * u.mm, force * u.N))
    assert is_machine(curve, noise)
    assert curve.noise == pytest.approx(noise, rel=0.1, abs=1e-9)
    assert "2 precursors from 40" in str(curve)
    assert len(curve.drops) == 2
    assert curve == st.read_curve((TRAVEL * 1e3 * u.mm, force * u.N))[0]
    assert "plateau 73 N" in str(curve)
    stress = st.read_curve((TRAVEL, force * 1e3), unit="Pa", travel_unit="m")
    assert stress[0].drops.size == pytest.approx(curve.drops.size * 1e3)


def test_noise_and_false_drops():
    """A constant force has no drop in 19 of 20 records of 5,000 readings."""
    white = RNG.standard_normal((200, 5000))
    threshold = 2.0 * np.sqrt(2.0 * np.log(5000))
    drops = [turning_points(row, threshold)[0].size for row in white]
    assert np.mean(np.array(drops) > 0) < 0.1
    assert np.mean([noise_of(row) for row in white]) == pytest.approx(1.0, rel=0.01)
    steps = np.round(np.linspace(0.0, 50.0, 5000))  # in steps of 1
    assert noise_of(steps) == pytest.approx(12.0**-0.5)
    starts, ends = turning_points(np.array([0.0, 2.0, 1.0, 3.0, 1.0, 1.5, 0.5, 4.0]), 1.2)
    assert (starts.tolist(), ends.tolist()) == ([3], [6])


def test_files_of_testing_machines(tmp_path):
    """Tests in a column, apart by empty lines, in a folder, over time, of a table of pandas."""
    folder = tmp_path / "tests"
    folder.mkdir()
    refuses("no file", lambda: st.read_curve(folder))
    for name in ("a.csv", "b.txt"):
        shutil.copy(FILES / "curve_din_headings.csv", folder / name)
    (folder / "remarks.md").write_text("ground with 400")
    sources = {folder: ["a", "b"]}
    for file in ("curve_two_tests", "curve_numbered"):
        sources[FILES / f"{file}.csv"] = [f"{file}, test 1", f"{file}, test 2"]
    for source, names in sources.items():
        curves = st.read_curve(source)
        assert [curve.name for curve in curves] == names
        assert curves.peaks == pytest.approx([65.0, 65.0])
    assert is_machine(st.read_curve(FRAME, speed=1e-4)[0], 0.0)
    assert is_machine(st.read_curve(FRAME * [1.0, -1.0], speed=1e-4)[0], 0.0)
    both = pd.DataFrame({"a (s)": TRAVEL * 1e4, "b (mm)": 1e3 * TRAVEL, "load (N)": machine()})
    assert is_machine(st.read_curve(both)[0], 0.0)  # of two columns without a name
    forces = (k * machine() * u.N for k in (1, 2, 3))
    several = [st.read_curve((TRAVEL, force), travel_unit="m")[0] for force in forces]
    peaks = make_peaks(Curves(tuple(several)))
    assert (peaks.unit, peaks.values[0].tolist()) == ("N", [c.peak for c in several])


FRAME = pd.DataFrame({"time (s)": TRAVEL * 1e4, "load (N)": machine()})
SPIKED = np.where(TRAVEL[700] == TRAVEL, 180.0, machine(noise=0.1))


def read(force, **options):
    return st.read_curve((TRAVEL, force), unit="N", travel_unit="m", **options)[0]


test_a_doubtful_curve_is_told = refusals("curves", globals())
BLOCKS = crooked(
    nodes=128, height=0.05, weakening_rate=0.2e12, residual=0.2e6, load=st.Load(),
    drive=st.Pusher(height=0.01, width=0.004, stiffness=2e7),
)  # fmt: skip
FIELD = beta_strength(4e-3)


@pytest.fixture(scope="module")
def paths():
    loads = np.linspace(0.0, 1.2e6, 400)
    rows = FIELD.sample(BLOCKS.interface, samples=6, seed=1)
    return [st.equilibrium_path(BLOCKS, row, loads) for row in rows]


def curves_of(paths, noise=0.05):
    """What a machine with a load cell of this noise (N) records of predicted paths."""
    tests = []
    for number, path in enumerate(paths):
        travel, force, *_ = st.plot.specimens.curve_of(path)
        known = np.isfinite(travel) & np.isfinite(force)
        travel, force = travel[known], force[known]
        after = np.linspace(travel[-1], 1.2 * travel[-1], 200)[1:]
        at = np.r_[travel, after]
        values = np.r_[force, np.full(after.size, 0.8 * force[-1])]
        values = values + noise * np.random.default_rng(number).standard_normal(at.size)
        tests.append(st.read_curve((at, values), unit="N", travel_unit="m", noise=noise)[0])
    return Curves(tuple(tests))


def test_predicted_curves_come_back_from_a_machine(paths):
    for path, curve in zip(paths, curves_of(paths), strict=True):
        high, drop = path.event_force.values, path.event_force_drop.values
        exact = summary_of(np.stack([high, high - drop], axis=1).ravel(), 2.0)
        # Seven times the noise; events between which the force rises by less than 2 N are one drop.
        assert summary_of(curve.force, 2.0) == pytest.approx(exact, abs=0.35)
        apart = np.abs(curve.drops.travel[:, None] - path.event_travel.values)
        assert apart.min(axis=1).max(initial=0.0) < 1e-6


def test_precursors_agree_with_their_own_prediction_and_not_with_another(paths):
    def predicted(field, events=60, samples=60):
        given = {"method": st.Equilibrium(events=events), "samples": samples, "seed": 5}
        return st.monte_carlo(BLOCKS, field, progress=False, **given)

    curves = curves_of(paths)
    own = predicted(FIELD)
    found = st.statistics.agreement(own, curves, replicates=400)
    assert set(found.p_values) > {"number", "size", "first_load"}
    assert min(found.p_values.values()) > 0.05
    stronger = beta_strength(4e-3, low=0.9e6, high=1.9e6)
    wrong = st.statistics.agreement(predicted(stronger), curves, replicates=400)
    assert wrong.p_values["first_load"] < 0.01
    assert "p-value, first_load" in str(wrong)
    few = predicted(FIELD, events=1, samples=20)
    refuses("keeps 1 of", lambda: st.statistics.agreement(few, curves))
    axes = st.plot.monte_carlo(own, measured=curves)
    assert axes.lines[-1].get_xdata() == pytest.approx(curves.peaks)
    assert axes.lines[-1].get_label() == "6 tests"
    refuses("are in Pa", lambda: st.plot.monte_carlo(own, measured=[1.0, 2.0, 3.0] * u.Pa))


def test_readings_that_are_no_friction():
    """A spike is left out, and noise moves no peak."""
    noise = np.random.default_rng(0).standard_normal((20, 2001))

    assert is_machine(read(SPIKED), 0.1)
    flat = 100.0 * np.tanh(TRAVEL / 2e-4)
    found = [read(flat + row) for row in noise]
    # The largest of hundreds of readings lies 3 standard deviations too
    # high; the parabola is off by the curvature of the top.
    assert np.mean([curve.peak for curve in found]) == pytest.approx(flat.max(), abs=0.25)
    sharp = np.array([read(machine() + 0.3 * row).peak for row in noise])
    errors = np.array([read(machine() + 0.3 * row).peak_error for row in noise])
    assert sharp.mean() == pytest.approx(103.0, abs=4.0 * errors.mean() / 20**0.5 + 0.1)
    assert sharp.std() == pytest.approx(errors.mean(), rel=0.6)  # of 20 records


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_plateaus_of_records_that_end_in_other_ways(noise):
    t = np.linspace(0.0, 100.0, 2000)
    added = noise * np.random.default_rng(0).standard_normal(t.size)
    slides = np.where(t < 50, 2 * t, 70.0)
    again = np.interp(t, [0, 40, 40.1, 60, 60.1, 100], [0, 100, 80, 95, 50, 50])
    for force, plateau in (
        (slides, 70.0),
        (np.where(t > 80, 70 * (1 - (t - 80) / 20), slides), 70.0),  # unloads
        (np.where(t > 50, 70 - 0.2 * (t - 50), slides), 65.0),  # decays from 70 to 60
        (again, 50.0),  # a drop at the peak is arrested
    ):
        curve = st.read_curve((t, force + added), unit="N", travel_unit="s")[0]
        assert curve.plateau == pytest.approx(plateau, abs=0.5)
