"""What must hold for equilibrium on any plane: symmetries, gradients, bounds, certificates."""

import numpy as np
import pytest
from planes import WAVENUMBERS, Lattice, moduli, plane_sample
from setups import LENGTH, RATE, exact_onset, make_problem, smooth_noise

import stiction as st
from stiction.elasticity.operator import make_operator
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.criterion.average import _between_nodes, least_average
from stiction.methods.criterion.windows import ellipse_window
from stiction.methods.equilibrium.sample import Outcome
from stiction.methods.equilibrium.transforms import growing_patch, relaxation
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.plane import plane_onset
from stiction.methods.equilibrium.transforms.relaxation import least_equilibrium

NODES, SHAPE = (48, 40), (40, 32)
LENGTHS = (6.0 * LENGTH, 4.0 * LENGTH)
PLANE = make_problem(NODES, LENGTHS)
ONE = np.ones(SHAPE)
PLANES = {
    name: plane((5.0 * LENGTH, 4.0 * LENGTH), moduli(1e9, 0.33))
    for name, plane in WAVENUMBERS.items()
}


def smooth(seed, correlation=4.0, shape=NODES):
    return smooth_noise(correlation, np.random.default_rng(seed), shape)


def strength_of(seed, correlation=4.0, shape=NODES):
    return 0.66e6 + 1e6 * smooth(seed, correlation, shape)


def rough_strength(seed):
    return strength_of(seed, 5.0, SHAPE)


def solve(strength, problem=PLANE, gap=1e-9):
    return exact_onset(problem, strength, gap=gap, slip=True, sensitivity=True)


def first_of(strength, **options):
    return solve(strength, **options)["first_instability"].values


def bounds_of(strength, wavenumbers="lattice", gap=1e-9):
    found = plane_onset(PLANES[wavenumbers], strength, ONE, RATE * ONE, gap)
    assert found.closed
    return found


@pytest.mark.parametrize(
    ("change", "move"),
    [
        (lambda s: np.roll(s, (7, -3), (0, 1)), lambda x, y: (x + 7, y - 3)),
        (lambda s: np.roll(s[::-1], 1, 0), lambda x, y: (-x, y)),
        (lambda s: np.roll(s[:, ::-1], 1, 1), lambda x, y: (x, -y)),
    ],
)
def test_translations_and_reflections(change, move):
    strength = strength_of(0)
    first, second = solve(strength), solve(change(strength))
    for name in ("first_instability", "critical_load"):
        # The gap asked for.
        assert second[name].item() == pytest.approx(first[name].item(), rel=2e-9)
    for name in (
        "slip_patches", "critical_patch_extent", "critical_patch_area", "arrested_events",
    ):  # fmt: skip
        assert np.array_equal(second[name].values, first[name].values)
    spacings, lengths = np.array(PLANE.interface.spacings), np.array(LENGTHS)
    place = np.array(move(*(first["critical_position"].values[0] / spacings))) * spacings
    off = second["critical_position"].values[0] - place
    off = (off + 0.5 * lengths) % lengths - 0.5 * lengths
    # y goes with the root of the gap.
    assert np.abs(off).max() < 1e-2 * spacings.min()
    for name in ("slip", "sensitivity"):
        one, other = first[name].values[0], second[name].values[0]
        assert np.abs(change(one) - other).max() < 1e-3 * one.max()


LAWS = {
    "straight": {},
    "residual": {"residual_strength": 6.2e5},
    "corner": {"slip": [0.25, 1.0], "strength": [0.6, 0.0]},
    "both": {"slip": [0.25, 1.0], "strength": [0.6, 0.0], "residual_strength": 4.5e5},
}


def crooked(name):
    load = st.Load(profile=1.0 + 0.3 * smooth(6), initial_stress=1e5 * smooth(7))
    options = {"weakening_rate": RATE * (0.9 + 0.1 * smooth(5)), **LAWS[name]}
    law = st.PiecewiseWeakening if "slip" in options else st.LinearWeakening
    return make_problem(NODES, LENGTHS, load=load, friction=law(**options))


