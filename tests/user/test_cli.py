"""The commands: what they print and write, how they end, and what they make of mistakes."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import xarray as xr
from small_study import lengths, small_study

import stiction as st
from stiction import files
from stiction.cli import app, in_options, onset
from stiction.ensemble.experiment import Experiment
from stiction.files import private_folder

STUDY = small_study(
    title="a small sweep",
    nodes=256,  # 16 in a nucleation length
    ensemble={"samples": 100, "seed": 3},
    sweep=lengths(4e-3, 6e-3, 8e-3),
)
STUDY["problem"]["load"] = {"normal_pressure": 5e6}
TEXT = tomli_w.dumps(STUDY)
LONG = "x" * 300


@pytest.fixture(autouse=True)
def study(monkeypatch, tmp_path):
    """Commands run in a folder of their own, which holds a study."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(TEXT)
    return tmp_path / "study.toml"


def strength():
    loaded = st.Study.from_dict(STUDY)
    interface = loaded.problem.interface
    return interface, loaded.random.strength.sample(interface, seed=8)[0]


# -- studies and runs ----------------------------------------------------------------------------


def test_check_says_what_will_be_done(command):
    code, out, _ = command("check", "study.toml")
    assert code == 0
    for words in (
        "valid, 'a small sweep'",
        "100 (seed 3) at each of 3 points: 300 in all",
        "strength.spectrum.correlation_length: 3 values, 0.004 to 0.008",
        "nucleation length",
        "xi_0 / h_n",
        "a sample, probed at 3 of 3 points",
        "size",
    ):
        assert words in out


def test_check_lists_every_mistake(command, study):
    text = TEXT.replace("density = 1170.0", "densty = 1170.0").replace(
        "samples = 100", "samples=0"
    )
    study.write_text(text + '\n[[sweep]]\n"ensemble.sed" = [1]\n')
    code, out, err = command("check", study)
    assert (code, out) == (2, "")
    for words in ("densty", "ensemble.samples", "did you mean 'seed'", "problem.solid.density"):
        assert words in err
    assert all(line.startswith("error: ") for line in err.splitlines())


def test_run_grow_look_export_report(command, study):
    assert command("run", study, "--out", "run", "--workers", 1)[0] == 0
    study.write_text(TEXT.replace("samples = 100", "samples = 150"))
    code, out, _ = command("run", study, "--out", "run")
    assert code == 0
    assert "450 of 450 samples in run" in out
    assert "critical_stress, MPa" in out
    assert out.count("150.0") == 6  # samples at three points, of stress and coefficient
    code, out, _ = command("status", "run")
    assert code == 0
    assert "450 of 450 (100.0 %)" in out
    assert "all stored chunks match their checksums" in out
    assert command("export", "run", "result.nc")[0] == 0
    with xr.open_dataset("result.nc") as result:
        assert result.load().identical(st.Study.from_toml(study).run())
    assert command("report", "run")[0] == 0
    page = (study.parent / "run" / "report.html").read_text()
    for words in (
        "a small sweep", "numpy", "correlation_length", "450 of 450 samples", "[problem.solid]",
        "Densities of the static friction coefficient",
    ):  # fmt: skip
        assert words in page
    assert page.count("<img") == 2


def test_points_with_one_label_are_not_thrown_together(command, study):
    axis = {"problem.interface.nodes": [256, 256], "random.strength.marginal.alpha": [1.5, 3.0]}
    study.write_text(tomli_w.dumps(STUDY | {"sweep": [axis]}))
    out = command("run", study, "--out", "run", "--no-pilot")[1]
    assert out.count("100.0") == 4  # two points, of stress and coefficient


def test_parts_and_the_time_limit(command):
    code, out, _ = command("run", "study.toml", "--out", "run", "--part", "1/2")
    assert code == 0
    assert "part 1/2: 156 of 300 samples in run" in out
    code, _, err = command("run", "study.toml", "--out", "run", "--time-limit", "1e-9")
    assert code == 3
    assert "rerun the command to resume" in err
    code, out, _ = command("run", "study.toml", "--out", "run", "--part", "2/2")
    assert "300 of 300" in command("status", "run")[1]


