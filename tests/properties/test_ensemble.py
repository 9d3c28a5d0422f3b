"""Sample i depends on (seed, i) and on nothing else: not on workers, executors or batches."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from checks import assert_same
from hypothesis import given, settings
from hypothesis import strategies as some
from ruptures import BREAKING_PLANE, BREAKING_STRENGTH
from setups import EXACT, LENGTH, LOCAL, beta_strength, local_onset, make_problem

import stiction as st
from stiction.ensemble.experiment import Experiment

SAMPLES = 1500  # more than one piece of the local criterion, and not a multiple of it
PLANE = make_problem((48, 40), (6.0 * LENGTH, 4.0 * LENGTH))


@pytest.fixture
def arguments(problem, make_strength):
    return {"problem": problem, "random": make_strength(), "method": LOCAL}


@pytest.fixture
def reference(arguments):
    return st.monte_carlo(**arguments, samples=SAMPLES, seed=5, workers=1)


def profiles(problem, samples, length=2e-3):
    return {"strength": beta_strength(length).sample(problem.interface, samples=samples)}


DETAILED = st.Equilibrium(gap=1e-9, slip=True, sensitivity=True)
LINE, SHORT = make_problem(96, 0.03), make_problem(128, 0.05, solid=st.paper.problem().solid)
RATES = 0.5e12 * np.array([1.0, 0.83, 1.17, 1.0, 0.9, 1.1])[:, None]
CASES = {
    "equilibrium, line": (LINE, DETAILED, profiles(LINE, 6) | {"weakening_rate": RATES}),
    "equilibrium, plane": (PLANE, DETAILED, profiles(PLANE, 4, 0.01)),
    "rupture, line": (SHORT, st.Rupture(loading_rate=1e7), profiles(SHORT, 4)),
    "rupture, plane": (
        BREAKING_PLANE, st.Rupture(loading_rate=1e8),
        {"strength": np.stack([BREAKING_STRENGTH, 1.1 * BREAKING_STRENGTH[::-1]])},
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
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


@pytest.mark.parametrize("workers", [2, 3])
def test_workers_do_not_change_a_bit(arguments, reference, workers):
    result = st.monte_carlo(**arguments, samples=SAMPLES, seed=5, workers=workers)
    assert_same(result, reference)
    assert result.attrs == reference.attrs


@pytest.mark.parametrize(
    "make",
    [
        lambda: ThreadPoolExecutor(3),
        lambda: ProcessPoolExecutor(1, mp_context=get_context("spawn")),
    ],
    ids=["threads", "a spawned process"],
)
def test_executors_do_not_change_a_bit(arguments, reference, make):
    with make() as executor:
        result = st.monte_carlo(**arguments, samples=SAMPLES, seed=5, executor=executor)
    assert_same(result, reference)


@settings(max_examples=25, deadline=None)
@given(first=some.integers(0, 900), samples=some.integers(1, 400))
def test_any_batch_is_a_part_of_the_whole(first, samples):
    problem = make_problem(128, weakening_rate=0.25e12)
    experiment = Experiment(problem, beta_strength(3e-3), LOCAL, seed=3)
    whole = experiment.results(0, 1300)
    part = {name: values[first : first + samples] for name, values in whole.items()}
    assert_same(experiment.results(first, samples), part)


@given(
    samples=some.integers(1, 5000), size=some.integers(1, 1025), first=some.integers(0, 10**9)
)
def test_batches_cover_all_samples_once(samples, size, first):
    experiment = Experiment(make_problem(), beta_strength(2e-3), LOCAL)
    pieces = list(experiment.batches(first, samples, size))
    assert sum(count for _, count in pieces) == samples
    assert pieces[0][0] == first
    for (start, count), (following, _) in pairwise(pieces):
        assert start + count == following
    assert all(0 < count <= size for _, count in pieces)


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


@pytest.mark.parametrize(
    ("method", "random", "samples"), [(LOCAL, field(0.7e6, 1.6e6), 40), (EXACT, SEVERAL, 4)]
)
def test_an_ensemble_of_planes_may_be_continued_and_computed_again(method, random, samples):
    names = getattr(random, "names", ["strength"])
    given = {"method": method, "seed": 3, "keep": tuple(names), "progress": False}
    result = st.monte_carlo(PLANE, random, samples=samples, workers=2, **given)
    part = st.monte_carlo(PLANE, random, samples=2, first=2, workers=1, **given)
    assert_same(part, result.isel(sample=slice(2, 4)))
    kept = {name: result[name].isel(sample=[1]) for name in names}
    again = st.onset(PLANE, kept, method=method)
    assert again["critical_load"].values[0] == result["critical_load"].values[1]
    assert result["critical_position"].dims == ("sample", "direction")


def test_what_else_is_random_is_independent_of_the_strength(arguments):
    marginal = st.Beta(alpha=2.0, beta=2.0, low=-1e5, high=1e5)
    initial = st.RandomField(marginal, st.PowerLawSpectrum(2e-3))
    random = st.RandomInterface(strength=arguments["random"], initial_stress=initial)
    keep = ("strength", "initial_stress")
    result = st.monte_carlo(**arguments | {"random": random}, samples=300, seed=5, keep=keep)
    kept = {name: result[name].values for name in keep}
    # 300 samples of about 20 independent lengths each: correlations scatter by 1/sqrt(6000).
    assert abs(np.corrcoef(*(values.ravel() for values in kept.values()))[0, 1]) < 0.05
    direct = local_onset(arguments["problem"], kept)
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
