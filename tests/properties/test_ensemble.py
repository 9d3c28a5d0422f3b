"""Sample i depends on (seed, i) and on nothing else: not on workers, executors or batches."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from setups import beta_strength, make_problem

import stiction as st
from stiction.ensemble.experiment import Experiment

SAMPLES = 1500  # more than one piece of the local criterion, and not a multiple of it


@pytest.fixture
def arguments(problem, make_strength):
    return {"problem": problem, "random": make_strength(), "method": st.LocalCriterion()}


@pytest.fixture
def reference(arguments):
    return st.monte_carlo(**arguments, samples=SAMPLES, seed=5, workers=1)


def assert_same_bits(left, right):
    assert set(left.variables) == set(right.variables)
    for name in left.variables:
        assert left[name].dtype == right[name].dtype
        assert left[name].values.tobytes() == right[name].values.tobytes(), name


@pytest.mark.parametrize("workers", [2, 3])
def test_workers_do_not_change_a_bit(arguments, reference, workers):
    result = st.monte_carlo(**arguments, samples=SAMPLES, seed=5, workers=workers)
    assert_same_bits(result, reference)
    assert result.attrs == reference.attrs


@pytest.mark.parametrize(
    "make",
    [
        lambda: ThreadPoolExecutor(3),
        lambda: ProcessPoolExecutor(2, mp_context=get_context("spawn")),
    ],
    ids=["threads", "spawned processes"],
)
def test_executors_do_not_change_a_bit(arguments, reference, make):
    with make() as executor:
        result = st.monte_carlo(**arguments, samples=SAMPLES, seed=5, executor=executor)
    assert_same_bits(result, reference)


@settings(max_examples=25, deadline=None)
@given(first=some.integers(0, 900), samples=some.integers(1, 400))
def test_any_batch_is_a_part_of_the_whole(first, samples):
    problem = make_problem(128, weakening_rate=0.25e12)
    experiment = Experiment(problem, beta_strength(3e-3), st.LocalCriterion(), seed=3)
    whole = experiment.results(0, 1300)
    part = experiment.results(first, samples)
    for name, values in part.items():
        assert values.tobytes() == whole[name][first : first + samples].tobytes()


@given(
    samples=some.integers(1, 5000), size=some.integers(1, 1025), first=some.integers(0, 10**9)
)
def test_batches_cover_all_samples_once(samples, size, first):
    problem = st.paper.problem(nodes=256)
    experiment = Experiment(problem, st.paper.strength(problem), st.LocalCriterion())
    pieces = list(experiment.batches(first, samples, size))
    assert sum(count for _, count in pieces) == samples
    assert pieces[0][0] == first
    for (start, count), (following, _) in pairwise(pieces):
        assert start + count == following
    assert all(0 < count <= size for _, count in pieces)


def test_a_batch_of_rough_planes_stays_small():
    problem = make_problem((48, 48), length=(0.02, 0.02))
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    experiment = Experiment(problem, field, st.LocalCriterion())
    assert experiment.dimension > 100 * problem.interface.size
    assert experiment.batch * experiment.dimension <= 2**20


def test_an_ensemble_may_be_continued(arguments, reference):
    rest = st.monte_carlo(**arguments, samples=SAMPLES - 700, seed=5, first=700)
    np.testing.assert_array_equal(rest["sample"], np.arange(700, SAMPLES))
    np.testing.assert_array_equal(rest["critical_load"], reference["critical_load"][700:])


def test_seeds_differ(arguments, reference):
    other = st.monte_carlo(**arguments, samples=SAMPLES, seed=6)
    assert not np.any(other["critical_load"].values == reference["critical_load"].values)


def test_what_else_is_random_is_independent_of_the_strength(arguments, make_strength):
    marginal = st.Beta(alpha=2.0, beta=2.0, low=-1e5, high=1e5)
    initial = st.RandomField(marginal, st.PowerLawSpectrum(2e-3))
    random = st.RandomInterface(strength=arguments["random"], initial_stress=initial)
    keep = ("strength", "initial_stress")
    result = st.monte_carlo(**arguments | {"random": random}, samples=300, seed=5, keep=keep)
    profiles = {name: result[name].values for name in keep}
    strength, stress = profiles.values()
    # 300 samples of about 20 independent lengths each: correlations scatter by 1/sqrt(6000).
    assert abs(np.corrcoef(strength.ravel(), stress.ravel())[0, 1]) < 0.05
    direct = st.onset(arguments["problem"], profiles, method=st.LocalCriterion())
    np.testing.assert_array_equal(result["critical_load"], direct["critical_load"])


def test_what_is_kept_does_not_depend_on_the_samples_around_it(arguments):
    result = st.monte_carlo(**arguments, samples=40, first=10, keep=("strength",))
    assert result["strength"].dims == ("sample", "x")
    direct = arguments["random"].sample(arguments["problem"].interface, first=49)[0]
    np.testing.assert_array_equal(result["strength"].sel(sample=49), direct)
    one = st.monte_carlo(**arguments, samples=1, first=12, keep=("strength",))
    np.testing.assert_array_equal(result["strength"].sel(sample=[12]), one["strength"])


def test_progress_counts_every_sample_once(arguments):
    seen = []
    st.monte_carlo(
        **arguments, samples=SAMPLES, workers=2, progress=lambda *now: seen.append(now)
    )
    assert seen[-1] == (SAMPLES, SAMPLES)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