@pytest.mark.parametrize("name", LAWS)
def test_sensitivity_is_the_gradient_of_the_mean_stress(name):
    problem, strength = crooked(name), strength_of(3)
    rough = np.random.default_rng(9).standard_normal((3, *NODES))
    directions = 10.0 * np.array([smooth(8, 1.0) - 0.3, *rough])
    found = exact_onset(problem, strength, gap=1e-4, sensitivity=True)  # of wide bounds too
    assert found["certified"].item() == (name == "straight")
    gradient = found["sensitivity"].values[0]
    # Steps of 1e-5 of the strength, since with longer ones other nodes join. Bounds are 1e-10
    # apart, 1e-4 of a step of the onset at most.
    ends = np.concatenate((strength + directions, strength - directions))
    up, down = first_of(ends, problem=problem, gap=1e-10).reshape(2, -1)
    expected, error = (gradient * directions).sum((1, 2)), 1e-4 * np.linalg.norm(gradient)
    np.testing.assert_allclose(0.5 * (up - down), expected, rtol=0, atol=error)
    if name == "straight":
        weight = problem.load.profile
        assert (gradient * weight).sum() == pytest.approx(weight.mean(), rel=1e-12)


def test_a_coarse_grid_only_says_where_the_path_is_begun(monkeypatch):
    problem, strength = crooked("residual"), strength_of(3)
    quick = exact_onset(problem, strength)
    monkeypatch.setattr(program, "FEWEST", 100)
    slow = exact_onset(problem, strength)
    assert quick["arrested_events"].item() == slow["arrested_events"].item()
    for name in ("first_instability", "critical_load"):
        # Both within the gap of 1e-6.
        assert quick[name].item() == pytest.approx(slow[name].item(), rel=2e-6)


def test_no_sensitivity_where_the_turning_point_is_not_found(monkeypatch):
    monkeypatch.setattr(program, "follow_to_turn", lambda *_: None)
    for name in ("straight", "both"):
        problem = crooked(name)
        with pytest.warns(st.AccuracyWarning, match=r"\(0\), so sensitivity is NaN"):
            found = exact_onset(problem, strength_of(3), sensitivity=True)
        assert np.isnan(found["sensitivity"].values).all()
        assert found["critical_patch_area"].item() > 0.0


def test_loads_scale_and_shift_with_the_strength():
    strength = strength_of(3)
    exact, shifted = first_of(np.array([strength, strength + 1e5]))
    assert shifted == pytest.approx(exact + 1e5, rel=2e-9)
    under = solve({"strength": strength, "initial_stress": np.full((1, 1), 1e5)})
    assert under["first_instability"].item() == pytest.approx(exact, rel=2e-9)
    assert under["critical_load"].item() == pytest.approx(exact - 1e5, rel=2e-9)


def rough_case(seed):
    """A strength that changes from node to node, on a grid of few nodes in h_n."""
    rng = np.random.default_rng(seed)
    nu = rng.choice([0.0, 0.2, 0.33, 0.45])
    nucleation = 2.0 * 0.57889 * 1e9 / (1.0 - nu) / RATE
    shape = tuple(int(n) for n in rng.choice([16, 24, 32, 48, 64], 2))
    few = rng.uniform(1.5, 6.0, 2)
    lengths = (shape[0] * nucleation / few[0], shape[1] * nucleation * (1.0 - nu) / few[1])
    strength = rng.uniform(0.66e6, 0.66e6 + rng.choice([1e4, 1e5, 1e6, 1e7]), shape)
    profile = np.ones(shape) if seed % 2 else rng.uniform(0.8, 1.3, shape)
    rate = RATE * (np.ones(shape) if seed % 3 else rng.uniform(0.3, 1.0, shape))
    return Lattice(lengths, moduli(1e9, nu)), strength, profile, rate


