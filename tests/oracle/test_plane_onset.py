"""Onset of planes against HiGHS on dense programmes, and arrest against dumb local relaxation."""

from __future__ import annotations

import numpy as np
import pytest
from planes import WAVENUMBERS, Lattice, plane_sample
from scipy.linalg import eigh
from scipy.optimize import linprog

import stiction as st
from stiction.elasticity.linear import lowest_eigenvector
from stiction.elasticity.operator import make_operator
from stiction.equilibrium.relaxation import BALANCED, SLIDING, least_equilibrium
from stiction.equilibrium.solver import follow
from stiction.equilibrium.transforms import Plane, PlaneProgram, plane_onset

RATE = 0.5e12
SHAPE = (20, 20)
LENGTH = 3.46e-3  # nucleation length h_n of plane strain at G = 1 GPa, nu = 0.33 and that rate


def smooth_noise(shape, correlation, rng):
    """Field between 0 and 1 with a correlation length given in nodes."""
    kx, ky = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]
    filtered = np.fft.irfft2(
        np.fft.rfft2(rng.standard_normal(shape))
        * np.exp(-((correlation * np.hypot(kx, ky)) ** 2)),
        shape,
    )
    return (filtered - filtered.min()) / np.ptp(filtered)


def dense_stiffness(plane, shape):
    """K as a matrix, from its first column."""
    column = np.fft.irfft2(plane.symbol(shape), shape)
    rows = [
        np.roll(column, np.unravel_index(i, shape), (0, 1)).ravel() for i in range(column.size)
    ]
    return np.array(rows)


def by_linear_programme(plane, strength, profile, rate):
    """max tau_0: (K - W) d + s - tau_0 p >= 0, d >= 0, by HiGHS; the onset and its multiplier."""
    matrix = (dense_stiffness(plane, strength.shape) - np.diag(rate.ravel())) / RATE
    result = linprog(
        np.r_[np.zeros(strength.size), -1.0],
        A_ub=np.c_[-matrix, profile.ravel()],
        b_ub=strength.ravel() / 1e6,
        bounds=[(0, None)] * strength.size + [(None, None)],
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert result.status == 0
    return result.x[-1] * 1e6, -result.ineqlin.marginals.reshape(strength.shape)


@pytest.mark.parametrize("wavenumbers", ["spectral", "lattice"])
@pytest.mark.parametrize("seed", range(6))
def test_onset_and_multiplier_equal_the_linear_programme(seed, wavenumbers):
    rng = np.random.default_rng(seed)
    shape = (24, 24) if seed % 2 else (26, 24)
    plane = WAVENUMBERS[wavenumbers]((3.0 * LENGTH, 3.0 * LENGTH), 1e9, 0.33)
    strength = 0.66e6 + 1e6 * smooth_noise(shape, rng.choice([2.0, 4.0, 8.0]), rng)
    if seed % 3 == 0:  # rough
        strength *= rng.uniform(0.9, 1.1, shape)
    profile = 1.0 + 0.4 * smooth_noise(shape, 6.0, rng)
    rate = RATE * (0.8 + 0.4 * smooth_noise(shape, 6.0, rng))
    exact, multiplier = by_linear_programme(plane, strength, profile, rate)
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
    inside = smooth_noise(shape, 4.0, rng) < 0.5
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
    return plane_sample(0.2e6 + 4.0e6 * smooth_noise(SHAPE, 4.0, rng), 0.05e6, RATE)


@pytest.fixture
def program(solid):
    """Equilibria of a small plane on a lattice."""
    length = 5.0 * LENGTH
    friction = st.LinearWeakening(weakening_rate=RATE)
    fine = st.Interface(
        (length, length), (40, 40)
    )  # a problem may not have as few nodes as SHAPE
    found = PlaneProgram(st.Problem(solid, fine, friction))
    found.plane, found.shape = Lattice((length, length), 1e9, 0.33), SHAPE
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