def test_failed_samples_make_exit_code_one(command, monkeypatch):
    original = Experiment.results

    def results(self, first, count):
        if first <= 17 < first + count:
            raise FloatingPointError("not finite")
        return original(self, first, count)

    run = ["run", "study.toml", "--out", "run", "--workers", 1]
    with monkeypatch.context() as patch:
        patch.setattr(Experiment, "results", results)
        code, out, err = command(*run)
    assert code == 1
    assert "297 of 300 samples in" in out
    assert "sample 17 of point 2 (seed 3): FloatingPointError: not finite" in err
    assert "sample 17 (seed 3)" in command("status", "run")[1]
    assert command(*run)[0] == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_interrupted_from_outside(command, study, number):
    # A shell that starts tests in the background lets them, and what they start, ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    study.write_text(TEXT.replace("samples = 100", "samples = 3_000_000"))
    chunks = study.parent / "run" / "chunks"
    with subprocess.Popen(
        [sys.executable, "-m", "stiction", "run", str(study), "--out", "run"],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
    ) as process:
        deadline = time.monotonic() + 120.0
        while not list(chunks.glob("*.npz")):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        err = process.communicate(timeout=60.0)[1]
    assert process.returncode == 130
    assert "interrupted:" in err
    assert "samples so far are in run; rerun the command to resume" in err
    assert "Traceback" not in err
    assert "of 9000000" in command("status", "run")[1]


# -- one interface, and the tail -----------------------------------------------------------------


def test_onset_of_ones_own_profile(command, study):
    profile = strength()[1]
    np.save("p.npy", profile)
    study.write_text(TEXT[: TEXT.index("[random.strength.marginal]")])  # a problem is enough
    ask = ("onset", study, "--strength", "p.npy", "--method", "local_criterion")
    code, out, _ = command(*ask)
    assert code == 0
    expected = st.onset(st.Study.from_dict(STUDY).problem, profile, method=st.LocalCriterion())
    head, line = out.splitlines()
    for name in ("critical_stress", "friction_coefficient", "critical_position"):
        assert name in head
        assert f"{expected[name].item():.8g}"[:8] in line
    study.write_text("title = 'nothing'\n[randon]\na = 1\n")
    code, _, err = command(*ask)
    assert code == 2
    assert "problem: missing" in err
    assert "unknown 'randon'; did you mean 'random'?" in err


def test_messages_are_in_the_words_of_the_command_line(command):
    interface, profile = strength()
    profile[20:31] = np.nan
    np.savetxt("p.csv", np.column_stack([interface.x, profile]), delimiter=",")
    ask = ("onset", "study.toml", "--strength", "p.csv", "--method", "local_criterion")
    code, _, err = command(*ask)
    assert code == 2
    assert "11 of 256 nodes" in err
    assert "--gaps fill" in err
    assert "gaps=" not in err
    code, out, err = command(*ask, "--gaps", "fill")
    assert (code, "local_criterion" in out) == (0, True)
    np.savetxt("three.csv", np.ones((2, 3)), delimiter=",")
    err = command("onset", "study.toml", "--strength", "three.csv")[2]
    assert "give --x, --value" in err
    assert in_options('pass gaps="skip" or interpolate=True', onset) == (
        "pass --gaps skip or --interpolate"
    )


def test_a_method_that_does_not_apply_says_why(command, study):
    text = TEXT.replace("weakening_rate = 250000000000.0", "critical_slip = 8e-6")
    study.write_text(text.replace('"local_criterion"', '"equilibrium"'))
    np.save("p.npy", strength()[1])
    ask = ("onset", study, "--strength", "p.npy", "--method", "local_criterion")
    code, out, _ = command(*ask)
    assert code == 1
    assert "local_criterion does not apply" in out
    assert "varies along the interface" in out


