"""Compiled kernels: a folder for each state of the sources, and no need of one."""

import os
import shutil
from pathlib import Path

import pytest
from checks import python

from stiction import jit

SOURCES = Path(__file__).parents[2] / "src"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a module in a process of its own, with a folder for compiled kernels."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)

    def run(code, cache):
        (tmp_path / "own_module.py").write_text(code)
        places = {"PYTHONPATH": SOURCES, "STICTION_CACHE_DIR": cache}
        return python("-B", "-c", "import own_module", cwd=tmp_path, **places).splitlines()

    return run


def test_an_edited_kernel_is_another_folder_for_those_who_call_it(tmp_path, monkeypatch):
    """numba looks at the kernel's own file only; the kernels here call those of other files."""
    copy = tmp_path / "stiction"
    shutil.copytree(SOURCES / "stiction", copy)
    monkeypatch.setattr(jit, "__file__", str(copy / "jit.py"))
    monkeypatch.setattr(jit, "_KEPT", "")
    monkeypatch.setattr(jit, "_kernel_sources", jit._kernel_sources.__wrapped__)
    find = jit._folder.__wrapped__
    monkeypatch.setenv("STICTION_CACHE_DIR", str(tmp_path / "cache"))
    folders = []
    for edited in (None, "errors.py", "dynamics/explicit.py", "friction/__init__.py"):
        if edited:
            with (copy / edited).open("a") as file:
                file.write("\n# edited\n")
        folders.append(
            [find(f"stiction.{m}") for m in ("dynamics.explicit", "random.synthesis")]
        )
    before, message, own, law = folders
    assert before[0].parent == tmp_path / "cache" / "compiled"
    assert message == before
    assert own[0] != before[0]
    assert own[1] == before[1]
    assert not set(law) & set(own)


def test_kernels_need_no_folder(run):
    code = "from stiction.jit import jit\n\n@jit\ndef twice(x):\n    return 2 * x\n\n"
    assert run(code + "print(twice(4))", Path(os.devnull) / "cache") == ["8"]


LAWS = """
from typing import NamedTuple
import numpy as np, stiction as st
from stiction.friction import kernels, register

class OwnParameters(NamedTuple):
    scale: float
    initial_slope: float = 1.0

def shape(law, u):
    return law.scale * 1.0, 1.0

register(OwnParameters, shape)
ones = np.ones(3)
linear = st.LinearWeakening(weakening_rate=1.0).parameters
for law in (OwnParameters(2.0), linear):
    print(kernels.strengths(law, ones, 0.0 * ones, ones, 0.5 * ones))
"""


def test_a_law_from_elsewhere_leaves_nothing_in_the_cache(tmp_path, run):
    """Its module may be missing in the next process, or changed; numba would notice neither."""
    cache = tmp_path / "cache"
    assert run(LAWS, cache) == ["[2. 2. 2.]", "[0.5 0.5 0.5]"]
    edited = LAWS.replace("law.scale * 1.0", "law.scale * 3.0")
    assert run(edited, cache) == ["[6. 6. 6.]", "[0.5 0.5 0.5]"]
    assert list(cache.rglob("*.nbc"))
    assert b"own_module" not in b"".join(path.read_bytes() for path in cache.rglob("*.nbi"))
