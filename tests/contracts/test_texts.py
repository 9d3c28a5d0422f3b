"""Laws of texts and limits: a number in a text is what it names, and a limit itself is allowed."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil  # noqa: F401  # changed_runs.json calls it
import time
import warnings
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pint
import pytest
from contracts.bodies import world
from recording import stored
from refusals import refuses, warning_texts
from setups import LOCAL, beta_strength, make_problem
from small_study import small_study

import stiction as st
from stiction.base.progress import duration
from stiction.cli.commands import _seconds
from stiction.cli.pages import write_report
from stiction.ensemble import store
from stiction.problem.reading import files
from stiction.statistics import density

Q = pint.UnitRegistry()
NODES = 64
PRESSED = make_problem(NODES, 0.05, load=st.Load(normal_pressure=2e6))
STUDY = small_study(samples=5)


@pytest.mark.parametrize("seconds", np.geomspace(2e-7, 4e7, 30))
def test_a_duration_is_the_seconds_that_it_was(seconds):
    value, unit = duration(seconds).split()
    assert (float(value) * Q(unit)).to("s").magnitude == pytest.approx(seconds, rel=5e-3)


@pytest.mark.parametrize("batch", [1, 7, 64])
def test_the_time_of_a_sample_is_the_time_of_a_batch_over_its_samples(batch, monkeypatch):
    clock = [0.0]

    def results(first, count):
        clock[0] += 0.01 * count

    monkeypatch.setattr(time, "thread_time", lambda: clock[0])
    point = SimpleNamespace(seconds=1e-3, batch=batch, results=results)
    assert _seconds(point) == pytest.approx(0.01)


THIN = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.3, density=1170.0), st.Interface(0.073, NODES),
    st.LinearWeakening(weakening_rate=0.3e12),
    specimen=st.Blocks(height=0.005, drive=st.Pusher(height=0.002, width=0.001)),
)  # fmt: skip
CALLS = {
    "onset": lambda rows: st.onset(THIN, rows, method=st.Equilibrium()),
    "equilibrium_path": lambda rows: st.equilibrium_path(THIN, rows, [1e5]),
    "Study": lambda rows: st.Study(
        problem=THIN, method=st.Equilibrium(), profiles={"strength": rows}
    ).run(pilot=False, progress=False),
    "monte_carlo": lambda rows: st.monte_carlo(
        THIN,
        beta_strength(8e-3),
        method=st.Equilibrium(),
        samples=2,
        pilot=False,
        progress=False,
    ),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_doubt_about_a_problem_is_told_by_every_call(call):
    """Its stiffness has positive entries, so equilibria need not be the least."""
    texts = warning_texts(lambda: CALLS[call](np.linspace(1e6, 1.2e6, NODES)))
    assert sum("has positive entries off its diagonal" in text for text in texts) == 1


COARSE = {
    "line": (st.Interface(0.05, 64), st.PowerLawSpectrum(4e-4)),
    "line that ends": (st.Interface(0.05, 64, ends="free"), st.ExponentialSpectrum(9e-4)),
    "plane": (st.Interface((0.023, 0.0164), (24, 20)), st.PowerLawSpectrum(1e-3)),
}


@pytest.mark.parametrize("name", COARSE)
@pytest.mark.parametrize("mean_mode", [True, False])
def test_a_grid_that_a_doubt_asks_for_is_fine_enough(name, mean_mode):
    """With the nodes that it names, or with the power; with fewer nodes it is not."""
    interface, spectrum = COARSE[name]
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum, mean_mode)

    def doubts(interface, field):
        texts = warning_texts(lambda: field.sample(interface))
        return [text for text in texts if "is coarser than the spectrum" in text]

    (text,) = doubts(interface, field)
    nodes, power = re.search(r"nodes >= (.*) or power_kept=(.*)", text).groups()
    for less, fine in ((0, True), (2, False)):
        counts = [int(count) - less for count in nodes.split(" x ")]
        grid = dataclasses.replace(interface, nodes=counts if counts[1:] else counts[0])
        assert (not doubts(grid, field)) == fine
    smooth = dataclasses.replace(spectrum, power_kept=float(power))
    assert not doubts(interface, dataclasses.replace(field, spectrum=smooth))


def test_a_table_of_the_largest_size_is_read(monkeypatch, tmp_path):
    path = tmp_path / "table.csv"
    for columns, letters in ((4, 12), (5, 12), (4, 13)):
        names = ["x (mm)", "strength kPa", *"ab", "c"][:columns]
        rows = [",".join([f"{x}.0", "1000", "0" * letters, "1", "2"][:columns]) for x in "0123"]
        path.write_text("\n".join([",".join(names), *rows]))
        monkeypatch.setattr(files, "MAX_COLUMNS", 4)
        monkeypatch.setattr(files, "MAX_LETTERS", 12)
        if (columns, letters) == (4, 12):
            np.testing.assert_allclose(st.read_profile(path), 1e6)
        else:
            refuses(
                "line ... 4" if columns > 4 else "line ... 12", lambda: st.read_profile(path)
            )


def test_values_at_both_bounds_have_a_density():
    values = np.append(np.random.default_rng(0).uniform(size=400), [0.0, 1.0])
    assert density(values, bounds=(0.0, 1.0)).value.min() >= 0.0
    refuses("bounds", lambda: density(values, bounds=(1e-3, 1.0)))


@pytest.mark.parametrize("profiles", [{"strength": 1e6}, {"friction_coefficient": 0.5}])
def test_a_run_of_any_profiles_has_a_page(profiles, tmp_path):
    profiles = {name: value * np.linspace(1.0, 1.2, NODES) for name, value in profiles.items()}
    study = st.Study(problem=PRESSED, method=LOCAL, profiles=profiles)
    study.run(out=tmp_path / "run", progress=False)
    write_report(st.open_run(tmp_path / "run"), tmp_path / "page.html")
    assert "critical" in (tmp_path / "page.html").read_text("utf-8")


CHANGES = stored("changed_runs")
"""Changes of the folder of a run, or another study for it, and words of what is told of it."""


def sealed(**body):
    digest = store.digest(json.dumps(body, sort_keys=True).encode())
    return json.dumps(body | {"digest": digest})


@pytest.mark.parametrize("change", CHANGES)
def test_what_is_told_of_a_changed_run(change, monkeypatch, tmp_path):
    """When it is read, and when it goes on: to the same numbers, or it is refused."""
    monkeypatch.chdir(tmp_path)
    study, run = st.Study.from_dict(STUDY), Path("run")
    go_on = partial(st.Study.run, out=run, pilot=False, progress=False)
    first = go_on(study).critical_stress
    [chunk] = run.glob("chunks/*")
    kept = dict(np.load(chunk))
    rows, known = kept["rows"], json.loads(kept["about"].tobytes())

    def forge(rows=rows, **changes):
        """Another chunk with a right name."""
        names = "mark", "versions", "seconds", "failures"
        about = [changes.get(name, value) for name, value in zip(names, known, strict=True)]
        np.savez(chunk, about=np.frombuffer(json.dumps(about).encode(), np.uint8), rows=rows)
        chunk.rename(chunk.with_name(f"{store.digest(chunk.read_bytes())}.npz"))

    other = eval(change, globals() | locals())
    given, texts = other if isinstance(other, st.Study) else study, []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read, written = lambda: st.open_run(run).status().damaged, partial(go_on, given)
        for call in (read, lambda: written().critical_stress.equals(first)):
            try:
                texts.append(str(call()))
            except (st.InputError, st.RunError) as error:
                texts.append(str(error))
    assert "False" not in texts
    text = " ".join([*texts, *(str(one.message) for one in caught)])
    for word in CHANGES[change].split(" ... "):
        assert word in text, text


@pytest.mark.parametrize("cycles", [2, 3])
def test_curves_are_as_many_as_their_tests(cycles):
    time = np.arange(400.0 * cycles)
    force = 10.0 * (time % 400.0) / 400.0 + 1e-3 * np.sin(time)
    curves = st.read_curve((time, force), unit="N", travel_unit="s", split="cycles")
    assert len(curves) == len([*curves]) == curves.peaks.size
    assert f"Peaks of {len(curves)} tests" in str(curves)
    assert len(curves) in (cycles - 1, cycles)  # the last fall is not in the record
    names = [curve.name for curve in curves]
    assert names == [f"test, cycle {number + 1}" for number in range(len(curves))]


def test_cracks_up_to_the_whole_period_are_found():
    load = np.linspace(0.02e6, 0.4e6, 60)
    lengths = st.theory.griffith_length(make_problem(NODES, 0.05), load, 8e-3)
    reached = lengths[np.isfinite(lengths)] / 0.05
    assert np.any((reached > 0.55) & (reached < 1.0))
    assert np.all(np.diff(reached) <= 0.0)


def test_a_stress_below_minus_the_strength_is_told_with_its_amount():
    """It grows with the load in reverse."""
    strength = np.where(np.arange(NODES) // 20 == 1, 0.7e6, 1e6)
    amounts = []
    for last in (-1.5e6, -3e6):
        history = [0.0, 1e-4, 3e-4], [0.0, 0.72e6, last]
        method = st.Rupture(load_history=history, stop="rest", end_time=3e-4)
        run = partial(st.simulate_rupture, make_problem(NODES, 0.05), strength, method=method)
        texts = [text for text in warning_texts(run) if "below minus the strength" in text]
        amounts += [float(text.split(", by ")[1].split(" Pa")[0]) for text in texts]
    assert 0.0 < amounts[0] < amounts[1] < 3e6


def test_only_a_sweep_speaks_of_its_points():
    """Of the largest difference between the local criterion and the exact onset."""
    key = "random.strength.spectrum.correlation_length"
    study = dataclasses.replace(world("line with ends", "local_criterion").study, samples=4)
    study = dataclasses.replace(study, sweep=[{key: [4e-3, 6e-3]}])
    for part in (study, dataclasses.replace(study, sweep=[])):
        texts = warning_texts(partial(part.run, progress=False))
        assert any("differs from the exact onset" in text for text in texts)
        assert any("of the sweep" in text for text in texts) == bool(part.sweep)
