"""Release rates of cracks: closed forms, and lengths that follow from them."""

import dataclasses

import numpy as np
import pytest

import stiction as st
from stiction.theory import energy_release_rate, griffith_length

PROBLEM = st.paper.problem(nodes=1024)
EDGE = {
    "friction": st.LinearWeakening(weakening_rate=0.5e12, residual_strength=0.4e6),
    "load": st.Load(profile=st.EdgeLoad(excess=4.0, decay=0.01, edge=0.5)),
}
LENGTH, MODULUS = PROBLEM.interface.length, PROBLEM.effective_modulus


def test_uniform_drop_is_koiters_row_of_cracks():
    """G = L drop^2 tan(pi a/L)/(2 G*), a the half-length, for any length (Koiter, 1959)."""
    whole = np.array([[0.001], [0.02], [0.05], [0.09]])
    found = energy_release_rate(PROBLEM, 0.7e6, whole[:, 0], centre=0.013)
    exact = LENGTH * 0.7e6**2 * np.tan(0.5 * np.pi * whole / LENGTH) / (2.0 * MODULUS)
    # The drop is interpolated between nodes, to round-off where it is uniform.
    np.testing.assert_allclose(found, np.repeat(exact, 2, axis=1), rtol=1e-8)


def test_lengths_of_start_and_arrest():
    problem, options = dataclasses.replace(PROBLEM, **EDGE), {"centre": 0.5 * LENGTH}
    start, stop = (
        griffith_length(problem, [0.1e6, 0.35e6], 0.3, arrest=arrest, **options)
        for arrest in (False, True)
    )
    assert start[0] == np.inf
    assert start[1] < stop[1] < LENGTH
    release_rate = energy_release_rate(problem, 0.35e6, [start[1], stop[1]], **options).min(
        axis=1
    )
    np.testing.assert_allclose(release_rate, 0.3, rtol=1e-8)
    assert griffith_length(PROBLEM, 0.9e6, 0.3, arrest=True, **options) == np.inf


def test_cracks_shorter_than_any_that_is_looked_at():
    """A short crack under a uniform drop: 2a = 4 G* Gamma/(pi drop^2)."""
    exact = 4.0 * MODULUS * 1e-9 / (np.pi * 0.7e6**2)
    assert griffith_length(PROBLEM, 0.7e6, 1e-9) == pytest.approx(exact, rel=1e-5)


def test_a_release_rate_that_peaks_within_a_few_nodes_is_seen():
    """A strong, narrow load: the peak lies below a 2,000th of the length, and was missed."""
    problem = st.Problem(
        st.Solid(3e9, 0.21, 2000.0),
        st.Interface(1.0, 2048),
        st.LinearWeakening(weakening_rate=2e12, residual_strength=4e5),
        st.Load(profile=st.EdgeLoad(excess=60.0, decay=4e-4)),
    )
    lengths = np.geomspace(1e-5, 0.1, 1000)
    above = energy_release_rate(problem, 1.5e5, lengths).min(axis=1) > 1.5
    first = int(above.argmax())
    last = first + int(above[first:].argmin())
    start, stop = (
        griffith_length(problem, 1.5e5, 1.5, arrest=arrest) for arrest in (False, True)
    )
    assert lengths[first - 1] < start <= lengths[first]
    assert lengths[last - 1] < stop <= lengths[last] < 5e-3
