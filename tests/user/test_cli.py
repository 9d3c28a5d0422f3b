"""The commands: what they print and write, how they end, and what they make of mistakes."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import xarray as xr
from refusals import refuses
from small_study import lengths, small_study

import stiction as st
from stiction.base import files
from stiction.base.files import private_folder
from stiction.cli.commands import app, in_options, onset
from stiction.cli.report import rounded
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.store import Store
from stiction.study.study import study_schema

STUDY = small_study(
    title="a small sweep",
    nodes=256,  # 16 in a nucleation length
    ensemble={"samples": 100, "seed": 3},
    sweep=lengths(4e-3, 6e-3, 8e-3),
)
STUDY["problem"]["load"] = {"normal_pressure": 5e6}
TEXT = tomli_w.dumps(STUDY)
LONG = "x" * 300
LOADED = st.Study.from_dict(STUDY)
PROFILE = LOADED.random.strength.sample(LOADED.problem.interface, seed=8)[0]
OWN = "onset study.toml --strength p.npy --method local_criterion"


@pytest.fixture(autouse=True)
def study(monkeypatch, tmp_path):
    """Commands run in a folder of their own, which holds a study and a profile."""
    monkeypatch.chdir(tmp_path)
    np.save("p.npy", PROFILE)
    path = Path("study.toml")
    path.write_text(TEXT)
    return path


# -- studies and runs ----------------------------------------------------------------------------


def test_check_says_what_will_be_done_and_lists_every_mistake(runs, study):
    runs(
        "check study.toml",
        "valid, 'a small sweep'",
        "100 (seed 3) at each of 3 points: 300 in all",
        "strength.spectrum.correlation_length: 3 values, 0.004 to 0.008 m",
        "nucleation length",
        "xi_0 / h_n",
        "a sample, probed at 3 of 3 points",
        "size",
    )
    text = TEXT.replace("density =", "densty =").replace("samples = 100", "samples=0")
    study.write_text(text + '\n[[sweep]]\n"ensemble.sed" = [1]\n')
    words = ("densty", "ensemble.samples", "did you mean 'seed'", "problem.solid.density")
    said = runs("check study.toml", *words, code=2)
    assert all(line.startswith("error: ") for line in said.splitlines())


def test_run_grow_look_export_report(runs, study):
    runs("run study.toml --out run --workers 1")
    study.write_text(TEXT.replace("samples = 100", "samples = 150"))
    out = runs(
        "run study.toml --out run",
        "450 of 450 samples in run",
        "Largest mean interface stress on the way to sliding",
        "correlation length (mm)",
    )
    runs("status run", "450 of 450 (100.0 %)", "all stored chunks match their checksums")
    assert runs("export run result.nc") == "450 of 450 samples written to result.nc\n"
    with xr.open_dataset("result.nc") as result:
        assert result.load().identical(st.Study.from_toml(study).run())
        for name, factor in (("critical_stress", 1e-6), ("friction_coefficient", 1.0)):
            for values in result[name].values * factor:
                error = values.std() / 150**0.5
                assert rounded(values.mean(), error) in out
    runs("report run")
    page = Path("run/report.html").read_text()
    for words in (
        "a small sweep", "numpy", "correlation_length", "450 of 450 samples", "[problem.solid]",
        "Densities of the static friction coefficient",
    ):  # fmt: skip
        assert words in page
    assert page.count("<img") == 2


def test_points_with_one_label_are_not_thrown_together(runs, study):
    axis = {"problem.interface.nodes": [256, 256], "random.strength.marginal.alpha": [1.5, 3.0]}
    study.write_text(tomli_w.dumps(STUDY | {"sweep": [axis]}))
    out = runs("run study.toml --out run --no-pilot")
    rows = [line.split()[:3] for line in out.splitlines() if line.lstrip().startswith("256")]
    assert [[float(one) for one in row] for row in rows[:2]] == [[256, 1.5, 100], [256, 3, 100]]


def test_the_schema_is_printed(runs):
    assert json.loads(runs("schema")) == json.loads(json.dumps(study_schema()))


def test_parts_of_a_run(runs):
    runs("run study.toml --out run --part 1/2", "part 1/2: 156 of 300 samples in run")
    runs("run study.toml --out run --part 2/2")
    runs("status run", "300 of 300")


def test_failed_samples_make_exit_code_one(runs, monkeypatch):
    original = Experiment.results

    def results(self, first, count):
        if first <= 17 < first + count:
            raise FloatingPointError("not finite")
        return original(self, first, count)

    run = "run study.toml --out run --workers 1"
    with monkeypatch.context() as patch:
        patch.setattr(Experiment, "results", results)
        words = "sample 17 of point 2 (seed 3): FloatingPointError: not finite"
        runs(run, "297 of 300 samples in", words, code=1)
        # How many are probed depends on how long they take.
        out = runs("check study.toml", "such as sample 17")
        assert re.search(r"\b3 of \d+ probed samples failed", out)
        patch.setattr(Experiment, "results", lambda self, *given: results(self, 17, 1))
        out = runs("check study.toml", "valid", code=1)
        assert re.search(r"\b(\d+) of \1 probed samples failed", out)
    runs("status run", "sample 17 (seed 3)", code=1)
    runs(run)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_interrupted_from_outside(runs, study, number):
    # A shell that starts tests in the background lets them, and what they start, ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    study.write_text(TEXT.replace("samples = 100", "samples = 3_000_000"))
    command = [sys.executable, "-m", "stiction", "run", str(study), "--out", "run"]
    environment = os.environ | {"COLUMNS": "200"}
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        deadline = time.monotonic() + 120.0
        while not Path("run/study.json").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        err = process.communicate(timeout=60.0)[1]
    assert process.returncode == 130
    assert "interrupted:" in err
    assert "what is done is in run; rerun the command to resume" in err
    assert "Traceback" not in err
    runs("status run", "of 9000000", code=1)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
@pytest.mark.parametrize(
    ("where", "done"), [("add", "100 of 300"), ("note_pilot", "300 of 300")]
)
def test_an_interruption_whose_exception_is_lost(runs, monkeypatch, number, where, done):
    """As in a finalizer or a callback from C: the run ends at the next table, or at its end."""

    class Losing:
        def __del__(self):
            signal.raise_signal(number)

    def lose(*given):
        original(*given)
        Losing()

    original = getattr(Store, where)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with monkeypatch.context() as patch:
        patch.setattr(Store, where, lose)
        words = "interrupted: what is done is in run"
        runs("run study.toml --out run --workers 1", words, code=130)
    runs("status run", done, code=int(not done.startswith("300")))
    runs("run study.toml --out run", "300 of 300")


def test_profiles_are_exported_to_netcdf_and_left_out_of_tables(runs):
    ensemble = {"samples": 5, "first": 2, "keep": ["strength"]}
    st.Study.from_dict(small_study(ensemble=ensemble)).run(out="run")
    with pytest.warns(st.AccuracyWarning, match="strength: more than one number a sample"):
        st.open_run("run").export("out.csv")
    runs("export run out.nc")
    with xr.open_dataset("out.nc") as found:
        assert found["strength"].attrs["units"] == "Pa"
        assert found["strength"].dims[-1] == "x"
    for name in ("out.txt", "out"):
        runs(f"export run {name}", ".nc", ".csv", code=2)
        assert not Path(name).exists()
        refuses("suffix", lambda name=name: st.open_run("run").export(name))


# -- one interface -------------------------------------------------------------------------------


def test_onset_of_ones_own_profile(runs, study):
    study.write_text(TEXT[: TEXT.index("[random.strength.marginal]")])  # a problem is enough
    expected = st.onset(LOADED.problem, PROFILE, method=st.LocalCriterion())
    head, line = runs(OWN).splitlines()
    for name in ("critical_stress", "friction_coefficient", "critical_position"):
        assert name in head
        assert f"{expected[name].item():.8g}"[:8] in line
    study.write_text("title = 'nothing'\n[randon]\na = 1\n")
    runs(OWN, "problem: missing", "unknown 'randon'; did you mean 'random'?", code=2)


def test_coefficients_of_ones_own_are_a_strength(runs):
    """From a heading in another language; the pressure is that of the study, 5 MPa."""
    table = np.column_stack([LOADED.problem.interface.x * 1e3, PROFILE / 5e6])
    np.savetxt("p.csv", table, delimiter=";", header="Weg [mm];Reibzahl [-]", comments="")
    own = OWN.replace("npy", "csv")
    runs(own, "--quantity friction_coefficient", code=2)
    assert runs(f"{own} --quantity friction_coefficient") == runs(OWN)


def test_one_line_answers_at_each_point(runs, study):
    """By options, or by the study's own question, whose runs are the same without it."""
    text = TEXT.replace("nodes = 256", "nodes = 256\nwidth = 0.006")
    study.write_text(f"{text}\n[reliability]\nforce = 420.0\ntarget_cv = 0.4\n")
    loaded = st.Study.from_toml(study)
    assert st.Study.from_dict(loaded.to_dict()) == loaded
    point, area = loaded.experiments[2], 6e-4
    given = {"method": point.method, "target_cv": 0.4, "seed": 3}
    wanted = {
        "": st.failure_probability(point.problem, point.given, force=420.0, **given),
        "--probability 0.02": st.design_stress(
            point.problem, point.given, probability=0.02, **given
        ),
        "--friction-coefficient 0.14": st.failure_probability(
            point.problem, point.given, 0.7e6, **given
        ),
    }
    for options, answer in wanted.items():
        lines = runs(f"reliability study.toml {options}".rstrip()).splitlines()
        assert len(lines) == 3
        *_, last = lines
        assert last.startswith(
            "point 2 (random.strength.spectrum.correlation_length = 0.008): "
        )
        shown = str(answer).partition(" below ")
        assert (shown[0] if options.startswith("--f") else str(answer)) in last
    assert f"below friction coefficient 0.14 (0.7 MPa, force {0.7e6 * area:.3g} N)" in last
    runs("run study.toml --out run --workers 1")
    study.write_text(text)
    runs("run study.toml --out run --workers 1", "300 of 300")


