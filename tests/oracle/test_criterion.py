"""The local criterion against its definition, its bounds, theory and exact onsets."""

import itertools
import re
import warnings

import numpy as np
import pytest
from checks import assert_mean
from contracts.bodies import BODIES, FIELD
from hypothesis import given, settings
from hypothesis import strategies as hs
from oracles import symbol_of, times
from recording import stored
from setups import (
    LENGTH,
    LOCAL,
    RATE,
    ROUND_OFF,
    beta_strength,
    ensemble,
    exact_onset,
    examples,
    local_onset,
    make_problem,
    turns,
    within,  # noqa: F401  # cases.json calls it
    without,
)
from specimens import crooked, rough

import stiction as st
from stiction.elasticity.line import line_of
from stiction.methods.criterion.average import averages
from stiction.methods.criterion.onset_bracket import slides
from stiction.methods.criterion.windows import windows_of


# Error of a polynomial through ten nodes where the strength varies within a quarter of h_n, in
# standard deviations of the strength (0.2 MPa); h_n is 9 and 35 nodes.
@pytest.mark.parametrize(("nodes", "rms", "largest"), [(256, 4e-3, 3e-2), (1024, 4e-6, 2e-5)])
def test_minimum_is_that_of_the_interpolant(make_strength, nodes, rms, largest):
    """Against a grid sixteen times finer, made by padding the spectrum with zeros."""
    problem = make_problem(nodes)
    tau_p = make_strength(0.25).sample(problem.interface, samples=512, seed=2)
    tau_n = st.theory.nucleation_stress(problem, problem.sample(tau_p))
    result = local_onset(problem, tau_p)
    spectrum = np.fft.rfft(tau_n, axis=1)
    spectrum[:, -1] *= 0.5  # the Nyquist mode is shared between both of its signs
    fine = np.fft.irfft(spectrum, 16 * nodes, axis=1) * 16.0
    found = result.critical_load.values
    # A fine spacing off by half costs (dx/2)^2/2 times the curvature at most.
    rows, at = np.arange(512), fine.argmin(axis=1)
    beside = fine[rows, at - 1] + fine[rows, (at + 1) % (16 * nodes)]
    allowed = 0.0625 * (beside - 2.0 * fine[rows, at]) / 0.2e6
    error = (found - fine[rows, at]) / 0.2e6 + allowed
    assert np.sqrt(np.mean(np.maximum(np.abs(error) - allowed, 0.0) ** 2)) < rms
    assert np.all(np.abs(error) <= allowed + largest)
    place = at / (16.0 * nodes) * 0.1
    distance = np.abs((result.critical_position.values - place + 0.05) % 0.1 - 0.05)
    assert np.mean(distance <= 0.1 / (4.0 * nodes)) > 0.95


@pytest.mark.parametrize("contrast", [10.0, 1e6])
def test_a_barrier_leaves_the_weak_stretch_beside_it_alone(contrast):
    """The patch that lets go lies where there is no barrier, so its strength does not matter."""
    problem = make_problem(384)
    x = problem.interface.x
    # Uniform, and with a dip in the middle of the rest.
    for weak in (np.full(384, 1e6), 1e6 - 3e5 * np.exp(-(((x - 0.08) / 0.004) ** 2))):
        barred = np.where((x > 0.025) & (x < 0.05), contrast * 1e6, weak)
        without, found = (local_onset(problem, s).critical_load.item() for s in (weak, barred))
        assert found == pytest.approx(without, rel=1e-9)


def lognormal(xi, cv=0.3):
    return st.RandomField(st.Lognormal(mean=1e6, cv=cv), st.PowerLawSpectrum(xi), True)


def doubts(problem, tau_p):
    """Share by which the local criterion is off, in per cent; what `onset` says of it."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        local = local_onset(problem, tau_p).critical_stress.values
    texts = [str(one.message) for one in found if "differs from the exact" in str(one.message)]
    return local, exact_onset(problem, tau_p).critical_stress.values, texts


DOUBTED = stored("cases")["doubted"]
"""Problem, scatter, and the correlation length over the nucleation length.

