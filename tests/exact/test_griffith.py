"""Release rates of cracks: closed forms, and lengths that follow from them."""

import dataclasses

import numpy as np
import pytest

import stiction as st

PROBLEM = st.paper.problem(nodes=1024)
EDGE = {
    "friction": st.LinearWeakening(weakening_rate=0.5e12, residual_strength=0.4e6),
    "load": st.Load(profile=st.EdgeLoad(excess=4.0, decay=0.01, edge=0.5)),
}
LENGTH = PROBLEM.interface.length


def test_uniform_drop_is_koiters_row_of_cracks():
    """G = L drop^2 tan(pi a/L)/(2 G*), a the half-length, for any length (Koiter, 1959)."""
    whole = np.array([0.001, 0.02, 0.05, 0.09])
    found = st.theory.energy_release_rate(PROBLEM, 0.7e6, whole, centre=0.013)
    exact = LENGTH * 0.7e6**2 * np.tan(0.5 * np.pi * whole / LENGTH)
    exact /= 2.0 * PROBLEM.effective_modulus
    # The drop is interpolated between nodes, to round-off where it is uniform.
    np.testing.assert_allclose(found[:, 0], exact, rtol=1e-8)
    np.testing.assert_allclose(found[:, 1], exact, rtol=1e-8)


def test_a_short_crack_under_a_sloping_drop():
    """drop = c + s x: K = (pi a)^(1/2) (c +- s a/2) in an infinite body; here a/L = 0.005."""
    x = PROBLEM.interface.x - 0.5 * LENGTH
    initial = 1e6 * x / LENGTH
    problem = dataclasses.replace(PROBLEM, load=st.Load(initial_stress=initial))
    a = 0.005 * LENGTH
    found = st.theory.energy_release_rate(problem, 0.2e6, 2.0 * a, centre=0.5 * LENGTH)[0]
    drop = np.array([0.2e6 - 0.5 * 1e6 * a / LENGTH, 0.2e6 + 0.5 * 1e6 * a / LENGTH])
    # Neighbouring periods add (pi a/L)^2/3, 1e-4.
    exact = np.pi * a * drop**2 / (2.0 * PROBLEM.effective_modulus)
    np.testing.assert_allclose(found, exact, rtol=3e-4)


def test_lengths_of_start_and_arrest():
    problem = dataclasses.replace(PROBLEM, **EDGE)
    options = {"centre": 0.5 * LENGTH}
    start = st.theory.griffith_length(problem, 0.35e6, 0.3, **options)
    stop = st.theory.griffith_length(problem, 0.35e6, 0.3, arrest=True, **options)
    assert 0.0 < start < stop < LENGTH
    rate = st.theory.energy_release_rate(problem, 0.35e6, [start, stop], **options).min(axis=1)
    np.testing.assert_allclose(rate, 0.3, rtol=1e-8)
    assert st.theory.griffith_length(problem, 0.1e6, 0.3, **options) == np.inf
    many = st.theory.griffith_length(problem, np.array([0.1e6, 0.35e6]), 0.3, **options)
    np.testing.assert_array_equal(many, [np.inf, start])
    uniform = dataclasses.replace(problem, load=st.Load())
    assert st.theory.griffith_length(uniform, 0.9e6, 0.3, arrest=True, **options) == np.inf


def test_cracks_shorter_than_any_that_is_looked_at():
    """A short crack under a uniform drop: 2a = 4 G* Gamma/(pi drop^2)."""
    energy, stress = 1e-9, 0.7e6
    exact = 4.0 * PROBLEM.effective_modulus * energy / (np.pi * stress**2)
    assert st.theory.griffith_length(PROBLEM, stress, energy) == pytest.approx(exact, rel=1e-5)


def test_a_release_rate_that_peaks_within_a_few_nodes_is_seen():
    """A strong, narrow load: the peak lies below a 2,000th of the length, and was missed."""
    problem = st.Problem(
        st.Solid(3e9, 0.21, 2000.0),
        st.Interface(1.0, 2048),
        st.LinearWeakening(weakening_rate=2e12, residual_strength=4e5),
        st.Load(profile=st.EdgeLoad(excess=60.0, decay=4e-4)),
    )
    lengths = np.geomspace(1e-5, 0.1, 1000)
    above = st.theory.energy_release_rate(problem, 1.5e5, lengths).min(axis=1) > 1.5
    first = int(above.argmax())
    last = first + int(above[first:].argmin())
    start = st.theory.griffith_length(problem, 1.5e5, 1.5)
    stop = st.theory.griffith_length(problem, 1.5e5, 1.5, arrest=True)
    assert lengths[first - 1] < start <= lengths[first]
    assert lengths[last - 1] < stop <= lengths[last] < 5e-3


def test_a_residual_strength_in_terms_of_the_strength_is_refused():
    """It was taken for zero."""
    problem = dataclasses.replace(
        PROBLEM, friction=st.LinearWeakening(weakening_rate=0.5e12, residual_ratio=0.5)
    )
    for call in (
        lambda: st.theory.energy_release_rate(problem, 1e6, 0.01),
        lambda: st.theory.griffith_length(problem, 1e6, 1.0),
    ):
        with pytest.raises(st.InputError, match="residual_ratio"):
            call()


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda: st.theory.energy_release_rate(PROBLEM, 1e6, 0.2), "lengths"),
        (lambda: st.theory.energy_release_rate(PROBLEM, np.nan, 0.01), "load"),
        (lambda: st.theory.griffith_length(PROBLEM, 1e6, -1.0), "fracture_energy"),
        (lambda: st.theory.griffith_length(PROBLEM, [1e6, np.inf], 1.0), "load"),
        (lambda: st.theory.griffith_length(PROBLEM, "1 MPa", 1.0), "load"),
        (lambda: st.theory.energy_release_rate(PROBLEM, 1e6, "all"), "lengths"),
    ],
)
def test_mistakes(call, key):
    with pytest.raises(st.InputError, match=key):
        call()


def test_arrested_patches_are_as_long_as_griffith_says():
    """Events by equilibrium under an edge load, against G = <Gamma>: to a third in the median."""
    problem = dataclasses.replace(st.paper.problem(nodes=512), **EDGE)
    tau_p = st.paper.strength(problem, 0.5).sample(problem.interface, samples=6, seed=0)
    found = st.onset(problem, tau_p, method=st.Equilibrium(events=6), progress=False)
    energy = float(np.mean((tau_p - 0.4e6) ** 2)) / 1e12
    length = found["event_length"].values
    there = np.isfinite(length)
    stress = found["event_stress"].values[there]
    ratio = length[there] / st.theory.griffith_length(
        problem, stress, energy, centre=0.05, arrest=True
    )
    assert len(ratio) > 12
    assert 0.67 < np.median(ratio) < 1.5
