"""Sample i depends on (seed, i) and on nothing else: not on workers, batches or compilation."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from checks import assert_same, python
from hypothesis import given, settings
from hypothesis import strategies as some
from ruptures import BREAKING_PLANE, BREAKING_STRENGTH
from setups import EXACT, LENGTH, LOCAL, beta_strength, make_problem

import stiction as st
from stiction.ensemble.experiment import Experiment

SAMPLES = 1500  # more than one piece of the local criterion, and not a multiple of it
SIZES = (48, 40), (6.0 * LENGTH, 4.0 * LENGTH)
PLANE = make_problem(*SIZES)


@pytest.fixture
def arguments(problem, make_strength):
    return {"problem": problem, "random": make_strength(), "method": LOCAL}


@pytest.fixture
def reference(arguments):
    return st.monte_carlo(**arguments, samples=SAMPLES, seed=5, workers=1)


def profiles(problem, samples, length=2e-3):
    return {"strength": beta_strength(length).sample(problem.interface, samples=samples)}


DETAILED = {"slip": True, "sensitivity": True}
LINE, SHORT = (
    make_problem(96, 0.03, weakening_rate=None),
    make_problem(128, 0.05, solid=st.paper.problem().solid),
)
RATES = 0.5e12 * np.array([1.0, 0.83, 1.17, 1.0, 0.9, 1.1])[:, None]
CASES = {
    "equilibrium, line": (
        LINE, st.Equilibrium(**DETAILED), profiles(LINE, 6) | {"weakening_rate": RATES},
    ),
    "equilibrium, plane": (
        PLANE, st.Equilibrium(tolerance=1e-9, slip=True), profiles(PLANE, 4, 0.01),
    ),
    "rupture, line": (SHORT, st.Rupture(loading_rate=1e7), profiles(SHORT, 4)),
    "rupture, plane": (
        BREAKING_PLANE, st.Rupture(loading_rate=1e8),
        {"strength": np.stack([BREAKING_STRENGTH, 1.1 * BREAKING_STRENGTH[::-1]])},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_sample_does_not_depend_on_its_batch_or_thread(case):
    problem, method, fields = CASES[case]
    solve = method.prepare(problem)
    together = solve(problem.sample(fields))
    rows = [
        problem.sample({name: values[[i]] for name, values in fields.items()})
        for i in range(len(fields["strength"]))
    ]
    with ThreadPoolExecutor(2) as threads:
        alone = list(threads.map(solve, rows))
    assert_same(
        {name: np.concatenate([one[name] for one in alone]) for name in together}, together
    )


@pytest.mark.parametrize("workers", [3, "a spawned process"])
def test_workers_and_executors_do_not_change_a_bit(arguments, reference, workers):
    given = {"workers": workers}
    if workers != 3:
        given = {"executor": ProcessPoolExecutor(1, mp_context=get_context("spawn"))}
    with given.get("executor", nullcontext()):
        result = st.monte_carlo(**arguments, samples=SAMPLES, seed=5, **given)
    assert_same(result, reference)
    assert result.attrs == reference.attrs


@settings(max_examples=10, deadline=None)
@given(first=some.integers(0, 900), samples=some.integers(1, 400))
def test_any_batch_is_a_part_of_the_whole(first, samples):
    problem = make_problem(128, weakening_rate=0.25e12)
    experiment = Experiment(problem, beta_strength(3e-3), LOCAL, seed=3)
    whole = experiment.results(0, 1300)
    part = {name: values[first : first + samples] for name, values in whole.items()}
    assert_same(experiment.results(first, samples), part)


def test_a_batch_of_rough_planes_stays_small():
    problem = make_problem((48, 48), length=(0.02, 0.02))
    rough = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    experiment = Experiment(problem, rough, LOCAL)
    assert experiment.dimension > 100 * problem.interface.size
    assert experiment.batch * experiment.dimension <= 2**20


def field(low, high):
    marginal = st.Beta(alpha=2.0, beta=2.0, low=low, high=high)
    return st.RandomField(marginal, st.SquaredExponentialSpectrum(correlation_length=LENGTH))


SEVERAL = st.RandomInterface(
    strength=field(0.7e6, 1.6e6),
    residual_strength=field(0.0, 1e5),
    weakening_rate=field(0.3e12, 0.5e12),
    initial_stress=field(0.0, 2e5),
)


def test_an_ensemble_of_planes_may_be_continued_and_computed_again():
    names = SEVERAL.names
    given = {"method": EXACT, "seed": 3, "keep": tuple(names), "progress": False}
    plane = make_problem(*SIZES, weakening_rate=None)
    result = st.monte_carlo(plane, SEVERAL, samples=4, workers=2, **given)
    part = st.monte_carlo(plane, SEVERAL, samples=2, first=2, workers=1, **given)
    assert_same(part, result.isel(sample=slice(2, 4)))
    kept = {name: result[name].isel(sample=[1]) for name in names}
    again = st.onset(plane, kept, method=EXACT)
    assert again["critical_load"].values[0] == result["critical_load"].values[1]
    assert result["critical_position"].dims == ("sample", "direction")


SOURCES = Path(__file__).parents[2] / "src"

# The marks are printed one a method: threads, then processes that load or compile by themselves.
CODE = """
import hashlib, multiprocessing, warnings
from concurrent.futures import ProcessPoolExecutor
import stiction as st

def mark(result):
    text = b"".join(result[name].values.tobytes() for name in sorted(result.data_vars))
    return hashlib.sha256(text).hexdigest()

if __name__ == "__main__":
    warnings.simplefilter("ignore")
    problem = st.paper.problem(nodes=144)
    strength = st.paper.strength(problem)
    spawn = multiprocessing.get_context("spawn")
    for method, samples in (
        (st.LocalCriterion(), 300), (st.Equilibrium(), 300), (st.Rupture(loading_rate=1e10), 2)
    ):
        given = dict(method=method, samples=samples, seed=3)
        print(mark(st.monte_carlo(problem, strength, workers=2, **given)))
        with ProcessPoolExecutor(1, mp_context=spawn) as executor:
            print(mark(st.monte_carlo(problem, strength, executor=executor, **given)))
"""


def marks(folder):
    script = folder / "script.py"
    script.write_text(CODE)
    found = python(script, PYTHONPATH=SOURCES, NUMBA_CACHE_DIR=folder / "c").split()
    assert len(found) == 6
    return found


@pytest.mark.slow
def test_cold_warm_and_partly_warm_agree_to_the_bit(tmp_path):
    """With sums left to the compiler 2,710 of 6,000 samples differed in their last bits."""
    cold = marks(tmp_path)
    assert cold[0::2] == cold[1::2]  # threads, processes
    assert marks(tmp_path) == cold
    for kernel in ("average.", "cholesky.append", "linear_program.", "implicit."):
        entries = list(tmp_path.glob(f"c/**/{kernel}*"))
        assert entries
        for entry in entries:
            entry.unlink()
        assert marks(tmp_path) == cold, f"compiled again: {kernel}"


def test_no_kernel_may_be_reassociated():
    """Fast-math makes the order of a sum depend on what was inlined where."""
    for path in SOURCES.rglob("*.py"):
        assert "fastmath=" not in path.read_text(encoding="utf-8")
        assert '"fastmath"' not in path.read_text(encoding="utf-8")
