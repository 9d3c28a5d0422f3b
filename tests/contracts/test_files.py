"""Laws of the files that we write: each is read back, and everything that it says is true."""

from __future__ import annotations

import dataclasses
import html
import re
from functools import cache, reduce
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from contracts.bodies import BODIES, FIELD, WITH_ENDS, field_of, profiles_of, world

import stiction as st
from stiction.cli.pages import _inputs, _slip_tests
from stiction.methods.dynamics import scec

pytestmark = pytest.mark.filterwarnings("ignore")
QUIET = {"progress": False}


@cache
def rupture(name: str) -> Any:
    """A rupture with a station, and the place of the station."""
    w = world(name, "rupture")
    place = 0.02 if not w.interface.is_plane else (0.012, 0.008)
    fields = ["slip", "slip_rate", "shear_stress"]
    save = st.Save(fields, stations={"a": place} if not w.problem.specimen else {})
    run = st.simulate_rupture(w.problem, w.profiles(0), method=w.method, save=save, **QUIET)
    return run, place


@pytest.mark.parametrize("name", ["line", "line with ends", "plane with ends"])
def test_a_file_for_scec_holds_what_its_header_says(name, tmp_path):
    run, place = rupture(name)
    origin = np.atleast_1d(place) - 0.0013
    options = {"origin": origin, "normal_stress": -2e6, "benchmark": "a contract"}
    dims, known = run.arrival_time.dims, {"normal_stress": -2e6}
    for file in st.external.write_scec(run, tmp_path, **options):
        lines = file.read_text().splitlines()
        about = dict(
            line[2:].split("=", 1) for line in lines if line[:2] == "# " and "=" in line
        )
        numbers = np.array([row.split() for row in lines if row[0] not in "#tj"], dtype=float)
        if "num_time_steps" in about:
            assert int(about["num_time_steps"]) == len(numbers)
            assert (np.diff(numbers[:, 0]) > 0.0).all()
            for key in ("slip", "slip_rate", "shear_stress"):
                known[key] = np.ravel(run[f"station_{key}"].values)[1 - len(numbers) :]
            known["time"] = run.step_time.values[1 - len(numbers) :] - float(run.onset_time)
            titles = [line.partition(" = ")[2] for line in lines if "Column" in line]
            for title, column in zip(titles, numbers[1:].T, strict=True):
                key = title.partition(" (")[0].removeprefix("horizontal ").replace(" ", "_")
                expected = known.get(key, 0.0) * (
                    1e-6 if "MPa" in title else 1.0
                )  # 0: vertical
                np.testing.assert_allclose(column, expected, rtol=1e-5, atol=1e-12, err_msg=key)
            at = [float(number) for number in re.findall(r"(\S+) m ", about["location"])]
            away = [run[f"station_{dim}"].item() for dim in dims] - origin
            assert at[: len(dims)] == pytest.approx(away, rel=1e-5)
        else:
            nodes = np.meshgrid(*(run[dim].values for dim in dims), indexing="ij")
            for column, grid, start in zip(numbers.T, nodes, origin, strict=False):
                np.testing.assert_allclose(column, grid.ravel() - start, rtol=1e-6, atol=1e-12)
            since = run.arrival_time.values.ravel() - float(run.onset_time)
            np.testing.assert_allclose(numbers[:, -1], np.nan_to_num(since, nan=1e9), rtol=1e-6)
    far = scec._file_names([[7500.0, 4500.0], [-1200.0, 0.0]], ["a", "b"])
    assert far == ["faultst075dp045.txt", "faultst-12dp000.txt"]
    near = scec._file_names([[12.0, 0.0], [8.0, 0.0]], ["a", "b"])
    assert near == ["faultst000.12dp000.00.txt", "faultst000.08dp000.00.txt"]
    for wrong in ({"normal_stress": 2e6}, {"origin": np.inf}, {"origin": (0.0, 0.0, 0.0)}):
        with pytest.raises(st.InputError, match=r"normal_stress|origin"):
            st.external.write_scec(run, tmp_path, **options | wrong)
    with pytest.raises(st.InputError, match="lacks station_slip"):
        st.external.write_scec(run.drop_vars("station_slip"), tmp_path, **options)


