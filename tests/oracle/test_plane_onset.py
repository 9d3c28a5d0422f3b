"""Onset of planes against HiGHS on dense programmes, and arrest against dumb local relaxation."""

from __future__ import annotations

import numpy as np
import pytest
from planes import WAVENUMBERS, Lattice, plane_sample
from scipy.linalg import eigh
from setups import LENGTH, RATE, by_linear_programme, make_problem, smooth_noise

from stiction.elasticity.linear import lowest_eigenvector
from stiction.elasticity.operator import make_operator
from stiction.equilibrium.relaxation import BALANCED, SLIDING, least_equilibrium
from stiction.equilibrium.solver import follow
from stiction.equilibrium.transforms import Plane, PlaneProgram, plane_onset

SHAPE = (20, 20)


def dense_stiffness(plane, shape):
    """K as a matrix, from its first column."""
    column = np.fft.irfft2(plane.symbol(shape), shape)
    rows = [
        np.roll(column, np.unravel_index(i, shape), (0, 1)).ravel() for i in range(column.size)
    ]
    return np.array(rows)


@pytest.mark.parametrize("wavenumbers", ["spectral", "lattice"])
@pytest.mark.parametrize("seed", range(6))
def test_onset_and_multiplier_equal_the_linear_programme(seed, wavenumbers):
    rng = np.random.default_rng(seed)
    shape = (24, 24) if seed % 2 else (26, 24)
    plane = WAVENUMBERS[wavenumbers]((3.0 * LENGTH, 3.0 * LENGTH), 1e9, 0.33)
    strength = 0.66e6 + 1e6 * smooth_noise(rng.choice([2.0, 4.0, 8.0]), rng, shape)
    if seed % 3 == 0:  # rough
        strength *= rng.uniform(0.9, 1.1, shape)
    profile = 1.0 + 0.4 * smooth_noise(6.0, rng, shape)
    rate = RATE * (0.8 + 0.4 * smooth_noise(6.0, rng, shape))
    given = (field.ravel() for field in (rate, strength, profile))
    exact, _, multiplier = by_linear_programme(dense_stiffness(plane, shape), *given)
    multiplier = multiplier.reshape(shape)
    found = plane_onset(plane, strength, profile, rate, gap=1e-9)
    assert found.closed
    assert found.lower <= exact * (1.0 + 1e-12)  # round-off of either programme
    assert found.upper >= exact * (1.0 - 1e-12)
    assert found.lower == pytest.approx(exact, rel=1e-9)
    assert np.abs(found.multiplier - multiplier).max() < 1e-6 * multiplier.max()


def test_lowest_eigenvector_equals_a_dense_one():
    shape = (20, 16)
    plane = Plane((3.0 * LENGTH, 2.0 * LENGTH), 1e9, 0.33)
    rng = np.random.default_rng(0)
    inside = smooth_noise(4.0, rng, shape) < 0.5
    matrix = dense_stiffness(plane, shape) - RATE * np.eye(inside.size)
    nodes = np.flatnonzero(inside)
    values, vectors = eigh(matrix[np.ix_(nodes, nodes)], subset_by_index=[0, 0])
    vector = inside.astype(float)
    operator = make_operator(plane.symbol(shape), RATE, shape)
    value, _ = lowest_eigenvector(
        operator, inside.reshape(-1), vector.reshape(-1), 1e-10 * RATE, 500
    )
    assert value == pytest.approx(values[0], rel=1e-10, abs=1e-10 * RATE)
    assert np.abs(vector[inside] - np.abs(vectors[:, 0])).max() < 1e-7


def by_local_relaxation(plane, sample, load, slip, limit=60_000):
    """Every overloaded node slips a little at a time; None if the whole slides."""
    symbol = plane.symbol(SHAPE)
    step = 1.0 / np.fft.irfft2(symbol, SHAPE)[0, 0]
    for _ in range(limit):
        pull = np.fft.irfft2(symbol * np.fft.rfft2(slip.reshape(SHAPE)), SHAPE)
        stress = load * sample.profile - pull.reshape(-1)
        drive = stress - np.maximum(sample.excess - sample.rate * slip, sample.residual)
        if drive.max() < 1e-8 * sample.excess.mean():
            return slip
        if (slip > sample.critical).all():
            return None
        slip = slip + step * np.maximum(drive, 0.0)
    raise AssertionError("did not settle")


def wide_sample(seed):
    """Strength over a wide range, so that ruptures are arrested."""
    rng = np.random.default_rng(seed)
    return plane_sample(0.2e6 + 4.0e6 * smooth_noise(4.0, rng, SHAPE), 0.05e6, RATE)


@pytest.fixture
def program():
    """Equilibria of a small plane on a lattice."""
    lengths = (5.0 * LENGTH, 5.0 * LENGTH)
    found = PlaneProgram(make_problem((40, 40), lengths))  # as few nodes as SHAPE are refused
    found.plane, found.shape = Lattice(lengths, 1e9, 0.33), SHAPE
    return found


@pytest.mark.parametrize("seed", range(4))
def test_arrest_and_sliding_equal_local_relaxation(program, seed):
    sample = wide_sample(seed)
    path = follow(program, sample)
    assert path.known
    # Before and after each instability, at some distance: near one, relaxation takes for ever.
    marks = [path.first.load] + [event.before.load for event in path.events] + [path.last.load]
    loads = np.unique(np.r_[[m * (1.0 + e) for m in marks for e in (-2e-3, 2e-3)]])
    operator = make_operator(program.plane.symbol(SHAPE), RATE, SHAPE)
    slip = ours = np.zeros(sample.excess.shape)
    for load in loads:
        found = least_equilibrium(operator, sample, load, ours, accuracy=1e-10)
        ours = found.slip
        slip = by_local_relaxation(program.plane, sample, load, slip)
        if slip is None:
            assert load > path.last.load
            assert found.status == SLIDING
            break
        assert load < path.last.load
        assert found.status == BALANCED
        # `by_local_relaxation` stops at 1e-8 of the strength, over the lowest eigenvalue
        assert np.abs(ours - slip).max() < 1e-4 * sample.critical.max()
    else:
        raise AssertionError("never slid")


def test_events_move_the_interface_and_some_samples_have_them(program):
    arrested = 0
    for seed in range(4):
        sample = wide_sample(seed)
        path = follow(program, sample)
        arrested += len(path.events)
        assert path.last.load >= path.first.load
        for before, after in path.events:
            assert (after.slip >= before.slip - 1e-12 * sample.critical.max()).all()
            assert path.first.load <= before.load <= path.last.load
    assert arrested > 0