@pytest.mark.slow
def test_rupture_of_an_overstressed_patch_under_a_load_of_its_own(command, study):
    """Slip begins at once; load, end and stations stand in the study file, and no loading rate."""
    nodes = 256
    tau_p = np.full(nodes, 1.2e6)
    np.save("p.npy", tau_p)
    away = np.abs(np.arange(nodes) - nodes // 2)
    np.save("i.npy", np.where(away < 40, 1.3e6, 0.6e6))
    given = small_study(length=0.05, nodes=nodes)
    given["problem"]["load"] = {"initial_stress": "i.npy"}
    given["method"] = {
        "type": "rupture", "load": [[0.0, 1.0], [0.0, 0.0]], "stop": "time", "end_time": 4e-5,
    }  # fmt: skip
    given["save"] = {"every": 5, "stations": {"beside": 0.01}}
    study.write_text(tomli_w.dumps(given))
    code, text, _ = command("rupture", study, "--strength", "p.npy", "--out", "rupture")
    assert code == 0
    assert "ended by: time" in text
    with xr.open_dataset("rupture/rupture.nc") as result:
        assert np.isnan(result.critical_load)
        assert result.station_slip.sizes["step"] > 50
        assert float(result.time[-1]) >= 4e-5


# -- mistakes and faults -------------------------------------------------------------------------


MISTAKES = {
    "run study.toml": (2, "--out"),
    "run missing.toml --out run": (2, "missing.toml"),
    "run study.toml --out run --workers 0": (2, "--workers"),
    "run study.toml --out run --part 3/2": (2, "--part"),
    "run study.toml --out study.toml": (1, "is a file"),
    f"run study.toml --out {LONG}": (2, "error: "),
    "run study.toml --out not-utf8-\udcff": (2, "error: "),
    f"check {LONG}.toml": (2, "error: "),
    "status nothing": (1, "there is no run here"),
    "status .": (1, "there is no run here"),
    f"status {LONG}": (2, "error: "),
    "export nothing result.nc": (1, "there is no run here"),
    "report study.toml": (1, "Not a directory"),
    "onset study.toml --strength missing.npy": (2, "missing.npy"),
    "onset study.toml --strength missing.tif": (2, ".npy"),
    "onset study.toml --strength p.npy --method local": (2, "local_criterion"),
    "rupture study.toml --out study.toml": (1, "File exists"),
    "rupture study.toml --sample -1": (2, "--sample"),
    "reliability study.toml": (2, "takes one interface"),
    "nothing": (2, "nothing"),
}


@pytest.mark.parametrize("arguments", MISTAKES)
def test_mistakes_end_with_a_message(command, arguments):
    code, _, err = command(*arguments.split(" "))
    assert code == MISTAKES[arguments][0]
    assert MISTAKES[arguments][1] in err


@pytest.mark.parametrize("name", [run.callback.__name__ for run in app.registered_commands])
def test_help_of_every_command(command, name):
    code, out, _ = command(name, "--help")
    assert (code, len(out.splitlines()) > 5) == (0, True)


@pytest.mark.parametrize("arguments", ["report run --out page.html", "export run out.nc"])
def test_a_full_disk_is_called_so_and_leaves_nothing_half(command, monkeypatch, arguments):
    assert command("run", "study.toml", "--out", "run")[0] == 0

    def fail(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", fail)  # as of a file system that allocates late
    code, _, errors = command(*arguments.split())
    assert code == 1
    assert "cannot be written: No space left on device" in errors
    assert sorted(os.listdir()) == ["run", "study.toml"]


def test_an_empty_run(command, tmp_path):
    command("run", "study.toml", "--out", "run")
    for chunk in (tmp_path / "run" / "chunks").iterdir():
        chunk.unlink()
    code, _, errors = command("report", "run")
    assert (code, "no sample is stored yet" in errors) == (2, True)


def test_escape_sequences_of_a_run_are_not_printed_raw(command):
    title = "\x1b[2Jnice\x07\nsamples 9 of 9 <script>"
    hostile = st.Study.from_dict(STUDY | {"title": title})
    hostile.to_toml("hostile.toml")
    command("run", "hostile.toml", "--out", "run")
    for name in ("check", "status"):
        code, out, errors = command(name, "hostile.toml" if name == "check" else "run")
        assert code == 0
        assert "\x1b" not in out + errors
        assert "\x07" not in out + errors
        assert "\\x1b[2Jnice" in out
        assert "\nsamples 9" not in out
    command("report", "run")
    assert "9 <script>" not in Path("run/report.html").read_text()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows has other means")
def test_a_cache_that_others_can_write_is_refused(tmp_path):
    folder = tmp_path / "compiled" / "digest"
    assert private_folder(folder).stat().st_mode & 0o077 == 0
    folder.chmod(0o770)
    with pytest.raises(st.InputError, match="digest can be written by others.*STICTION_CACHE"):
        private_folder(folder)
