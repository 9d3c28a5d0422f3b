"""Release rates of cracks: closed forms, and lengths that follow from them."""

import dataclasses

import numpy as np
import pytest
import scipy.linalg
from setups import exact_onset

import stiction as st
from stiction.elasticity import line
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


def test_a_short_crack_under_a_sloping_drop():
    """drop = c + s x: K = (pi a)^(1/2) (c +- s a/2) in an infinite body; here a/L = 0.005."""
    initial = 1e6 * (PROBLEM.interface.x - 0.5 * LENGTH) / LENGTH
    problem = dataclasses.replace(PROBLEM, load=st.Load(initial_stress=initial))
    a = 0.005 * LENGTH
    found = energy_release_rate(problem, 0.2e6, 2.0 * a, centre=0.5 * LENGTH)[0]
    drop = 0.2e6 + 0.5 * 1e6 * a / LENGTH * np.array([-1.0, 1.0])
    # Neighbouring periods add (pi a/L)^2/3, 1e-4.
    np.testing.assert_allclose(found, np.pi * a * drop**2 / (2.0 * MODULUS), rtol=3e-4)


def test_lengths_of_start_and_arrest():
    problem, options = dataclasses.replace(PROBLEM, **EDGE), {"centre": 0.5 * LENGTH}
    start = griffith_length(problem, 0.35e6, 0.3, **options)
    stop = griffith_length(problem, 0.35e6, 0.3, arrest=True, **options)
    assert 0.0 < start < stop < LENGTH
    rate = energy_release_rate(problem, 0.35e6, [start, stop], **options).min(axis=1)
    np.testing.assert_allclose(rate, 0.3, rtol=1e-8)
    assert griffith_length(problem, 0.1e6, 0.3, **options) == np.inf
    many = griffith_length(problem, np.array([0.1e6, 0.35e6]), 0.3, **options)
    assert many == pytest.approx([np.inf, start], rel=1e-12)
    uniform = dataclasses.replace(problem, load=st.Load())
    assert griffith_length(uniform, 0.9e6, 0.3, arrest=True, **options) == np.inf


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


def test_arrested_patches_are_as_long_as_griffith_says():
    """Events by equilibrium under an edge load, against G = <Gamma>: to a third in the median."""
    problem = dataclasses.replace(st.paper.problem(nodes=512), **EDGE)
    tau_p = st.paper.strength(problem, 0.5).sample(problem.interface, samples=6, seed=0)
    found = exact_onset(problem, tau_p, events=6)
    energy = float(np.mean((tau_p - 0.4e6) ** 2)) / 1e12
    there = np.isfinite(found["event_length"].values)
    stress = found["event_stress"].values[there]
    griffith = griffith_length(problem, stress, energy, centre=0.05, arrest=True)
    ratio = found["event_length"].values[there] / griffith
    assert len(ratio) > 12
    assert 0.67 < np.median(ratio) < 1.5


@pytest.mark.parametrize(("run", "share"), [(4, 0.04), (48, 0.42), (64, 0.49), (512, 0.90)])
def test_residual_run_of_a_crack_in_equilibrium_is_shorter_than_griffiths_length(run, share):
    """On a uniform interface, W = G*/60 per node; so runs as long as that cannot stop."""
    column, rate = line.stiffness_column(8192, 8192.0, 1.0), 1.0 / 60.0
    for ends in range(1, 100):
        size = run + 2 * ends
        weakens = np.ones(size)
        weakens[ends : ends + run] = 0.0
        matrix = scipy.linalg.toeplitz(column[:size]) - rate * np.diag(weakens)
        slope, start = np.linalg.solve(matrix, np.stack([np.ones(size), -weakens], 1)).T
        edge = [0.5 * (one[ends] + one[ends - 1]) for one in (slope, start)]
        drop = (1.0 / rate - edge[1]) / edge[0]  # the run ends where slip is the critical one
        slip = drop * slope + start
        if slip.min() >= 0.0 and drop - column[size:0:-1] @ slip <= 1.0:  # the next node holds
            break
    length = 4.0 * (0.5 / rate) / (np.pi * drop**2)
    assert run / length == pytest.approx(share, abs=0.02)
    assert run < length
