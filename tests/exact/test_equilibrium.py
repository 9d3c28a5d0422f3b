"""Equilibrium: closed forms, and the conditions of optimality checked with independent products."""

from types import SimpleNamespace

import numpy as np
import pytest
from oracles import dense, symbol_of, times
from recording import stored
from scipy.linalg import eigh
from setups import exact_onset, make_problem
from specimens import crooked, rough

import stiction as st
from stiction.elasticity.line import WIDTH_RATIO, line_of, stiffness_column
from stiction.elasticity.protocol import DenseEntries, HalfSpaces, Windows
from stiction.elasticity.weakest import window_bound
from stiction.methods.equilibrium.dense import cholesky
from stiction.methods.equilibrium.dense.cholesky import make_workspace
from stiction.methods.equilibrium.dense.linear_program import certificate
from stiction.methods.equilibrium.dense.runaway import Runs, unstoppable_length
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.patches import count_patches, line_patch, main_patch
from stiction.methods.equilibrium.solver import sample_of
from stiction.methods.equilibrium.strength import make_sample, pieces_of

COLUMN = stiffness_column(256, 0.1, 1e9)


BODIES = {
    "line": make_problem(), "plane": make_problem((64, 128), (0.02, 0.03)),
    "blocks": crooked(mode="III", load=st.Load()),
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_uniform_strength_holds_until_every_node_is_at_it(name):
    onset = exact_onset(BODIES[name], np.full(BODIES[name].interface.shape, 0.9e6))
    assert onset.critical_load.item() == pytest.approx(0.9e6, rel=1e-14)
    assert onset.arrested_events.item() == 0
    assert not onset.residual_reached.item()
    patch = onset.critical_patch_area if name == "plane" else onset.slip_patches
    assert patch.item() == pytest.approx(0.02 * 0.03 if name == "plane" else 0)


def test_conditions_of_optimality(problem, make_strength):
    tau_p = make_strength(0.25).sample(problem.interface, samples=20, seed=3)
    onset = exact_onset(problem, tau_p, sensitivity=True, slip=True)
    weakening_rate, symbol = problem.friction.weakening_rate, symbol_of(problem)
    for sample in range(20):
        one = onset.isel(sample=sample)
        load, slip, y = one.first_instability.item(), one.slip.values, one.sensitivity.values
        balance = tau_p[sample] - load + times(symbol, slip) - weakening_rate * slip
        assert slip.min() >= 0.0
        assert y.min() >= 0.0
        # 1e-11 of the strength: round-off of K d, K d being ten times the strength.
        assert balance.min() > -1e-11 * load
        assert np.abs(balance[slip > 0.0]).max() < 1e-11 * load
        assert (times(symbol, y) - weakening_rate * y).max() < 1e-11 * weakening_rate * y.max()
        assert y.sum() == pytest.approx(1.0, rel=1e-13)
        assert y @ tau_p[sample] == pytest.approx(load, rel=1e-11)
        assert one.certificate_gap.item() < 1e-9 * load


@pytest.mark.parametrize(
    ("body", "wavy", "close"),
    [("line", 0.6, 0.3), ("blocks", 0.0, 0.01), ("blocks", 0.4, 0.07)],
)
def test_the_multiplier_of_the_weakest_window_proves_its_bound(body, wavy, close):
    """Rates that vary have the windows of the lowest one, which are less close."""
    x = np.linspace(0.0, 1.0, 96)
    rate = 0.19e12 * (1.0 + wavy * np.sin(7.0 * x))
    if body == "line":
        problem = make_problem(96, 0.083, weakening_rate=rate)
        stiffness = dense(symbol_of(problem), (96,))
    else:
        problem = crooked(weakening_rate=rate, residual=0.0)
        stiffness = problem.blocks.stiffness
    strength, above = rough(crooked(), 11, 8), []
    exact = exact_onset(problem, strength).first_instability.values
    search, rows = DenseSearch(problem), problem.sample(strength)
    for i, stress in enumerate(exact):
        sample = sample_of(rows, search.pieces, i)
        bound, multiplier = search.bound(sample)
        assert multiplier.min() >= 0.0
        assert multiplier @ sample.profile == pytest.approx(1.0)
        assert multiplier @ sample.excess == pytest.approx(bound)
        pushed = stiffness @ multiplier - sample.weakening_rate * multiplier
        # The eigenvalue of the window may equal the rate: round-off of its eigenvector.
        assert pushed.max() < 1e-12 * np.abs(pushed).max()
        above.append(bound / (stress - np.mean(problem.load.initial_stress)) - 1.0)
    assert min(above) > -1e-12
    assert np.median(above) < close


def test_kernels_are_compiled_for_one_kind_of_array():
    """The rates of a law are read-only: they made every kernel be compiled a second time."""
    problem = make_problem(weakening_rate=np.full(256, 0.5e12))
    rows = problem.sample(np.full(256, 1e6))
    assert not rows.weakening_rate.flags.writeable
    assert all(
        field.flags.writeable for field in sample_of(rows, pieces_of(problem.friction), 0)[:-1]
    )


def test_certificate_is_the_distance_of_both_bounds(problem, make_strength):
    """From slip and multiplier that are allowed but not optimal."""
    search = DenseSearch(problem)
    excess = make_strength(0.5).sample(problem.interface, samples=1, seed=4)[0]
    sample = sample_of(problem.sample(excess), search.pieces, 0)
    load, multiplier = search.bound(sample)
    # Without slip nothing below the weakest node is overstressed; above is the local bound.
    workspace = make_workspace(search.elastic.entries, search.nodes)
    slip, Kd, Ky = np.zeros((3, 256))
    gap = certificate(sample, slip, Kd, multiplier, workspace, Ky)
    assert gap == pytest.approx(load - excess.min(), rel=1e-9)


def test_a_factor_is_that_of_its_matrix_however_it_was_reached():
    """After nodes joined, left, or weakened less or more; singular or not."""
    rng, n, failures = np.random.default_rng(1), 30, 0
    K = 0.02 * rng.uniform(-1.0, 0.0, (n, n)) + np.diag(rng.uniform(1.0, 2.0, n))
    K = 0.5 * (K + K.T)
    workspace = make_workspace(DenseEntries(K.flatten(), n, 0.0), n)
    slips, W = rng.random(n) < 0.5, np.zeros(n)
    for _ in range(200):
        slips ^= rng.random(n) < 0.02
        W = np.where(rng.random(n) < 0.1, rng.choice([0.0, 0.3, 0.6, 1.1], n), W)
        workspace.is_slipping[:], workspace.diagonal[:n] = slips, np.diag(K) - W
        rows, x = cholesky.factor_slipping(workspace), rng.normal(size=n)
        S, b = workspace.slipping[:rows], x[:rows].copy()
        cholesky.forward_substitute(workspace.factor, 0, rows, x)
        cholesky.back_substitute(workspace.factor, rows, x)
        product = (K - np.diag(W))[np.ix_(S, S)] @ x[:rows]
        np.testing.assert_allclose(product, b, atol=1e-13 * (1.0 + np.abs(x).max()))
        np.testing.assert_array_equal(workspace.is_slipping, slips)
        failures += rows < slips.sum()
    assert 20 < failures < 180


@pytest.mark.parametrize(
    ("field", "count", "start", "length", "centre"), stored("cases")["patches on a circle"]
)
def test_patches_on_the_circle(field, count, start, length, centre):
    assert count_patches(np.array(field)) == count
    assert count_patches(np.zeros(8)) == 0
    first, nodes, middle = main_patch(np.array(field))
    assert (first, nodes) == (start, length)
    assert middle == pytest.approx(centre)
    ring = SimpleNamespace(spacing=0.5, first=0.0, is_free=False)
    expected = 0.5 * np.array([centre, length, length, (start - 0.5) % len(field)])
    np.testing.assert_allclose(np.hstack(line_patch(np.array(field), ring)), expected)


def test_a_length_that_nothing_stops_has_the_least_drop_and_the_largest_energy():
    """Of a law with more than the half under it: 0.9 at 0.6 of d_c, an area of 0.75."""
    law = st.PiecewiseWeakening(slip=[0.6, 1.0], strength=[0.9, 0.0], weakening_rate=1e10)
    rng = np.random.default_rng(0)
    peak, residual, profile, weakening_rate = rng.uniform(1.0, 2.0, (4, 9)) * [
        [2e6], [1e5], [1.0], [1e10],
    ]  # fmt: skip
    sample = make_sample(peak, residual, profile, weakening_rate, pieces_of(law))
    runs = Runs(COLUMN, COLUMN, 9, 2e-3, 1.5e9)
    # Half-length a: pi a D^2/(2 G*) is the energy; d_c is 0.1/0.6 of (tau_p - tau_r)/W.
    energy = (0.75 * (peak - residual) ** 2 / (6.0 * weakening_rate)).max()
    half = 2.0 * 1.5e9 * energy / (np.pi * (3e6 * profile - residual).min() ** 2)
    assert unstoppable_length(sample, 3e6, runs) == pytest.approx(half / 1e-3, rel=1e-12)


def test_no_sensitivity_beyond_a_corner_where_a_law_steepens():
    """A law that falls more steeply beyond half of its slip, and smooth strengths."""
    law = {"slip": [0.5, 1.0], "strength": [0.7, 0.0], "weakening_rate": 8.6e10}
    problem = make_problem(96, friction=st.PiecewiseWeakening(**law))
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.25), st.PowerLawSpectrum(0.015))
    tau_p = field.sample(problem.interface, samples=8, seed=0)
    with pytest.warns(st.AccuracyWarning, match="sensitivity is NaN in . of 8 samples"):
        found = exact_onset(problem, tau_p, sensitivity=True)
    proved = np.isfinite(found.certificate_gap.values)
    assert (~proved).sum() >= 3
    assert np.isnan(found.sensitivity.values[~proved]).all()
    assert np.isfinite(found.sensitivity.values[proved]).all()