def test_bounds_hold_where_they_do_not_meet():
    closed = []
    for seed in range(30):
        lattice, strength, profile, rate = rough_case(seed)
        bounds = plane_onset(lattice, strength, profile, rate, 1e-4)
        spectral = plane_onset(HalfSpaces(*lattice), strength, profile, rate)
        closed.append(spectral.closed)
        assert spectral.lower <= spectral.upper
        # Far fewer nodes than it takes: they agree to the error of such a grid.
        assert spectral.lower < 1.5 * bounds.upper
        assert spectral.upper > 0.6 * bounds.lower
    assert 10 < sum(closed) < 30


def test_bounds_hold_for_the_certificates_returned():
    strength = rough_strength(1)
    for name, plane in PLANES.items():
        found = bounds_of(strength, name)
        symbol = plane.symbol(SHAPE)

        def product(field, symbol=symbol):
            return np.fft.irfft2(symbol * np.fft.rfft2(field), SHAPE) - RATE * field

        assert (found.slip >= 0.0).all()
        assert (found.multiplier >= 0.0).all()
        round_off = 1e-12 * strength.max()
        assert (product(found.slip) + strength - found.lower).min() > -round_off
        assert product(found.multiplier).max() < 1e-12 * RATE * found.multiplier.max()
        assert found.multiplier.sum() == pytest.approx(1.0, abs=1e-12)
        assert (found.multiplier * strength).sum() == pytest.approx(found.upper, rel=1e-12)


def test_monotone_and_concave_in_the_strength():
    first, second = rough_strength(2), rough_strength(3)
    one, other = bounds_of(first).upper, bounds_of(second).upper
    middle = bounds_of(0.5 * (first + second)).lower
    assert middle >= 0.5 * (one + other) * (1.0 - 1e-9)
    stronger = first.copy()
    stronger[10:20, 5:15] *= 1.05
    assert bounds_of(stronger).upper >= one * (1.0 - 1e-9)
    assert bounds_of(first + 1e5).upper == pytest.approx(one + 1e5, rel=2e-9)


def test_the_place_of_the_least_average_lies_between_nodes():
    """Of a paraboloid it is that of the vertex, also across the borders."""
    for x, y in ((11.7, 0.4), (0.2, 8.6), (3.4, 5.0)):
        along, across = (
            (np.arange(n) - at + 0.5 * n) % n - 0.5 * n for n, at in ((12, x), (9, y))
        )
        average = 2.0 + 0.3 * along[:, None] ** 2 + 0.7 * across**2
        np.testing.assert_allclose(_between_nodes(average), (x, y), rtol=1e-12)


def test_local_criterion_is_an_upper_bound_for_every_aspect():
    plane = PLANES["lattice"]
    symbol = plane.symbol(SHAPE)
    aspects = (1.0, 1.25, 1.5)
    windows = [ellipse_window(symbol, SHAPE, plane.lengths, RATE, a) for a in aspects]
    interface = st.Interface(plane.lengths, SHAPE)
    for seed in range(4):
        strength = rough_strength(seed)
        exact = bounds_of(strength, gap=1e-6)
        local = least_average(interface, windows, strength[None], ONE)[0][0]
        assert exact.lower <= local < 1.2 * exact.upper
        uneven = 1.0 + 0.2 * rough_strength(seed + 10) / 1e6
        found = plane_onset(plane, strength, uneven, RATE * ONE, 1e-6)
        assert least_average(interface, windows, strength[None], uneven)[0][0] >= found.lower


def test_path_is_the_slip_at_onset_just_below_it():
    strength = rough_strength(5)
    sample = plane_sample(strength, 0.0, RATE)
    operator = make_operator(PLANES["lattice"].symbol(SHAPE), RATE, SHAPE)
    found = bounds_of(strength)
    slips, status = [np.zeros(strength.size)], []
    for load in found.lower * np.array([0.9, 0.95, 1.0 - 1e-6, 1.01]):
        there = least_equilibrium(operator, sample, load, slips[-1])
        slips.append(there.slip)
        status.append(there.status)
    assert status == [*3 * [Outcome.ARRESTED], Outcome.SLIDING]
    assert (np.diff(slips[:4], axis=0) >= -1e-12 * slips[3].max()).all()
    # slip comes up to that at onset with the square root of the load, 1e-3 of it
    assert np.abs(slips[3].reshape(SHAPE) - found.slip).max() < 0.01 * found.slip.max()