The line has 30 nodes in h_n, and nodes near ends take over what windows leave out.
"""


@pytest.mark.parametrize("kind", DOUBTED)
def test_onset_says_how_far_the_local_criterion_is_off(kind):
    """Nodes at their residual strength, a short correlation length, ends, and a low pusher."""
    problem, spread, share = eval(DOUBTED[kind])
    size = problem.nucleation_length
    tau_p = lognormal(share * size, spread).sample(problem.interface, samples=40, seed=11)
    local, exact, (text,) = doubts(problem, tau_p)
    count = int(re.search(r"in the first (\d+) of 40", text)[1])
    assert count == (count if kind == "specimen" else 32) > 4
    off = 100.0 * (local - exact)[:count] / exact[:count].mean()
    assert f"by {off.mean():+.2g} % on average, with a scatter of {off.std():.2g} %" in text
    # With a strength that varies little, under dead load, nothing is said.
    if kind == "specimen":
        problem = crooked()
    calm = lognormal(0.5 * size, 0.02).sample(problem.interface, samples=10, seed=11)
    assert doubts(problem, calm)[2] == []


def test_equilibrium_is_not_prepared_where_a_quick_test_leaves_no_doubt(monkeypatch):
    """The first lines of the README need no kernels of equilibrium; a wide strength does."""
    prepared = []

    def prepare(method, problem):
        prepared.append(problem)
        raise RuntimeError

    monkeypatch.setattr(st.Equilibrium, "prepare", prepare)
    problem = st.paper.problem(nodes=1024)
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    result = st.monte_carlo(problem, strength, method=st.LocalCriterion(), samples=1000)
    assert "pilot_bias" not in result.attrs
    local_onset(problem, strength.sample(problem.interface, samples=3, seed=1))
    assert not prepared
    wide = lognormal(0.5 * problem.nucleation_length, 0.5).sample(problem.interface, seed=1)
    with pytest.raises(RuntimeError):
        local_onset(problem, wide)
    assert prepared


@pytest.mark.parametrize("ratio", [0.0, 0.3])
def test_a_line_slides_above_its_exact_onset_only(ratio):
    """With arrested events, nodes at their residual strength and everything varying."""
    x = turns(256)
    load = st.Load(profile=1.0 + 0.2 * np.cos(x), initial_stress=2e5)
    problem = make_problem(256, 0.03, load=load, friction=st.LinearWeakening())
    field = lognormal(0.5 * LENGTH, 0.3)
    tau_p = np.maximum(field.sample(problem.interface, samples=12, seed=4), 3e5)
    weakening_rate = RATE * (1.0 + 0.3 * np.sin(3.0 * x))
    profiles = {
        "strength": tau_p, "residual_strength": ratio * tau_p, "weakening_rate": weakening_rate
    }  # fmt: skip
    exact = exact_onset(problem, profiles)
    assert (exact.arrested_events > 0).any()
    sample = problem.sample(profiles)
    column = line_of(problem.half_spaces, 256).entries.column
    for i, load in enumerate(exact.critical_load.values):
        peak, residual = sample.strength[i] - 2e5, sample.residual_strength[i] - 2e5
        row = column, peak, residual, sample.weakening_rate[i]
        # Where a patch stops, the gap between both is the tolerance of the overstress.
        assert slides(*row, (1.0 - 1e-3) * load * sample.load_profile) is False
        assert slides(*row, (1.0 + 1e-3) * load * sample.load_profile) is True


MACHINES = examples("machines")


@pytest.mark.parametrize("name", MACHINES)
def test_behind_a_machine_the_local_criterion_returns_a_stress_and_not_the_drive(name):
    """Its drive is an upper bound; the slip of the patch takes most of what the exact slip does."""
    mode = "II" if name in ("rigid platen", "left pusher") else "III"
    rate = 0.16e12 if mode == "II" else 0.3e12  # below it nodes reach their residual strength
    problem = crooked(drive=MACHINES[name], mode=mode, weakening_rate=rate, residual=0.0)
    tau_p = rough(problem, 5, 12)
    local, exact = local_onset(problem, tau_p), exact_onset(problem, tau_p, slip=True)
    relief = problem.blocks.mean_relief(exact.slip.values)
    initial = problem.load.initial_stress.mean()
    first, found = (one.first_instability.values - initial for one in (exact, local))
    np.testing.assert_array_equal(local.critical_stress, local.first_instability)
    assert (local.critical_load > (first + relief) * (1.0 - 1e-9)).all()
    assert (found < local.critical_load).all()
    of_drive = (local.critical_load / first - 1.0).mean()
    assert 0.0 < found.mean() / first.mean() - 1.0 < of_drive
    if mode == "II":
        assert 0.6 < (local.critical_load.values - found).mean() / relief.mean() < 1.2


PLANE = make_problem((48, 48), (5.0 * LENGTH, 4.0 * LENGTH))


@settings(max_examples=40, deadline=None)
@given(levels=hs.lists(hs.floats(3.0, 9.0), min_size=2, max_size=12), seed=hs.integers(0, 1000))
def test_lies_between_the_least_and_the_greatest_strength_whatever_the_jumps(levels, seed):
    """Blocks of strengths over six decades, and a load that jumps, 4.4 nodes in h_n."""
    rng = np.random.default_rng(seed)
    tau_p = np.repeat(10.0 ** np.array(levels), 11)[: 128 - 1]
    tau_p = np.append(tau_p, np.full(128 - tau_p.size, tau_p[-1])) * rng.uniform(0.9, 1.1, 128)
    profile = np.where(np.arange(128) < 20, 1.0, 1e-3)
    problem = make_problem(128, load=st.Load(profile=profile))
    load = local_onset(problem, tau_p).critical_load.item()
    tau_n, ratio = st.theory.nucleation_stress(problem, tau_p), tau_p / profile
    least, most = (1.0 - ROUND_OFF) * ratio.min(), (1.0 + ROUND_OFF) * ratio.max()
    assert least <= load <= tau_n.min() * (1.0 + ROUND_OFF)
    assert tau_n.max() <= most


def test_weights_certify_the_bound():
    """(K - W) y <= 0 everywhere, with spectral wave vectors too: an upper bound."""
    for window in windows_of(PLANE, RATE):
        y = window.weight
        assert y.min() >= 0.0
        assert y.sum() == pytest.approx(1.0, rel=1e-12)
        forces = times(symbol_of(PLANE), y) - RATE * y
        assert forces.max() < 1e-6 * RATE * y.max()  # residual of the eigenvector


@pytest.mark.parametrize("mean_mode", [False, True])
def test_variance_of_the_nucleation_stress_of_a_plane_is_that_of_theory(mean_mode):
    field = beta_strength(LENGTH, mean_mode=mean_mode, anisotropy=1.4)
    theory = st.theory.nucleation_statistics(PLANE, field)
    middle = windows_of(PLANE, RATE, stretches=(1.0,))
    strength = field.sample(PLANE.interface, samples=400, seed=2)
    each = averages(PLANE.interface, middle, strength, np.ones((48, 48)))
    tau_n = np.array([next(windows) for windows in each])
    assert_mean(((tau_n - theory.mean) ** 2).mean(axis=(1, 2)), theory.variance, errors=4.0)
    assert_mean(tau_n.mean(axis=(1, 2)), theory.mean, errors=4.0)


def test_failure_probability_of_a_plane_is_that_of_counting():
    plane = make_problem((20, 24), (4.0 * LENGTH, 3.5 * LENGTH))
    field = beta_strength(0.7 * LENGTH)
    options = {"method": LOCAL, "progress": False, "target_cv": 0.25}
    onsets = ensemble(plane, field, 3000, seed=9).critical_stress.values
    stress, counted, own = float(np.quantile(onsets, 0.01)), 0.01, 1.0 / np.sqrt(30.0)
    found = st.failure_probability(plane, field, stress, algorithm="subset", seed=1, **options)
    assert abs(found.probability / counted - 1.0) < 4.0 * np.hypot(own, found.cv)
    assert found.failing_profiles.strength.dims[-2:] == ("x", "y")


@pytest.mark.parametrize("name", ["blocks", "blocks with an extent"])
def test_the_weakest_run_of_nodes_of_a_specimen_by_dense_eigenvectors(name):
    """Of all shortest runs on which K - W is unstable; each sample has its own W."""
    problem, rates = BODIES[name], np.array([0.2e12, 0.3e12, 0.2e12])
    free, spacing = problem.interface.breakable, problem.interface.spacing
    strength = FIELD.sample(problem.interface, samples=3, seed=5)
    profiles = {"strength": strength, "weakening_rate": np.outer(rates, np.ones(free.size))}
    problem = without(problem, "friction.weakening_rate")
    found, excess = local_onset(problem, profiles), strength - problem.load.initial_stress
    for number, rate in enumerate(rates):
        runs: dict[tuple[int, int], float] = {}
        for width, start in itertools.product(range(1, 12), range(free.size)):
            end, run = start + width, slice(start, start + width)
            within_run = any(start <= a and b <= end for a, b in runs)
            if end > free.size or within_run or not free[run].all():
                continue
            values, modes = np.linalg.eigh(problem.blocks.stiffness[run, run])
            if values[0] <= rate:
                y = np.abs(modes[:, 0])
                runs[start, end] = excess[number, run] @ y / (problem.load_profile[run] @ y)
        start, end = min(runs, key=runs.__getitem__)
        told = found.isel(sample=number)
        assert told.critical_load.item() == pytest.approx(runs[start, end], rel=1e-9)
        assert told.critical_position.item() == pytest.approx(0.5 * (start + end) * spacing)
        assert told.critical_patch_length.item() == pytest.approx((end - start) * spacing)
        # Slip on the run takes stress off the interface.
        static = problem.sample(profiles).mean_stress(found.critical_load.values)
        assert told.critical_stress < static[number]
