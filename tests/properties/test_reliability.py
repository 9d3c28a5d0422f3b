"""What holds for every estimate: reproducibility, symmetry, and visits to every weak place."""

import math

import numpy as np
import pytest
from setups import EXACT, LOCAL, ensemble, local_onset

import stiction as st
from stiction.reliability.subset import descend
from stiction.reliability.uncertainty import generator

PROBLEM = st.paper.problem(nodes=256)
STRENGTH = st.paper.strength(PROBLEM, 0.5)


def tail(stress, algorithm="subset", target_cv=0.4, method=LOCAL, random=STRENGTH, **options):
    options |= {"algorithm": algorithm, "target_cv": target_cv, "method": method}
    return st.failure_probability(PROBLEM, random, stress, **options)


@pytest.mark.parametrize(
    ("algorithm", "stress", "method"),
    [("plain", 0.68e6, LOCAL), ("subset", 0.665e6, LOCAL), ("two_level", 0.665e6, EXACT)],
)
def test_the_same_seed_gives_the_same_numbers_for_any_workers(algorithm, stress, method):
    one, three, other = (
        tail(stress, algorithm, method=method, seed=seed, workers=workers)
        for seed, workers in ((4, 1), (4, 3), (5, 1))
    )
    assert one.probability == three.probability
    assert one.cv == three.cv
    assert one.evaluations == three.evaluations
    assert one.first_stage_evaluations == three.first_stage_evaluations
    failing, again = (run.failing_profiles["strength"] for run in (one, three))
    np.testing.assert_array_equal(failing, again)
    assert one.probability != other.probability


def test_failing_profiles_fail():
    failing = tail(0.665e6).failing_profiles
    again = local_onset(PROBLEM, failing["strength"].values)
    assert failing.sizes["sample"] > 5
    assert float(again["critical_stress"].max()) < 0.665e6
    assert failing["strength"].attrs["units"] == "Pa"


def test_subset_simulation_visits_disjoint_failure_regions():
    """Twelve half-spaces at right angles: each holds a twelfth of the failures."""
    counts = np.zeros(12)

    def lowest(draws):
        return draws[:, :12].min(axis=1)

    for seed in range(20):
        run = descend(lowest, 100, rng=generator(seed, 9), samples=1000, threshold=-4.0)
        last = run.populations[-1]
        regions = last.draws[last.values < -4.0, :12].argmin(axis=1)
        counts += np.bincount(regions, minlength=12)
        # Every single run has failures in most of the regions, not in one.
        assert np.unique(regions).size >= 5
    # Each run holds about ten independent families: 200 in all, a standard error of 0.02.
    assert np.abs(counts / counts.sum() - 1.0 / 12).max() < 0.07


def test_weak_places_are_spread_over_the_interface():
    """The failing patch is as likely anywhere: its phase 2 pi x/L averages out."""
    places = []
    for seed in range(12):
        failing = tail(0.667e6, target_cv=0.3, seed=seed).failing_profiles
        places.append(failing["critical_position"].values / PROBLEM.interface.length)
    # L/h_n is about 32: a single run's few failures lie in many different places.
    assert all(np.unique((32 * one).astype(int)).size >= 5 for one in places)
    # 12 runs with about ten families each: |mean| of 120 unit vectors, about 0.09; four times it.
    assert abs(np.mean([np.exp(2j * np.pi * one).mean() for one in places])) < 0.36
    assert np.histogram(np.concatenate(places), bins=4, range=(0.0, 1.0))[0].min() > 0


def test_curve_and_design_stress_agree_and_are_monotone():
    options = {"method": LOCAL, "target_cv": 0.3}
    curve = st.failure_curve(PROBLEM, STRENGTH, smallest=1e-5, **options)
    stress, chance = curve["stress"].values, curve["probability"].values
    for name, values in (("stress", stress), ("probability", chance)):
        assert np.all(np.diff(values) < 0.0)
        assert np.all(curve[f"{name}_low"] <= values)
        assert np.all(curve[f"{name}_high"] >= values)
    assert chance[-1] == pytest.approx(1e-5, rel=0.05)
    np.testing.assert_allclose(curve["stress_above_bound"], stress - 0.66e6)
    last = float(chance[-1])
    design = st.design_stress(PROBLEM, STRENGTH, probability=last, seed=1, **options)
    # Independent seeds; the intervals are 95 % each, so they overlap unless both are far out.
    assert design.interval[0] < float(curve["stress_high"][-1])
    assert design.interval[1] > float(curve["stress_low"][-1])
    # Where plain sampling reaches, both agree: four joint standard errors.
    onsets = ensemble(PROBLEM, STRENGTH, 4000).critical_stress.values
    counts = np.sum(onsets < stress[:, None], axis=1)
    seen = counts > 2
    assert seen.sum() >= 4
    error = np.hypot(curve["cv"].values[seen], 1.0 / np.sqrt(counts[seen]))
    assert np.all(np.abs(np.log(chance[seen] / counts[seen] * 4000.0)) < 4.0 * error)


def test_more_that_is_random_is_sampled_with_it():
    residual, initial = (
        st.RandomField(
            st.Beta(alpha=2.0, beta=2.0, low=low, high=high), STRENGTH.spectrum, mean_mode=True
        )
        for low, high in ((0.0, 0.3e6), (-0.05e6, 0.05e6))
    )
    random = st.RandomInterface(
        strength=STRENGTH, residual_strength=residual, initial_stress=initial
    )
    result = tail(0.68e6, "plain", 0.2, random=random, seed=7)
    onsets = ensemble(PROBLEM, random, result.evaluations, seed=7)["critical_stress"].values
    assert result.probability == (onsets < 0.68e6).mean()  # of the samples of the ensemble
    assert result.cv <= 0.2
    assert float(result.failing_profiles["critical_stress"].max()) < 0.68e6
    assert set(result.failing_profiles.data_vars) >= {"strength", "residual_strength"}
    rare = tail(0.68e6, target_cv=0.15, random=random)
    error = math.hypot(rare.cv, result.cv)
    assert abs(math.log(rare.probability / result.probability)) < 4.0 * error
