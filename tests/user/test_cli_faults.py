"""What goes wrong around a command ends with a message: full disks, odd names, hostile files."""

import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_study import small_study

import stiction as st
from stiction.ensemble import files
from stiction.files import private_folder, write_dataset

STUDY = small_study(
    nodes=64, weakening_rate=0.1e12, correlation_length=0.02, ensemble={"samples": 40, "seed": 3}
)


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    """Commands run in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    st.Study.from_dict(STUDY).to_toml("study.toml")


@pytest.fixture
def full_disk(monkeypatch):
    """Every sync says that the disk is full, as a file system does that allocates late."""

    def start():
        def fail(handle):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(files.os, "fsync", fail)

    return start


@pytest.mark.parametrize(
    "arguments",
    [
        ["plot", "run", "--out", "out"],
        ["report", "run", "--out", "page.html"],
        ["onset", "study.toml", "--strength", "p.npy", "--method", "local_criterion",
         "--out", "figure.png"],
        ["reliability", "study.toml", "--smallest", "0.1", "--plain-samples", "0", "--out", "out"],
        pytest.param(["rupture", "study.toml", "--loading-rate", "1e10", "--out", "out"],
                     marks=pytest.mark.slow),
    ],
    ids=["plot", "report", "onset", "reliability", "rupture"],
)  # fmt: skip
def test_a_full_disk_is_called_so_and_leaves_nothing_half(command, full_disk, tmp_path, arguments):
    assert command("run", "study.toml", "--out", "run")[0] == 0
    study = st.Study.from_dict(STUDY)
    np.save("p.npy", study.random.strength.sample(study.problem.interface)[0])
    full_disk()
    code, _, errors = command(*arguments)
    assert code == 1
    assert "cannot be written: the disk is full" in errors
    assert not [*tmp_path.glob("out/*"), *tmp_path.glob("*.html"), *tmp_path.glob("*.png")]


def test_an_empty_run(command, tmp_path):
    command("run", "study.toml", "--out", "run")
    for chunk in (tmp_path / "run" / "chunks").iterdir():
        chunk.unlink()
    (tmp_path / "run" / "chunks.jsonl").unlink()
    for name in ("plot", "report"):
        code, _, errors = command(name, "run")
        assert (code, "no sample is stored yet" in errors) == (2, True)


@pytest.mark.parametrize("name", ["x" * 300, "not-utf8-\udcff"], ids=["long", "bytes"])
def test_names_that_no_file_can_have(command, name):
    command("run", "study.toml", "--out", "run")
    for arguments in (
        ["check", f"{name}.toml"],
        ["status", name],
        ["run", "study.toml", "--out", name],
        ["plot", "run", "--out", name],
        ["report", "run", "--out", f"{name}.html"],
        ["export", "run", f"{name}.nc"],
        ["rupture", "study.toml", "--out", name],
    ):
        code, _, errors = command(*arguments)
        assert code == 2
        assert errors.startswith("error: ")


def test_escape_sequences_of_a_run_are_not_printed_raw(command):
    hostile = st.Study.from_dict(STUDY | {"title": "\x1b[2Jnice\x07\nsamples 9 of 9"})
    hostile.to_toml("hostile.toml")
    command("run", "hostile.toml", "--out", "run")
    for name in ("check", "status"):
        code, out, errors = command(name, "hostile.toml" if name == "check" else "run")
        assert code == 0
        assert "\x1b" not in out + errors
        assert "\x07" not in out + errors
        assert "\\x1b[2Jnice" in out
        assert "\nsamples 9" not in out


@pytest.mark.parametrize(
    "attributes",
    [
        {"study": "{"},
        {"study": 3},
        {"study": "[" * 100_000},
        {"study": json.dumps({"title": "x"})},
        {"failed_samples": "[[1]]"},
        {"failed_samples": "3"},
        {"stiction_version": None},
    ],
    ids=["torn", "number", "deep", "no study", "short", "no list", "no version"],
)
def test_hostile_attributes_of_a_result(command, attributes):
    command("run", "study.toml", "--out", "result.nc")
    result = xr.load_dataset("result.nc").assign_attrs(attributes)
    result.attrs = {name: value for name, value in result.attrs.items() if value is not None}
    write_dataset(result, Path("hostile.nc"))
    for name in ("status", "plot", "report"):
        code, _, errors = command(name, "hostile.nc")
        assert code in (1, 2)
        assert errors.startswith("error: ")


def test_a_result_that_holds_something_else(command):
    command("run", "study.toml", "--out", "result.nc")
    result = xr.load_dataset("result.nc")
    write_dataset(result.isel(sample=slice(3)), Path("short.nc"))
    write_dataset(result.drop_vars("critical_stress"), Path("other.nc"))
    for name in ("short.nc", "other.nc"):
        code, _, errors = command("status", name)
        assert (code, "does not hold the results of its study" in errors) == (1, True)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows has other means")
def test_a_cache_that_others_can_write_is_refused(tmp_path):
    open_to_all = tmp_path / "shared"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    with pytest.raises(st.InputError, match="can be written by others.*STICTION_CACHE_DIR.*go-w"):
        private_folder(open_to_all, "compiled")
    open_to_all.chmod(0o755)
    made = private_folder(open_to_all, "compiled", "digest")
    assert made.stat().st_mode & 0o077 == 0
    (open_to_all / "compiled").chmod(0o770)  # planted below a folder that is closed
    with pytest.raises(st.InputError, match="compiled can be written by others"):
        private_folder(open_to_all, "compiled", "digest")


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"random.strength.spectrum.correlation_length": 1e-308}, "check the units of the lengths"),
        ({"ensemble.samples": 10**13}, r"samples: must be at most 1e\+10"),
        ({"problem.interface.nodes": 10**30}, "at most 2\\^24"),
        ({"problem.interface.length": 1e-308}, "length: the nodes must be at least"),
        ({"ensemble.keep_samples": 10**13}, "keep_samples.*at most 1000000"),
    ],
)
def test_numbers_out_of_this_world_are_refused(changed, words):
    plain = json.loads(json.dumps(STUDY))
    for key, value in changed.items():
        *path, last = key.split(".")
        table = plain
        for name in path:
            table = table[name]
        table[last] = value
    with pytest.raises(st.InputError, match=words):
        st.Study.from_dict(plain)
