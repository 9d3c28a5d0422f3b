"""Compiled kernels: a folder for each state of the sources, and no need of one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stiction.jit import jit

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


def test_an_edited_kernel_is_another_folder_for_those_who_call_it(tmp_path):
    """numba looks at the kernel's own file only; the kernels here call those of other files."""
    code = (
        "import stiction.jit as j;"
        "print(*(j._folder('stiction.' + m) for m in ('dynamics.explicit', 'random.synthesis')))"
    )
    copy = tmp_path / "src"
    shutil.copytree(SOURCES / "stiction", copy / "stiction")
    folders = []
    for edited in (None, "errors.py", "dynamics/explicit.py", "friction/__init__.py"):
        if edited:
            with (copy / "stiction" / edited).open("a") as file:
                file.write("\n# edited\n")
        folders.append(run(code, copy, tmp_path / "cache").split())
    before, message, own, law = folders
    assert Path(before[0]).parent == tmp_path / "cache" / "compiled"
    assert message == before
    assert own[0] != before[0]
    assert own[1] == before[1]
    assert not set(law) & set(own)


@pytest.mark.parametrize("writable", [True, False])
def test_kernels_are_kept_where_that_is_possible(tmp_path, writable):
    cache = tmp_path / "cache" if writable else Path(os.devnull) / "cache"
    code = (
        "import numpy as np; from stiction.criterion.average import minimum_rows as f;"
        "out = np.empty(1); f(np.ones((1, 8)), np.ones(8), np.ones(5), 2, out, out.copy());"
        "print(8.0 * out.sum())"
    )
    copy = tmp_path / "src"
    shutil.copytree(SOURCES / "stiction", copy / "stiction")
    assert run(code, copy, cache) == "8.0"
    kept = list(cache.rglob("*.nbc")) if writable else []
    assert bool(kept) == writable


OWN_LAW = """
from typing import NamedTuple
import numpy as np
from stiction.jit import jit
from stiction.friction import kernels

class OwnParameters(NamedTuple):
    scale: float

@jit
def strength(law, peak, residual, rate, slip):
    return law.scale * peak

@jit
def slope(law, peak, residual, rate, slip):
    return 0.0

kernels.register(OwnParameters, strength, slope)
ones = np.ones(3)
print(kernels.strengths(OwnParameters({scale}), ones, ones, ones, ones))
"""
LINEAR = """
import numpy as np, stiction as st
from stiction.friction import kernels
ones = np.ones(3)
law = st.LinearWeakening(weakening_rate=1.0).parameters
print(kernels.strengths(law, ones, 0.0 * ones, ones, 0.5 * ones))
"""


def test_a_law_from_elsewhere_leaves_nothing_in_the_cache(tmp_path):
    """Its module may be missing in the next process, or changed; numba would notice neither."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run(code):
        (tmp_path / "own_module.py").write_text(code)
        command = [sys.executable, "-c", "import own_module"]
        if code == LINEAR:
            command = [sys.executable, tmp_path / "own_module.py"]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert run(OWN_LAW.format(scale=2.0)) == "[2. 2. 2.]"
    assert run(LINEAR) == "[0.5 0.5 0.5]"
    edited = OWN_LAW.format(scale=2.0).replace("law.scale * peak", "3.0 * law.scale * peak")
    assert run(edited) == "[6. 6. 6.]"
    kept = b"".join(path.read_bytes() for path in (tmp_path / "cache").rglob("*.nbi"))
    assert kept
    assert b"own_module" not in kept


def test_functions_of_no_module_compile():
    """As libraries make them by exec; the package looks at the module of what is compiled."""
    made: dict = {"__name__": None}
    exec("def one_more(x):\n    return x + 1", made)
    assert jit(made["one_more"])(1) == 2
