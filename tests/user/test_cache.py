"""Compiled kernels: a folder for each state of the sources, and no need of one; plain numba."""

import os
import shutil
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest
from checks import python

from stiction.base import files
from stiction.base.arrays import one_blas_thread
from stiction.base.jit import decorators, internals

SOURCES = Path(__file__).parents[2] / "src"
WITHOUT = 'import sys\nsys.modules["stiction.base.jit.internals"] = None\n'
"""As if the file with numba's private parts had been deleted."""


def test_an_edited_kernel_is_another_folder_for_those_who_call_it(tmp_path, monkeypatch):
    """numba looks at the kernel's own file only; the kernels here call those of other files."""
    copy = tmp_path / "stiction"
    shutil.copytree(SOURCES / "stiction", copy)
    monkeypatch.setattr(files, "__file__", str(copy / "base" / "files.py"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(files, "_kernel_sources", files._kernel_sources.__wrapped__)
    find = files.kernel_folder.__wrapped__
    monkeypatch.setenv("STICTION_CACHE_DIR", str(tmp_path / "cache"))

    def after(edited):
        with (copy / edited).open("a") as file:
            file.write("\n# edited\n")
        kernels = "methods.dynamics.explicit", "random.synthesis"
        return [find(f"stiction.{module}", "own") for module in kernels]

    before, message = after("__init__.py"), after("base/errors.py")
    own = after("methods/dynamics/state.py")  # a kernel that is called from explicit.py
    law = after("problem/friction/__init__.py")
    assert before[0].parents[1] == tmp_path / "cache" / "compiled"
    assert message == before
    assert own[0] != before[0]
    assert own[1] == before[1]
    assert not set(law) & set(own)


LAWS = """
import math
from typing import NamedTuple
import numpy as np, stiction as st
from helper import doubled
from stiction.problem.friction import kernels

class OwnParameters(NamedTuple):
    scale: float
    initial_slope: float = 1.0

    def f(law, u):
        return doubled(law.scale) * math.sqrt(1.0), 1.0

ones = np.ones(3)
linear = st.LinearWeakening(weakening_rate=1.0).parameters
for law in (OwnParameters(2.0), linear):
    print(kernels.strengths(law, ones, 0.0 * ones, ones, 0.5 * ones))
"""
HELPER = """
import numba

@numba.njit
def doubled(x):
    return FACTOR * x

FACTOR = 2.0
"""


@pytest.mark.parametrize("start", ["", WITHOUT], ids=["internals", "plain"])
def test_kernels_of_a_law_from_elsewhere_are_kept_by_its_state(tmp_path, monkeypatch, start):
    """Its module, whatever its name, or one that it calls, may change: numba would not notice."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    cache = tmp_path / "cache"
    places = {"cwd": tmp_path, "PYTHONPATH": SOURCES, "STICTION_CACHE_DIR": cache}

    def kernels(laws, helper):
        """What a process prints, and the files that are in the cache afterwards."""
        (tmp_path / "stiction_laws.py").write_text(start + laws)
        (tmp_path / "helper.py").write_text(helper)
        printed = python("-B", "-c", "import stiction_laws", **places).splitlines()
        assert printed[1] == "[0.5 0.5 0.5]"
        return printed[0], {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}

    kept = not start  # without the file nothing of others is kept
    first, files = kernels(LAWS, HELPER)
    assert first == "[4. 4. 4.]"
    if kept:
        assert kernels(LAWS, HELPER) == (first, files)  # nothing is compiled again
        assert kernels(LAWS.replace("sqrt(1.0)", "sqrt(4.0)"), HELPER)[0] == "[8. 8. 8.]"
        assert kernels(LAWS, HELPER.replace("2.0", "3.0"))[0] == "[6. 6. 6.]"
        # A list may change while a process runs: nothing is kept.
        listed = HELPER.replace("FACTOR *", "FACTOR[0] *").replace("2.0", "(5.0,)")
        assert kernels(LAWS, listed)[0] == "[10. 10. 10.]"
    indexes = [b"stiction_laws" in path.read_bytes() for path in cache.rglob("*.nbi")]
    assert not all(indexes)
    assert any(indexes) is kept


BITS = """
import numba, numpy as np
before = numba.config.CACHE_DIR
import stiction as st
from stiction.elasticity.operator import inner
from stiction.problem.friction import kernels

x = np.random.default_rng(7).lognormal(sigma=2.0, size=203)
law = st.PiecewiseWeakening(slip=[0.3, 1.0], strength=[0.4, 0.0], weakening_rate=1.3).parameters
print(inner(x, x[::-1].copy()).hex())
print(kernels.strengths(law, x, 0.1 * x, 1.0 + x, 0.3 * x).tobytes().hex())

assert numba.config.CACHE_DIR == before
"""


def test_plain_numba_gives_the_same_bits_and_user_code_is_left_alone(monkeypatch):
    """A numba that lacks a private part is plain numba to us; so is one that was not tried.

    Neither needs a folder for what it compiles.
    """
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    places = {"PYTHONPATH": SOURCES, "STICTION_CACHE_DIR": Path(os.devnull) / "cache"}
    own, plain = (python("-c", start + BITS, **places) for start in ("", WITHOUT))
    assert own == plain


def test_a_newer_numba_is_plain_numba(monkeypatch):
    assert decorators.internals is not None, "test the new numba and raise internals.NEWEST"
    newer = numba.version_info._replace(short=(99, 0))
    monkeypatch.setattr(numba, "version_info", newer)
    with pytest.raises(ImportError, match="not tested"):
        exec(Path(internals.__file__).read_text(), {"__name__": internals.__name__})
    # Its cache cannot be guarded: nothing is kept.
    monkeypatch.setattr(decorators, "_Guard", None)
    assert decorators._plain(lambda x: 2.0 * x)(4.0) == 8.0


def test_blas_has_one_thread_until_its_last_user_leaves(monkeypatch):
    """Whichever entered first, and again for those who come later."""
    calls, limit = [], SimpleNamespace(restore_original_limits=lambda: calls.append("free"))
    monkeypatch.setattr(
        "threadpoolctl.threadpool_limits", lambda **_: calls.append("one") or limit
    )
    for times in range(3):
        first, second = ExitStack(), ExitStack()
        for user in (first, second):
            user.enter_context(one_blas_thread())
        first.close()
        assert calls == ["one", "free"] * times + ["one"]
        second.close()
    assert calls == ["one", "free"] * 3
