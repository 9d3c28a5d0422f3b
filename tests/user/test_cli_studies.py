"""The commands on studies and runs: what they say, what they write, how they end."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import tomli_w
import xarray as xr
from small_study import lengths, small_study
from stiction.study.setup import read_setup

import stiction as st

STUDY = small_study(
    title="a small sweep",
    ensemble={"samples": 200, "seed": 3},
    sweep=lengths(4e-3, 6e-3, 8e-3),
)
STUDY["problem"]["load"] = {"normal_pressure": 5e6}
TEXT = tomli_w.dumps(STUDY)


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(TEXT)
    return path


def test_check_says_what_will_be_done(command, study):
    code, out, _ = command("check", study)
    assert code == 0
    for words in (
        "valid, 'a small sweep'",
        "200 (seed 3) at each of 3 points: 600 in all",
        "strength.spectrum.correlation_length: 3 values, 0.004 to 0.008",
        "nucleation length",
        "on one core",
        "a sample, probed at 3 of 3 points",
        "size",
    ):
        assert words in out
    code, out, _ = command("check", study, "--no-probe")
    assert code == 0
    assert "on one core" not in out


def test_check_lists_every_mistake(command, study):
    text = TEXT.replace("density = 1170.0", "densty = 1170.0").replace(
        "samples = 200", "samples = 0"
    )
    study.write_text(text + '\n[[sweep]]\n"ensemble.sed" = [1]\n')
    code, out, err = command("check", study)
    assert (code, out) == (2, "")
    for words in ("densty", "ensemble.samples", "did you mean 'seed'", "problem.solid.density"):
        assert words in err
    assert all(line.startswith("error: ") for line in err.splitlines())
    assert "Traceback" not in err


def test_run_look_export_plot_report(command, study, tmp_path):
    run = tmp_path / "run"
    code, out, _ = command("run", study, "--out", run, "--workers", 1)
    assert code == 0
    assert "600 samples in" in out
    assert out.count("friction_coefficient") == 3
    code, out, _ = command("status", run)
    assert code == 0
    assert "600 of 600 (100.0 %)" in out
    code, out, _ = command("export", run, tmp_path / "result.nc")
    assert code == 0
    with xr.open_dataset(tmp_path / "result.nc") as result:
        assert result.load().identical(st.Study.from_toml(study).run())
    code, out, _ = command("plot", run, "--out", tmp_path / "figures")
    assert code == 0
    for name in ("densities.png", "densities.pdf", "quantiles.png", "quantiles.pdf"):
        assert (tmp_path / "figures" / name).stat().st_size > 5000
    code, out, _ = command("report", run)
    page = (run / "report.html").read_text()
    assert code == 0
    assert page.count("data:image/png;base64,") == 2
    assert "http" not in page.replace("http-equiv", "")
    mean = float(result["critical_stress"].isel(correlation_length=0).mean()) * 1e-6
    assert f"{mean:.5g}" in page
    for words in ("a small sweep", "numpy", "correlation_length", "600 of 600 samples"):
        assert words in page


def test_the_same_commands_take_a_finished_file(command, study, tmp_path):
    result = tmp_path / "result.nc"
    assert command("run", study, "--out", result)[0] == 0
    assert "600 of 600" in command("status", result)[1]
    assert command("report", result, "--out", tmp_path / "page.html")[0] == 0
    assert command("plot", result)[0] == 0
    assert (tmp_path / "result-figures" / "quantiles.pdf").exists()
    assert command("export", result, tmp_path / "copy.nc")[0] == 0


def test_growing_from_the_command_line(command, study, tmp_path):
    assert command("run", study, "--out", tmp_path / "run")[0] == 0
    study.write_text(TEXT.replace("samples = 200", "samples = 300"))
    assert "900 samples" in command("run", study, "--out", tmp_path / "run")[1]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["run", "STUDY", "--out", "nowhere/run"], 1, "does not exist"),
        (["run", "STUDY"], 2, "--out"),
        (["run", "missing.toml", "--out", "run"], 2, "missing.toml"),
        (["run", "STUDY", "--out", "run", "--workers", "0"], 2, "workers"),
        (["run", "STUDY", "--out", "run", "--workers", "1", "--slurm"], 2, "one of them"),
        (["run", "STUDY", "--out", "STUDY"], 1, "is a file"),
        (["run", "STUDY", "--outt", "run"], 2, "--out"),
        (["status", "nothing"], 1, "there is no run here"),
        (["status", "."], 1, "holds no run"),
        (["export", "nothing", "result.nc"], 1, "there is no run here"),
        (["export", "nothing", "nowhere/result.nc"], 2, "does not exist"),
        (["report", "STUDY"], 1, "no NetCDF file"),
        (["plot", "nothing"], 1, "there is no run here"),
        (["onset", "STUDY", "--strength", "missing.npy"], 2, "missing.npy"),
        (["onset", "STUDY", "--strength", "missing.tif"], 2, ".npy"),
        (["onset", "STUDY", "--strength", "p.npy", "--method", "local"], 2, "local_criterion"),
        (["onset", "STUDY", "--strength", "p.npy", "--out", "figure.gif"], 2, ".png"),
        (["nothing"], 2, "nothing"),
    ],
)
def test_mistakes_end_with_a_message(command, study, tmp_path, monkeypatch, arguments, code, words):
    monkeypatch.chdir(tmp_path)
    found, _, err = command(*[str(study) if word == "STUDY" else word for word in arguments])
    assert found == code
    assert words in err
    assert "Traceback" not in err


def test_another_study_is_refused(command, study, tmp_path):
    assert command("run", study, "--out", tmp_path / "run")[0] == 0
    study.write_text(TEXT.replace("seed = 3", "seed = 4"))
    code, _, err = command("run", study, "--out", tmp_path / "run")
    assert code == 1
    assert "ensemble.seed: 4 here, 3 there" in err


def test_failed_samples_make_exit_code_one(command, study, tmp_path, monkeypatch):
    from stiction.ensemble import work

    original = work.compute

    def compute(plan, first, count):
        if first <= 17 < first + count:
            raise FloatingPointError("not finite")
        return original(plan, first, count)

    run = ["run", study, "--out", tmp_path / "run", "--workers", 1]
    with monkeypatch.context() as patch:
        patch.setattr(work, "compute", compute)
        code, out, err = command(*run)
    assert code == 1
    assert "597 samples in" in out
    assert "sample 17 of point 2 (seed 3): FloatingPointError: not finite" in err
    assert "--retry" in err
    assert "sample 17 (seed 3)" in command("status", tmp_path / "run")[1]
    assert command(*run)[0] == 1
    assert command(*run, "--retry")[0] == 0


LONG = TEXT.replace("samples = 200", "samples = 3_000_000")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_interrupted_from_outside(command, study, tmp_path, number):
    # A shell that starts tests in the background lets them, and what they start, ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    study.write_text(LONG)
    run = tmp_path / "run"
    with subprocess.Popen(
        [sys.executable, "-m", "stiction", "run", str(study), "--out", str(run)],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
    ) as process:
        deadline = time.monotonic() + 60.0
        while not (run / "chunks.jsonl").exists() or not (run / "chunks.jsonl").stat().st_size:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        err = process.communicate(timeout=60.0)[1]
    assert process.returncode == 130
    assert "interrupted:" in err
    assert "of 9000000 samples are stored" in err
    assert "Traceback" not in err
    assert "of 9000000" in command("status", run)[1]


def profile_of(study):
    loaded = st.Study.from_toml(study)
    interface = loaded.problem.interface
    return interface, loaded.random.strength.sample(interface, seed=8)[0]


@pytest.mark.parametrize("form", ["npy", "csv", "csv with x", "nc"])
def test_onset_of_ones_own_profile(command, study, tmp_path, form):
    interface, profile = profile_of(study)
    path = tmp_path / f"profile.{form.split()[0]}"
    if form == "npy":
        np.save(path, profile)
    elif form == "csv":
        np.savetxt(path, profile, fmt="%.17g")
    elif form == "csv with x":
        table = np.column_stack([interface.x, profile])
        np.savetxt(path, table, fmt="%.17g", delimiter=",", header="x,strength", comments="")
    else:
        xr.Dataset({"strength": ("x", profile)}, {"x": interface.x}).to_netcdf(path)
    code, out, _ = command("onset", study, "--strength", path, "--method", "local_criterion")
    assert code == 0
    expected = st.onset(st.Study.from_toml(study).problem, profile, method=st.LocalCriterion())
    line = next(line for line in out.splitlines() if line.startswith("local_criterion"))
    assert f"{float(expected['critical_stress'][0]) * 1e-6:.6f} MPa" in line
    assert f"{float(expected['critical_position'][0]) * 1e3:.4f} mm" in line
    assert f"{float(expected['friction_coefficient'][0]):.6f}" in line


PROBLEM = TEXT[: TEXT.index("[random.strength.marginal]")]


def test_onset_needs_a_problem_only(command, study, tmp_path):
    _, profile = profile_of(study)
    np.savetxt(tmp_path / "p.txt", profile * 1e-3)
    study.write_text(PROBLEM)
    ask = ("onset", study, "--strength", tmp_path / "p.txt", "--method", "local_criterion")
    code, out, _ = command(*ask, "--unit", "kPa")
    assert code == 0
    expected = st.onset(read_setup(study)[0], profile, method=st.LocalCriterion())
    assert f"{float(expected['critical_stress'][0]) * 1e-6:.6f} MPa" in out
    study.write_text(PROBLEM.replace("nodes = 128", "nodes = 127") + "[randon]\na = 1\n")
    code, _, err = command(*ask)
    assert code == 2
    assert "problem.interface.nodes: must be even, got 127" in err
    assert "unknown 'randon'; did you mean 'random'?" in err
    study.write_text("title = 'nothing'")
    assert "problem: missing" in command(*ask)[2]


def test_onset_marks_gaps(command, study, tmp_path):
    interface, profile = profile_of(study)
    weakest = int(np.argmin(profile))
    profile[weakest + 1 : weakest + 12] = np.nan
    profile[weakest + 12] = 1.001 * profile[weakest]
    lines = [f"{x * 1e3:.9g};{'' if np.isnan(v) else v * 1e-6}" for x, v in zip(
        interface.x, profile, strict=True)]  # fmt: skip
    (tmp_path / "p.csv").write_text("\n".join(["x (mm);strength (MPa)", *lines]))
    ask = ("onset", study, "--strength", tmp_path / "p.csv", "--method", "local_criterion")
    code, _, err = command(*ask)
    assert code == 2
    assert "(11 of 128 nodes)" in err
    assert "--fill-gaps" in err
    figure = tmp_path / "p.svg"
    code, out, _ = command(*ask, "--fill-gaps", "--out", figure)
    assert code == 0
    assert "mm *" in out
    assert "not measured, filled with straight lines: x = " in out
    assert "* the onset lies in a gap of the profile (local_criterion)" in out
    assert figure.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1e6\n2e6\n", "has 2 values, the interface has 128 nodes"),
        ("1,2,3\n1,2,3\n", "has 3 columns (without names); say which"),
        ("0.0,1e6\n0.5,1e6\n", "the interface is 0.1 m long"),
        ("0.02,1e6\n0.01,1e6\n", "--interpolate"),
        ("x,tau\n0.0,1e6\n0.01,strong\n", "line 3: 'strong' is no number"),
        ("", "holds no numbers"),
    ],
)
def test_profiles_that_do_not_fit(command, study, tmp_path, text, words):
    (tmp_path / "p.csv").write_text(text)
    code, _, err = command("onset", study, "--strength", tmp_path / "p.csv")
    assert code == 2
    assert words in err


@pytest.mark.slow
def test_onset_by_every_method(command, study, tmp_path):
    _, profile = profile_of(study)
    np.save(tmp_path / "p.npy", profile)
    figure = tmp_path / "onset.png"
    code, out, _ = command("onset", study, "--strength", tmp_path / "p.npy", "--out", figure)
    assert code == 0
    lines = out.splitlines()
    names = [line.split()[0] for line in lines[1:-1]]
    assert names == ["local_criterion", "equilibrium", "rupture"]
    stresses = [float(line.split()[1]) for line in lines[1:-1]]
    # 21 nodes in h_n: discretisation and interaction leave the methods within one per cent.
    assert max(stresses) / min(stresses) < 1.01
    assert figure.stat().st_size > 10_000


def test_a_method_that_does_not_apply_says_why(command, study, tmp_path):
    text = TEXT.replace("weakening_rate = 250000000000.0", "critical_slip = 8e-6")
    study.write_text(text.replace('"local_criterion"', '"equilibrium"'))
    _, profile = profile_of(study)
    np.save(tmp_path / "p.npy", profile)
    code, out, _ = command(
        "onset", study, "--strength", tmp_path / "p.npy", "--method", "local_criterion"
    )
    assert code == 1
    assert "local_criterion does not apply" in out
    assert "varies along the interface" in out


def test_help_of_every_command(command):
    for name in ("run", "onset", "check", "schema", "status", "export", "plot", "report"):
        code, out, _ = command(name, "--help")
        assert code == 0
        assert len(out.splitlines()) > 5
