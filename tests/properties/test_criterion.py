"""Symmetries of the local criterion."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as hs
from setups import beta_strength, make_problem

import stiction as st

PROBLEM = make_problem(128)
STRENGTH = beta_strength(2e-3)


def onset(tau_p):
    result = st.onset(PROBLEM, tau_p, method=st.LocalCriterion())
    return float(result.critical_load[0]), float(result.critical_position[0])


def on_circle(difference):
    return abs((difference + 0.05) % 0.1 - 0.05)


@settings(max_examples=50, deadline=None)
@given(sample=hs.integers(0, 1000), shift=hs.integers(0, 127))
def test_translation_moves_the_place_and_keeps_the_load(sample, shift):
    tau_p = STRENGTH.sample(PROBLEM.interface, samples=1, first=sample)
    load, place = onset(tau_p)
    moved_load, moved_place = onset(np.roll(tau_p, shift, axis=1))
    assert abs(moved_load / load - 1.0) < 1e-12
    # The slope vanishes at the minimum: round-off of the load is the square of that of the place.
    assert on_circle(moved_place - place - shift * PROBLEM.interface.spacing) < 1e-8


@settings(max_examples=50, deadline=None)
@given(sample=hs.integers(0, 1000))
def test_reflection_mirrors_the_place_and_keeps_the_load(sample):
    tau_p = STRENGTH.sample(PROBLEM.interface, samples=1, first=sample)
    load, place = onset(tau_p)
    mirrored = np.roll(tau_p[:, ::-1], 1, axis=1)  # x -> -x on the circle
    mirrored_load, mirrored_place = onset(mirrored)
    assert abs(mirrored_load / load - 1.0) < 1e-12
    assert on_circle(mirrored_place + place) < 1e-8


@settings(max_examples=50, deadline=None)
@given(
    sample=hs.integers(0, 1000),
    factor=hs.floats(0.1, 10.0),
    offset=hs.floats(0.0, 1e6),
)
def test_affine_scaling_of_the_strength_scales_the_load(sample, factor, offset):
    tau_p = STRENGTH.sample(PROBLEM.interface, samples=1, first=sample)
    load, place = onset(tau_p)
    scaled_load, scaled_place = onset(factor * tau_p + offset)
    assert abs(scaled_load / (factor * load + offset) - 1.0) < 1e-12
    assert on_circle(scaled_place - place) < 1e-8


@settings(max_examples=50, deadline=None)
@given(sample=hs.integers(0, 1000))
def test_lies_between_the_weakest_node_and_the_mean(sample):
    tau_p = STRENGTH.sample(PROBLEM.interface, samples=1, first=sample)
    load, _ = onset(tau_p)
    assert tau_p.min() < load <= tau_p.mean() * (1.0 + 1e-12)


@settings(max_examples=100, deadline=None)
@given(
    levels=hs.lists(hs.floats(0.0, 9.0), min_size=2, max_size=12),
    seed=hs.integers(0, 1000),
)
def test_lies_between_the_least_and_the_greatest_strength_whatever_the_jumps(levels, seed):
    """Blocks of strengths over nine decades, 4.4 nodes in h_n."""
    rng = np.random.default_rng(seed)
    tau_p = np.repeat(10.0 ** np.array(levels), 11)[: 128 - 1]
    tau_p = np.append(tau_p, np.full(128 - tau_p.size, tau_p[-1])) * rng.uniform(0.9, 1.1, 128)
    load, _ = onset(tau_p)
    tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)
    assert tau_p.min() <= load <= tau_n.min()
    assert tau_n.max() <= tau_p.max()
