"""What holds for every estimate: reproducibility, symmetry, and visits to every weak place."""

import math

import numpy as np
import pytest

import stiction as st
from stiction.equilibrium.method import Equilibrium
from stiction.reliability.subset import descend
from stiction.reliability.uncertainty import generator

LOCAL = st.LocalCriterion()


@pytest.fixture(scope="module")
def system():
    problem = st.paper.problem(nodes=256)
    return problem, st.paper.strength(problem, 0.5)


def tail(system, stress, algorithm="subset", target_cv=0.4, method=LOCAL, **options):
    options |= {"algorithm": algorithm, "target_cv": target_cv, "method": method}
    return st.failure_probability(*system, stress, **options)


@pytest.mark.parametrize(("algorithm", "stress"), [("plain", 0.68e6), ("subset", 0.665e6)])
def test_the_same_seed_gives_the_same_numbers_for_any_workers(system, algorithm, stress):
    one, three, other = (
        tail(system, stress, algorithm, seed=seed, workers=workers)
        for seed, workers in ((4, 1), (4, 3), (5, 1))
    )
    assert one.probability == three.probability
    assert one.cv == three.cv
    assert one.evaluations == three.evaluations
    failing, again = (run.failing_profiles["strength"] for run in (one, three))
    np.testing.assert_array_equal(failing, again)
    assert one.probability != other.probability


def test_two_levels_are_reproducible(system):
    one, two = (
        tail(system, 0.665e6, "two_level", 0.5, Equilibrium(), seed=2, workers=workers)
        for workers in (1, 2)
    )
    assert one.probability == two.probability
    assert one.first_stage_evaluations == two.first_stage_evaluations


def test_plain_monte_carlo_counts_the_samples_of_the_ensemble(system):
    result = tail(system, 0.69e6, "plain", 0.2, seed=7)
    ensemble = st.monte_carlo(*system, method=LOCAL, samples=result.evaluations, seed=7)
    below = ensemble["critical_stress"].values < 0.69e6
    assert result.probability == below.mean()
    assert result.cv <= 0.2
    assert float(result.failing_profiles["critical_stress"].max()) < 0.69e6


def test_failing_profiles_fail(system):
    result = tail(system, 0.665e6)
    failing = result.failing_profiles
    again = st.onset(system[0], failing["strength"].values, method=LOCAL)
    assert failing.sizes["sample"] > 5
    assert float(again["critical_stress"].max()) < 0.665e6
    assert failing["strength"].attrs["units"] == "Pa"


def test_subset_simulation_visits_disjoint_failure_regions():
    """Twelve half-spaces at right angles: each holds a twelfth of the failures."""
    places = 12

    def lowest(draws):
        return draws[:, :places].min(axis=1)

    counts = np.zeros(places)
    for seed in range(20):
        run = descend(lowest, 100, rng=generator(seed, 9), samples=1000, threshold=-4.0)
        last = run.populations[-1]
        failed = last.values < -4.0
        counts += np.bincount(last.draws[failed, :places].argmin(axis=1), minlength=places)
        # Every single run has failures in most of the regions, not in one.
        assert np.unique(last.draws[failed, :places].argmin(axis=1)).size >= 5
    shares = counts / counts.sum()
    # Each run holds about ten independent families: 200 in all, a standard error of 0.02.
    assert np.abs(shares - 1.0 / places).max() < 0.07


def test_weak_places_are_spread_over_the_interface(system):
    """The failing patch is as likely anywhere: its phase 2 pi x/L averages out."""
    positions, runs = [], []
    for seed in range(12):
        failing = tail(system, 0.667e6, target_cv=0.3, seed=seed).failing_profiles
        places = failing["critical_position"].values / system[0].interface.length
        positions.append(places)
        runs.append(np.exp(2j * np.pi * places).mean())
    # L/h_n is about 32: a single run's few failures lie in many different places.
    assert all(np.unique((32 * places).astype(int)).size >= 5 for places in positions)
    # 12 runs with about ten families each: |mean| of 120 unit vectors, about 0.09; four times it.
    assert abs(np.mean(runs)) < 0.36
    histogram = np.histogram(np.concatenate(positions), bins=4, range=(0.0, 1.0))[0]
    assert histogram.min() > 0


def test_curve_and_design_stress_agree_and_are_monotone(system):
    options = {"smallest": 1e-5, "points_per_decade": 2, "target_cv": 0.3}
    curve = st.failure_curve(*system, method=LOCAL, **options)
    stress, chance = curve["stress"].values, curve["probability"].values
    for name, values in (("stress", stress), ("probability", chance)):
        assert np.all(np.diff(values) < 0.0)
        assert np.all(curve[f"{name}_low"] <= values)
        assert np.all(curve[f"{name}_high"] >= values)
    assert chance[-1] == pytest.approx(1e-5, rel=0.05)
    np.testing.assert_allclose(curve["stress_above_bound"], stress - 0.66e6)
    design = st.design_stress(
        *system, probability=float(chance[-1]), method=LOCAL, target_cv=0.3, seed=1
    )
    # Independent seeds; the intervals are 95 % each, so they overlap unless both are far out.
    assert design.interval[0] < float(curve["stress_high"][-1])
    assert design.interval[1] > float(curve["stress_low"][-1])
    # Where plain sampling reaches, both agree: four joint standard errors.
    onsets = st.monte_carlo(*system, method=LOCAL, samples=4000).critical_stress.values
    counts = np.sum(onsets < stress[:, None], axis=1)
    seen = counts > 2
    assert seen.sum() >= 4
    error = np.hypot(curve["cv"].values[seen], 1.0 / np.sqrt(counts[seen]))
    assert np.all(np.abs(np.log(chance[seen] / counts[seen] * 4000.0)) < 4.0 * error)


def test_more_that_is_random_is_sampled_with_it(system):
    problem, strength = system
    residual, initial = (
        st.RandomField(
            st.Beta(alpha=2.0, beta=2.0, low=low, high=high), strength.spectrum, mean_mode=True
        )
        for low, high in ((0.0, 0.3e6), (-0.05e6, 0.05e6))
    )
    random = st.RandomInterface(
        strength=strength, residual_strength=residual, initial_stress=initial
    )
    result = tail((problem, random), 0.68e6, "plain", 0.2)
    ensemble = st.monte_carlo(problem, random, method=LOCAL, samples=result.evaluations)
    assert result.probability == (ensemble["critical_stress"].values < 0.68e6).mean()
    assert set(result.failing_profiles.data_vars) >= {"strength", "residual_strength"}
    rare = tail((problem, random), 0.68e6, target_cv=0.15)
    error = math.hypot(rare.cv, result.cv)
    assert abs(math.log(rare.probability / result.probability)) < 4.0 * error