def test_messages_are_in_the_words_of_the_command_line(runs):
    holes = PROFILE.copy()
    holes[20:31] = np.nan
    table = np.column_stack([LOADED.problem.interface.x, holes])
    np.savetxt("p.csv", table, delimiter=",")
    own = OWN.replace("npy", "csv")
    said = runs(own, "11 of 256 nodes", "pass --gaps fill, which fills", code=2)
    assert not re.search(r"gaps=|\bst\.", said)
    runs(f"{own} --gaps fill", "local_criterion")
    np.savetxt("three.csv", np.ones((2, 3)), delimiter=",")
    runs("onset study.toml --strength three.csv", "give --x, --value", code=2)
    said = in_options('pass gaps="skip" or interpolate=True', onset)
    assert said == "pass --gaps skip or --interpolate"
    said = in_options("use method=st.Rupture(loading_rate=...) or st.LocalCriterion()", onset)
    assert said == "use the method rupture or the method local_criterion"
    runs("run study.toml --out run --part 65/64", "K from 1 to N, such as '3/100'", code=2)


def test_a_method_that_does_not_apply_says_why(runs, study):
    text = TEXT.replace("weakening_rate = 250000000000.0", "critical_slip = 8e-6")
    study.write_text(text.replace('"local_criterion"', '"equilibrium"'))
    runs(OWN, "local_criterion does not apply", "varies along the interface", code=1)


