"""Compiled kernels: a folder for each state of the sources, and no need of one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "src"


def run(code, source, cache):
    environment = {
        **os.environ,
        "PYTHONPATH": str(source),
        "STICTION_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_an_edit_of_any_file_is_another_folder(tmp_path):
    """numba looks at the kernel's own file only; the kernels here call those of other files."""
    code = "import stiction._jit as j; print(j._FOLDER)"
    copy = tmp_path / "src"
    shutil.copytree(SOURCES / "stiction", copy / "stiction")
    before = Path(run(code, copy, tmp_path / "cache"))
    with (copy / "stiction" / "errors.py").open("a") as file:
        file.write("\n# edited\n")
    after = Path(run(code, copy, tmp_path / "cache"))
    assert before.parent == after.parent == tmp_path / "cache" / "compiled"
    assert before != after


@pytest.mark.parametrize("writable", [True, False])
def test_kernels_are_kept_where_that_is_possible(tmp_path, writable):
    cache = tmp_path / "cache" if writable else Path(os.devnull) / "cache"
    code = (
        "import numpy as np; from stiction.criterion.moving_average import average_rows as f;"
        "out = np.empty((1, 8)); f(np.ones((1, 8)), np.ones(5), out); print(out.sum())"
    )
    copy = tmp_path / "src"
    shutil.copytree(SOURCES / "stiction", copy / "stiction")
    assert run(code, copy, cache) == "8.0"
    kept = list(cache.rglob("*.nbc")) if writable else []
    assert bool(kept) == writable