@pytest.mark.parametrize("name", WITH_ENDS)
def test_a_run_folder_and_its_exports_hold_the_study(name, tmp_path):
    """A run in two parts, its status, arrays and tables."""
    study = world(name).study
    whole = study.run(pilot=False, **QUIET)
    for part in ("1/2", "2/2"):
        study.run(out=tmp_path / "run", part=part, pilot=False, workers=1, **QUIET)
    run = st.open_run(tmp_path / "run")
    assert run.status().complete
    assert run.dataset().drop_attrs().identical(whole.drop_attrs())
    run.export(tmp_path / "all.nc")
    assert xr.load_dataset(tmp_path / "all.nc").drop_attrs().equals(whole.drop_attrs())
    run.export(tmp_path / "all.csv")
    table = pd.read_csv(tmp_path / "all.csv", comment="#")
    assert len(table) == whole.sizes["sample"]
    for key, values in whole.items():
        if values.dims == ("sample",):
            column = next(c for c in table if re.match(rf"{key}\b", c))
            np.testing.assert_allclose(table[column], values, rtol=1e-12, err_msg=key)
            assert values.units in column or values.units == "1", column
    again = st.Study.from_dict(study.to_dict())
    assert again == study == st.Study.from_result(whole)


def linked(name: str) -> st.RandomInterface:
    """Three linked properties, of which the first was measured, and two factors."""
    places = {"x": [0.004, 0.017], "y": [0.009, 0.0131, 0.0132]}
    places = {key: places[key] for key in BODIES[name].interface.dims}
    known = np.linspace(0.8e6, 1.2e6, 6).reshape(2, 3)[:, 0 if len(places) == 1 else slice(3)]
    exponential, smooth = st.ExponentialSpectrum(5e-3), st.SquaredExponentialSpectrum(7e-3)
    along = {"anisotropy": 1.7} if "y" in places else {}
    strength = st.RandomField(FIELD.marginal, smooth, True, **along)
    pressure = st.RandomField(st.Weibull(mean=2e6, cv=0.1), exponential)
    return st.RandomInterface(
        strength=strength.given(xr.DataArray(known, places, [*places]), noise=2e4),
        normal_pressure=pressure,
        initial_stress=st.RandomField(st.Gamma(mean=1e4, cv=0.3), smooth),
        correlation={
            ("strength", "initial_stress"): 0.4,
            ("normal_pressure", "strength"): -0.3,
        },
        between={"normal_pressure": st.Lognormal(mean=1.0, cv=0.07)},
    )


@pytest.mark.parametrize("name", ["line", "plane with ends"])
def test_whatever_is_random_comes_back_from_each_file(name, tmp_path):
    """With the same profiles and onsets, also in a list."""
    random = linked(name)
    problem = dataclasses.replace(BODIES[name], load=st.Load())
    given = {"random": [random, random], "method": st.LocalCriterion(), "keep": random.names}
    study = st.Study(problem=problem, samples=4, **given)
    whole = study.run(pilot=False, out=tmp_path / "run", **QUIET)
    study.to_toml(tmp_path / "study.toml")
    for back in (
        st.Study.from_toml(tmp_path / "study.toml"), st.Study.from_dict(study.to_dict()),
        st.Study.from_result(whole), st.open_run(tmp_path / "run").study,
    ):  # fmt: skip
        assert back == study
        assert back.run(pilot=False, **QUIET).drop_attrs().identical(whole.drop_attrs())