def walled(seed, shape=SHAPE):
    """A weak patch behind a barrier around it, with other weak patches beyond."""
    rng = np.random.default_rng(seed)
    strength = 0.5e6 + 2.5e6 * smooth(rng, 3.0, shape)
    x, y = np.ogrid[: shape[0], : shape[1]]
    far = np.hypot(x - rng.uniform(12, 28), y - rng.uniform(10, 20))
    wall, thick = rng.uniform(6, 9), rng.uniform(1.5, 4.0)
    strength[far < wall] *= 0.6
    strength[(far >= wall) & (far < wall + thick)] *= rng.uniform(1.0, 2.0)
    return plane_sample(strength, 3e5 * rng.uniform(0.5, 1.0), RATE)


@pytest.mark.parametrize(("seed", "times"), [(13, 1), (19, 1), (4, 2), (1, 3), (4, 3)])
def test_a_growing_patch_stops_at_a_barrier_and_meets_others(monkeypatch, seed, times):
    """As with steps that solve for the least equilibrium of bounds; not if nothing is checked.

    On large planes some steps are made in windows, which the patch comes to fill.
    """
    shape = (times * SHAPE[0], times * SHAPE[1])
    sample = walled(seed, shape)
    lattice = PLANES["lattice"]
    lengths = tuple(times * length for length in lattice.lengths)
    operator = make_operator(lattice._replace(lengths=lengths).symbol(shape), RATE, shape)
    loads = sample.excess.min() * np.linspace(1.1, 3.0, 12)

    def course():
        slips = [np.zeros(sample.excess.size)]
        for load in loads:
            found = least_equilibrium(operator, sample, load, slips[-1])
            if found.status != Outcome.ARRESTED:
                break
            slips.append(found.slip)
        return np.array(slips)

    def apart(first, second):
        return np.abs(first - second).max() / sample.critical.max()

    around, windows = growing_patch.window_around, []

    def counted(*given):
        windows.append(around(*given))
        return windows[-1]

    monkeypatch.setattr(growing_patch, "window_around", counted)
    ours = course()
    assert 5 < len(ours) < len(loads)
    sizes = {window.operator.rate.size for window in windows}
    assert (min(sizes) < sample.excess.size) == (times > 1)
    assert max(sizes) == sample.excess.size
    with monkeypatch.context() as patch:
        patch.setattr(relaxation, "ENDS", np.inf)  # no patch is followed as it grows
        exact = course()
    assert len(exact) == len(ours)
    # Residuals of 1e-7 of the strength, over the lowest eigenvalue.
    assert apart(ours, exact) < 1e-5
    monkeypatch.setattr(growing_patch, "longest_step", lambda *_: 1.5)
    passed = course()
    assert len(passed) < len(ours) or apart(passed[: len(ours)], ours) > 1e-2


def test_tiny_and_negative_loads_close_as_well():
    strength = rough_strength(6)
    exact = bounds_of(strength).upper
    for shift in (exact, 1.2 * exact):
        found = bounds_of(strength - shift, gap=1e-7)
        assert found.upper == pytest.approx(exact - shift, abs=1e-6 * exact)


@pytest.mark.filterwarnings("ignore::stiction.UnitWarning")  # of a mean strength beyond G
def test_barriers_that_never_slip_do_not_count():
    """However strong they are: the accuracy is a share of the load, not of their strength."""
    law = st.LinearWeakening(weakening_rate=RATE, residual_ratio=0.5)
    problem = make_problem(SHAPE, (5.0 * LENGTH, 4.0 * LENGTH), friction=law)
    strength, first = rough_strength(6), []
    for barrier in (1e8, 1e13):
        strength[:, 20:] = barrier
        first.append(exact_onset(problem, strength, events=2)["first_instability"].item())
    assert first[1] == pytest.approx(first[0], rel=2e-6)
