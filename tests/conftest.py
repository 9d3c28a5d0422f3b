"""Shared by all tests: a cache that notices every edit, and the paper's system."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

# Each process of the tests has one core, on which threads of BLAS would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import pytest

from stiction.cli import commands

ROOT = Path(__file__).parents[1]


def _digest_of_sources() -> str:
    digest = hashlib.sha256()
    for path in sorted((ROOT / "src").rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


# Nothing computed by an earlier state of the sources may serve the tests; compiled kernels keep
# apart the states that they depend on themselves.
os.environ.setdefault(
    "NUMBA_CACHE_DIR", str(Path(tempfile.gettempdir()) / "stiction-tests-compiled")
)
os.environ["STICTION_CACHE_DIR"] = str(
    Path(tempfile.gettempdir()) / f"stiction-tests-{_digest_of_sources()}"
)


# The same examples on every machine; weekly others are drawn (--hypothesis-profile=default).
hypothesis.settings.register_profile("same", derandomize=True)
hypothesis.settings.load_profile("same")


def pytest_addoption(parser):
    parser.addoption("--fuzz-count", type=int, default=150, help="trials of each test in fuzz/")
    parser.addoption("--fuzz-seed", type=int, default=5)
    parser.addoption("--record", action="store_true", help="write records anew: -n 0")


@pytest.fixture
def fuzz(request):
    """How many trials, and the seed that chooses them."""
    option = request.config.option
    return SimpleNamespace(count=option.fuzz_count, seed=option.fuzz_seed)


@pytest.fixture(autouse=True)
def figures():
    """Close the figures of a test: matplotlib warns of more than twenty that are open."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def problem():
    """The paper's system with the modulus G/(1-nu) that it prints, 256 nodes."""
    from setups import make_problem

    return make_problem()


@pytest.fixture
def make_strength(problem):
    """The paper's random strength at a given xi_0/h_n."""
    from setups import beta_strength

    def make(ratio=0.5, **options):
        return beta_strength(ratio * problem.nucleation_length, **options)

    return make


@pytest.fixture
def command(monkeypatch, capfd):
    """Run a command line in this process: exit code, output, errors."""

    # pytest turns warnings into errors; on the command line they are lines of text.
    monkeypatch.setattr("warnings.showwarning", None, raising=False)
    # A command that was interrupted leaves a hook of its own, which is taken back after the test.
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["stiction", *map(str, arguments)])
        code = 0
        try:
            commands.main()
        except SystemExit as ended:
            code = ended.code or 0
        said = capfd.readouterr()
        assert "Traceback" not in said.err
        return code, said.out, said.err

    return run


@pytest.fixture
def runs(command):
    """Run a command line whose exit code and words are expected: what it prints."""

    def runs(line, *words, code=0):
        ended, out, errors = command(*line.split(" "))
        assert ended == code, errors
        for word in words:
            assert word.lower() in (out + errors).lower()
        return out + errors

    return runs


@pytest.fixture
def small_chunks(monkeypatch, request):
    """Many chunks of few samples, of which a module may say how many, instead of one a second."""
    from stiction.ensemble import batches, store

    monkeypatch.setattr(store, "SAVE_SECONDS", 0.0)
    most = getattr(request.module, "IN_A_CHUNK", 20)
    monkeypatch.setattr(batches, "piece_size", lambda one, span, *_: min(most, span.samples))
