"""Laws of commands: what each prints and writes is what the study and its result hold."""

from __future__ import annotations

import dataclasses
import html
import json
import re
from pathlib import Path

import numpy as np
import pint
import pytest
import xarray as xr
from contracts.test_plots import in_si
from recording import stored
from small_study import altered, small_study

import stiction as st
from stiction.cli.commands import app
from stiction.ensemble.experiment import Experiment

pytestmark = pytest.mark.filterwarnings("ignore")
Q = pint.UnitRegistry()
LENGTH, RATIO = "random.strength.spectrum.correlation_length", "problem.solid.poisson_ratio"
STEPS = [{LENGTH: np.linspace(4e-3, 10e-3, 7), RATIO: np.linspace(0.25, 0.31, 7)}]
WIDTHS = [{"problem.interface.width": [0.01, 0.02]}]
PLAIN = small_study(64, 0.05, sweep=STEPS + WIDTHS, title="a sweep")
STUDY = st.Study.from_dict(
    altered(PLAIN, problem__interface__width=0.01, problem__load__normal_pressure=2e6)
)
FORCES = [350.0, 360.0, 355.0, 370.0]
SOLVED = [10, 12] * 7
"""Of 30 samples at each point, by its width."""
LOST = "(seed 3): FloatingPointError: lost"
LINES = stored("commands")
"""Of a command: how it ends, and what it says, spaces apart."""
POINTS = [f"{point}: {SOLVED[point.number]} of 30" for point in STUDY.points[:12]]


def losing(experiment, first, count, solve=Experiment.results):
    """The results of an experiment that loses its samples after those of SOLVED."""
    if first + count > SOLVED[experiment.problem.interface.width != 0.01]:
        raise FloatingPointError("lost")
    return solve(experiment, first, count)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("commands")
    STUDY.to_toml(folder / "study.toml")
    return folder


@pytest.fixture
def say(folder, monkeypatch, runs):
    """What a command prints: some samples of the run failed, and some chunks are damaged."""

    def say(line):
        return said.read_text() if line == "run study.toml" else runs(line, code=LINES[line][0])

    monkeypatch.chdir(folder)
    said = folder / "said"
    if not said.exists():
        with monkeypatch.context() as patch:
            patch.setattr(Experiment, "results", losing)
            said.write_text(runs("run study.toml --out run --no-pilot", code=1))
        for i in range(14):
            Path(f"run/chunks/{i:032x}.npz").write_text("damaged")
    return say


def test_every_command_has_a_line():
    commands = {command.callback.__name__ for command in app.registered_commands}
    assert commands == {line.split()[0] for line in LINES} | {"reliability"}


@pytest.mark.parametrize("line", LINES)
def test_a_command_counts_what_its_study_and_its_run_hold(line, say):
    said = " ".join(say(line).split())
    for words in LINES[line][1] + (POINTS if line == "status run" else []):
        assert words in said, words


def test_times_and_sizes_are_those_of_the_samples(say):
    said, run = say("check study.toml"), st.open_run("run")
    duration = r"[\d.]+ (?:us|ms|s|min)\b"
    total, shared, *ends = (Q(text).to("s").m for text in re.findall(duration, said))
    assert 0.99 * 420 * ends[0] < total < 1.01 * 420 * ends[-1]
    cores = float(re.search(r" on (\d+) \(", said)[1])
    assert cores == pytest.approx(total / shared, rel=0.011)  # of two with three digits each
    size = sum(values.nbytes for values in run.dataset().values()) / 1e6
    assert float(re.search(r"about ([\d.]+) MB", said)[1]) == pytest.approx(size, rel=5.1e-3)
    chunks = [path for path in (run.path / "chunks").iterdir() if path.stat().st_size > 99]
    spent = sum(json.loads(np.load(chunk)["about"].tobytes())[2] for chunk in chunks)
    computed = re.search(rf"chunks +{len(chunks)}\n +computed +({duration})", say("status run"))
    assert Q(computed[1]).to("s").m == pytest.approx(spent, rel=5.1e-3)