@pytest.mark.parametrize("name", ["line", "blocks"])
def test_a_film_has_the_frames_of_its_run(name, tmp_path):
    from PIL import Image

    run, _ = rupture(name)
    # All rates are slow, in the same proportions.
    slow = run.assign(top_slip_rate=1e-9 * run.top_slip_rate)
    path = st.plot.film(slow, tmp_path / "film.gif", frames=7, **QUIET)
    with Image.open(path) as film:
        assert film.n_frames == min(7, run.sizes["time"])
        first = np.asarray(film.convert("L"), dtype=float)
        film.seek(film.n_frames - 1)
        assert np.abs(np.asarray(film.convert("L"), dtype=float) - first).max() > 50.0


@pytest.mark.parametrize("name", ["line", "blocks with an extent"])
def test_a_page_of_a_design_holds_its_numbers(name, tmp_path):
    w = world(name, "local_criterion")
    design = st.design_stress(
        w.problem, w.random, probability=0.1, method=w.method, target_cv=0.4, **QUIET
    )
    page = design.write_page(tmp_path / "page.html", sources={"load.profile": "drawing 12"})
    text = html.unescape(re.sub(r"<[^>]+>", " ", Path(page).read_text()))
    for doubt in (*design.warnings, *design.doubts):
        assert " ".join(doubt.split()) in " ".join(text.split())
    digits = re.findall(r"\d+(?:\.\d+)?", text)
    shown = {f"{float(number):.3g}" for number in digits}
    for value in (design.force, design.probability, design.friction_coefficient):
        scaled = {f"{value * 10.0**power:.3g}" for power in (-3, 0, 3)}
        assert scaled & shown, value


@pytest.mark.parametrize("name", BODIES)
def test_the_inputs_on_a_page_are_those_of_the_problem_in_any_units(name):
    """Of many values, the mean."""
    w, other = world(name), world(name).in_units(Pa=0.25, m=2.0, s=8.0)
    rows, others = ({k: row for k, *row in _inputs(at.problem, {})} for at in (w, other))
    assert {"Pa", "m", "kg m-3"} <= {unit for _, unit, _ in rows.values()}
    for key, (value, unit, _) in rows.items():
        again, known, _ = others[key]
        assert unit == known
        if not isinstance(value, list) and re.match(r"(\d+ values, mean )?[-\d.]", str(value)):
            shown, scaled = (float(str(cell).split()[-1]) for cell in (value, again))
            right = np.mean(reduce(getattr, key.split("."), w.problem))
            assert shown == pytest.approx(right, rel=5.1e-5)  # five digits
            assert scaled == pytest.approx(shown * other.factor(unit), rel=1.1e-4)


def test_the_slip_tests_on_a_page_are_those_of_the_file(tmp_path):
    """A slip load is that of all surfaces."""
    force, load = [200.0, 210.0, 190.0, 205.0], [180.0, 193.0, 165.0, 184.0]  # kN
    columns = {"specimen": [*"ABCD"], "clamping force (kN)": force, "slip load (kN)": load}
    pd.DataFrame(columns).to_csv(tmp_path / "slips.csv", index=False)
    given = {"normal": "clamping force (kN)", "surfaces": 2}
    peaks = st.read_peaks(tmp_path / "slips.csv", **given)
    for row, name, at, slip in zip(_slip_tests(peaks), "ABCD", force, load, strict=True):
        assert row == [name, f"{at:.3g} kN", f"{slip:.3g} kN", f"{slip / at / 2.0:.4g}"]


@pytest.mark.parametrize("name", BODIES)
def test_a_table_of_events_holds_every_event(name):
    problem = BODIES[name]
    rows = profiles_of(problem, field_of(problem).sample(problem.interface, samples=3, seed=5))
    result = st.onset(problem, rows, method=st.Equilibrium(events=3), **QUIET)
    table = st.external.event_table(result)
    assert len(table) == int(np.isfinite(result.event_load).sum())
    moment = f"event_moment ({result.event_moment.units})"
    assert not table.duplicated(["sample (1)", moment]).any()  # no event is listed twice
    for key, values in result.items():
        if values.dims == ("sample", "event"):
            known = values.values[np.isfinite(result.event_load.values)]
            column = table[f"{key} ({values.units})"]
            np.testing.assert_allclose(column, known, rtol=1e-12, err_msg=key)