@pytest.mark.parametrize("places", ["anywhere", "fixed"])
@pytest.mark.parametrize("level", [0.0, 0.4])
def test_the_weakest_window_is_the_lowest_of_all_windows_and_places(places, level):
    """By trying all, of rates and a load that vary (or not) in runs across the seam."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        n, widths = (100, [2, 34, 70]) if seed % 3 == 0 else (12, [2, 3, 7])
        W = np.repeat([3.0, 2.0, 1.4], [n // 4, n // 3, n - n // 4 - n // 3])
        W = np.roll(W if level else np.full(n, 2.0), rng.integers(n))
        W = np.append(W, 0.0)[:n]  # 0 beyond its end
        profile = 1.0 + level * np.sin(W + 1.0)
        rates, modes = np.array([2.5, 2.0, 1.0]), np.zeros((3, widths[-1]))
        for mode, width in zip(modes, widths, strict=True):  # with little weight at its ends
            mode[:width] = np.sin(np.pi * (np.arange(width) + 0.5) / width)
        starts = rng.integers(0, n - np.array(widths)) if places == "fixed" else np.full(3, -1)
        excess = 2.0 - np.cos(2.0 * np.pi * (np.arange(n) - rng.normal(0.0, 0.1 * n)) / n)
        windows = Windows(rates, starts, np.array(widths), modes)
        best = excess.sum() / profile.sum()
        for c in range(1 if level == 0.0 else 0, 2 if (rates[1] <= W).all() else 3):
            for start in range(n) if places == "anywhere" else starts[c : c + 1]:
                nodes = (start + np.arange(widths[c])) % n
                if (W[nodes] >= rates[c]).all():
                    y = modes[c, : widths[c]]
                    best = min(best, excess[nodes] @ y / (profile[nodes] @ y))
        y = np.empty(n)
        bound = window_bound(excess, profile, W, windows, np.empty(n), y)
        assert bound == pytest.approx(best, rel=1e-12)
        assert (y @ profile, y @ excess) == pytest.approx((1.0, bound), rel=1e-12)


@pytest.mark.parametrize(
    ("nodes", "low", "high"),
    [(256, 1.3e11, 1.3e11), (256, 0.9e11, 7e11), (1024, 0.3e11, 0.3e11), (64, 1e9, 1e9)],
)
def test_windows_of_a_line_are_just_unstable(nodes, low, high):
    """From the narrowest at the highest rate to that at the lowest, with their eigenvectors."""
    line = line_of(HalfSpaces((0.1,), (1e9,)), nodes)

    def lowest(width):
        value, vector = eigh(line.block(np.arange(width)), subset_by_index=[0, 0])
        return value[0], np.abs(vector[:, 0]) / np.abs(vector).sum()

    windows = line.windows(low, high)
    assert windows.widths.size == (0 if nodes == 64 else 1 if low == high else 12)
    for rate, width, mode in zip(*windows[:1], *windows[2:], strict=False):
        assert rate == pytest.approx(lowest(width)[0], rel=1e-9)
        np.testing.assert_allclose(mode[:width], lowest(width)[1], atol=1e-9)
        assert not mode[width:].any()
    ends = windows.widths[:1], windows.widths[-1:]
    for width, rate in zip(np.concatenate(ends), (high, low), strict=False):
        narrower = width - 1 if low == high else int(width / WIDTH_RATIO)
        assert lowest(width)[0] <= rate < lowest(narrower)[0]