def test_tables_of_a_run_hold_the_statistics_of_its_samples(say):
    """On the terminal and on the page, in the units of their headings."""
    said, _ = say("run study.toml"), say("report run")
    page = html.unescape(re.sub(r"(<[^>]+>|\n)+", "|", Path("run/report.html").read_text()))
    assert page.partition("Samples that failed (266)")[2].count(LOST) == 200
    assert "154 of 420 samples by local criterion.|The run is not complete.|" in page
    result = st.open_run("run").dataset().stack(point=["correlation_length", "width"])
    for key in ("critical_stress", "friction_coefficient", "critical_force"):
        values, count = result[key].transpose("point", "sample").values, np.array(SOLVED)
        expected = {
            "correlation length": result.correlation_length, "width": result.width,
            "poisson ratio": result.poisson_ratio,
            "samples": count, "mean": np.nanmean(values, axis=1),
            "standard deviation": np.nanstd(values, axis=1, ddof=1),
            "standard error": np.nanstd(values, axis=1, ddof=1) / count**0.5,
            "5 % quantile": np.nanquantile(values, 0.05, axis=1),
            "50 % quantile": np.nanquantile(values, 0.5, axis=1),
            "95 % quantile": np.nanquantile(values, 0.95, axis=1),
        }  # fmt: skip
        head, *rows = said.partition(f"{result[key].long_name.capitalize()}\n")[2].splitlines()
        ends = [0, *(cell.end() for cell in re.finditer(r"\S+", rows[0]))]
        cells = np.array([row.split() for row in rows[: len(SOLVED)]])
        assert cells.shape[1] == len(expected)
        for number, column in enumerate(cells.T):
            label = head[ends[number] : ends[number + 1]].strip()
            shown, _ = in_si(column.astype(float), label)
            right = expected[label.partition(" (")[0]]
            np.testing.assert_allclose(shown, right, rtol=5.1e-5, err_msg=label)  # five digits
        assert all("|".join(row) in page for row in cells)


def test_an_export_holds_what_it_says(say):
    assert int(re.match(r"\d+", say("export run all.nc --partial"))[0]) == sum(SOLVED)
    result = xr.load_dataset("all.nc")
    assert result.drop_attrs().identical(st.open_run("run").dataset().drop_attrs())


def test_each_answer_names_its_point_and_has_its_page(tmp_path, monkeypatch, runs):
    """A design, and the agreement of measured forces with the prediction for this point."""
    monkeypatch.chdir(tmp_path)
    asked, peaks = {"probability": 0.1, "target_cv": 0.3}, {None: Q.Quantity(FORCES, "N")}
    study = dataclasses.replace(STUDY, sweep=WIDTHS, reliability=asked, peaks=peaks)
    study.to_toml("study.toml")
    said = runs("reliability study.toml --page page.html")
    texts = iter(re.split(r"^(?=point )", said, flags=re.MULTILINE)[1:])
    for number, width in enumerate((0.01, 0.02)):
        interface = st.Interface(0.05, 64, width=width)
        given = dataclasses.replace(STUDY.problem, interface=interface), STUDY.random
        same = {"method": STUDY.method, "seed": 3}
        design = st.design_stress(*given, **asked, **same)
        predicted = st.monte_carlo(*given, samples=1000, **same)
        agreement = st.statistics.agreement(predicted, FORCES, unit="N")
        where = f"point {number} (problem.interface.width = {width}): "
        force, answer = f"{design.force:.5g}", next(texts)
        assert answer.startswith(where)
        assert re.search(rf"force +{force} .* N\n", answer)
        assert next(texts).startswith(f"{where}{agreement}")
        assert force in Path(f"page_{number}.html").read_text()
    assert not [*texts]


def test_a_result_says_which_samples_failed_and_how_many_were_not_tried(tmp_path, monkeypatch):
    study, quiet = dataclasses.replace(STUDY, sweep=[], samples=12), {"progress": False}
    for number in (2, 1):  # the first part compares some samples with the exact onset
        study.run(out=tmp_path / f"run{number}", part=f"{number}/2", **quiet)
        part = st.open_run(tmp_path / f"run{number}").dataset()
        assert (tmp_path / f"run{number}" / "pilot.json").exists() == (number == 1)
        assert (part.attrs["title"], part.attrs["seed"]) == ("a sweep", 3)
    assert part.attrs["cut_short"] == "6 of 12 samples are done"
    assert "failed_samples" not in part.attrs
    monkeypatch.setattr(Experiment, "results", losing)
    tried = study.run(pilot=False, workers=1, **quiet)
    failed = [[0, sample, 3, "FloatingPointError: lost", False] for sample in (10, 11)]
    assert json.loads(tried.attrs["failed_samples"]) == failed
    assert "cut_short" not in tried.attrs
    assert np.flatnonzero(np.isnan(tried.critical_stress)).tolist() == [10, 11]