# -- mistakes and faults -------------------------------------------------------------------------


MISTAKES = {
    "run study.toml": (2, "--out"),
    "run missing.toml --out run": (2, "missing.toml"),
    "run study.toml --out run --workers 0": (2, "--workers"),
    "run study.toml --out run --part 3/2": (2, "--part"),
    "run study.toml --out study.toml": (1, "File exists"),
    "run other.toml --out other": (2, "ensemble.seed: 4 here, 3 there"),
    f"run study.toml --out {LONG}": (2, "error: "),
    "run study.toml --out not-utf8-\udcff": (2, "error: "),
    f"check {LONG}.toml": (2, "error: "),
    "status .": (1, "there is no run here"),
    "export nothing result.nc": (1, "there is no run here"),
    "report study.toml": (1, "Not a directory"),
    "onset study.toml --strength missing.npy": (2, "missing.npy"),
    "onset study.toml --strength missing.tif": (2, ".npy"),
    "onset study.toml --strength p.npy --method local": (2, "local_criterion"),
    "rupture study.toml --out study.toml": (1, "File exists"),
    "rupture study.toml --sample -1": (2, "--sample"),
    "reliability study.toml": (
        2,
        "--out: give the folder of a curve, or ask for one answer with",
    ),
    "reliability study.toml --out run --stress 7e5": (2, "leave out stress, or --out"),
    "reliability study.toml --part 1/3 --stress 7e5": (2, "--part: shares the work of a curve"),
    "reliability study.toml --force 7e3": (
        2,
        "--force: a force needs the area of the interface",
    ),
    "reliability study.toml --stress 7e5 --force 7e3": (2, "got stress and force"),
    "reliability study.toml --probability 2": (2, "--probability: must be less than 1, got 2"),
    "nothing": (2, "nothing"),
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes_end_with_a_message(runs, line):
    code, words = MISTAKES[line]
    if "other" in line:
        LOADED.run(out="other")
        st.Study.from_dict(STUDY | {"ensemble": {"samples": 100, "seed": 4}}).to_toml(
            "other.toml"
        )
    runs(line, words, code=code)


@pytest.mark.parametrize("name", [run.callback.__name__ for run in app.registered_commands])
def test_help_of_every_command(runs, name):
    assert len(runs(f"{name} --help").splitlines()) > 5


@pytest.mark.parametrize("line", ["report run --out page.html", "export run out.nc"])
def test_a_full_disk_is_called_so_and_leaves_nothing_half(runs, monkeypatch, line):
    runs("run study.toml --out run")
    before = sorted(os.listdir())

    def fail(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", fail)  # as of a file system that allocates late
    runs(line, "cannot be written: No space left on device", code=1)
    assert sorted(os.listdir()) == before


def test_an_empty_run(runs):
    runs("run study.toml --out run")
    for chunk in Path("run/chunks").iterdir():
        chunk.unlink()
    runs("report run", "no sample is stored yet", code=2)


def test_escape_sequences_of_a_run_are_not_printed_raw(runs):
    title = "\x1b[2Jnice\x07\nsamples 9 of 9 <script>"
    st.Study.from_dict(STUDY | {"title": title}).to_toml("hostile.toml")
    runs("run hostile.toml --out run")
    for line in ("check hostile.toml", "status run"):
        said = runs(line, "\\x1b[2Jnice")
        assert not any(raw in said for raw in ("\x1b", "\x07", "\nsamples 9"))
    runs("report run")
    assert "9 <script>" not in Path("run/report.html").read_text()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows has other means")
def test_a_cache_that_others_can_write_is_refused(tmp_path):
    folder = tmp_path / "compiled" / "digest"
    assert private_folder(folder).stat().st_mode & 0o077 == 0
    folder.chmod(0o770)
    with pytest.raises(st.InputError, match="digest can be written by others.*STICTION_CACHE"):
        private_folder(folder)
