"""Slow rupture against the exact equilibrium onset: of lines by HiGHS, of planes by equilibrium."""

import numpy as np
import pytest
from oracles import largest_load
from ruptures import run_of
from setups import LENGTH, beta_strength, exact_onset, make_problem, turns

import stiction as st

PROBLEM = st.paper.problem(nodes=256)


def fields(ratio, samples):
    """Random strengths between 0.66 and 1.66 MPa, correlated over ratio h_n, from plain numpy."""
    rng = np.random.default_rng(int(100 * ratio))
    k = PROBLEM.interface.wavenumbers
    spread = np.exp(-0.5 * (k * ratio * PROBLEM.nucleation_length / 4.0) ** 2)
    noise = np.fft.irfft(np.fft.rfft(rng.standard_normal((samples, 256))) * spread, 256)
    return 0.66e6 + 1e6 / (1.0 + np.exp(-1.4 * (noise / noise.std() - 0.7)))


def rupture(problem, strength, rate=1e5, **options):
    method = st.Rupture(loading_rate=rate, **options)
    return method.prepare(problem)(problem.sample(strength))


# 0.1 % is asked for; at 1e5 Pa/s inertia still lifts the onset by some 1e-6.
CLOSE = 5e-6


def test_effect_of_the_loading_rate_is_smooth_and_vanishes():
    strength = fields(0.5, 1)
    exact = largest_load(PROBLEM, strength[0])[0]
    rates = (1e3, 1e5, 1e6, 1e7, 1e8)
    onsets = [rupture(PROBLEM, strength, rate)["first_instability"][0] for rate in rates]
    excess = np.array(onsets) / exact - 1.0
    assert abs(excess[0]) < 1e-7
    assert np.all(np.diff(excess) > 0.0)
    # Between R^(2/3), the late passage of a fold, and a little above R; waves of the creeping
    # patches scatter it (explicit steps alone show the same scatter).
    factors = excess[2:] / excess[1:-1]
    assert np.all((factors > 2.5) & (factors < 30.0))
    assert excess[3] < 2e-4


def test_a_run_from_an_equilibrium_finds_the_same_onset():
    strength = fields(0.5, 1)[0]
    exact, slip, _ = largest_load(PROBLEM, strength)
    method = st.Rupture(loading_rate=1e5, stop="onset")
    # The slip of the onset, scaled back, is in equilibrium at no load; so take the load of the
    # onset less a little, where that slip holds still.
    run = run_of(PROBLEM, strength, method)
    state = run.start(exact * (1.0 - 1e-6) / 1e5, slip * (1.0 - 1e-9))
    assert run.follow(state, method.max_steps)[0] == "onset"
    assert float(state.now["onset_stress"]) == pytest.approx(exact, rel=CLOSE)
    assert int(state.now["implicit_steps"]) > 0


@pytest.mark.parametrize(("mode", "ratio"), [("II", 0.0), ("II", 0.45), ("III", 0.25)])
def test_everything_may_vary_along_the_interface(mode, ratio):
    """tau_p, tau_r, W, load profile and initial stress, on a grid that is no power of two."""
    rng, angle = np.random.default_rng(200), turns(200)
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=ratio, density=1170.0)

    def varied(mean, spread, waves):
        terms = [rng.standard_normal() * np.cos(j * angle + j * j) for j in range(1, waves)]
        return mean + spread * np.tanh(sum(terms) / np.sqrt(waves / 2))

    rate, profile = varied(2.5e11, 5e10, 6), varied(1.0, 0.2, 5)
    initial, strength = varied(0.0, 1e5, 8), varied(1.2e6, 4e5, 20)
    problem = make_problem(
        200, solid=solid, mode=mode, weakening_rate=rate,
        residual_strength=varied(2e5, 5e4, 5),
        load=st.Load(profile=profile, initial_stress=initial),
    )  # fmt: skip
    found = rupture(problem, strength)["first_instability"][0]
    load = (found - initial.mean()) / profile.mean()
    assert load == pytest.approx(largest_load(problem, strength)[0], rel=CLOSE)


def test_an_arrested_event_is_the_one_that_equilibrium_finds():
    """A rare field of the paper's interface whose first instability stops before it has run far."""
    problem = st.paper.problem(nodes=1024)
    field = st.paper.strength(problem, correlation_ratio=0.5)
    tau_p = field.sample(problem.interface, samples=1, seed=0, first=18)
    exact, found = exact_onset(problem, tau_p), rupture(problem, tau_p)
    assert found["arrested_events"] == exact["arrested_events"].values == 1
    first, last = (exact[name].values for name in ("first_instability", "critical_stress"))
    assert found["first_instability"] == pytest.approx(first, rel=CLOSE)
    # The arrested rupture overshoots its least equilibrium: 3e-5 lower seen for the second onset.
    assert found["critical_stress"] == pytest.approx(last, rel=2e-4)
    assert found["first_instability"][0] < 0.96 * found["critical_stress"][0]


@pytest.mark.parametrize("rate", [5e7, 5e6])
def test_arrested_events_are_those_of_equilibrium_whatever_the_rate(rate):
    """Waves that circle after an event make the mean stress fall dozens of times: no events."""
    solid = st.Solid(shear_modulus=2e9, poisson_ratio=0.2, density=1500.0)
    length, modulus = 0.08, solid.effective_modulus()
    law = {"weakening_rate": 2.0 * 0.5788869 * modulus / (0.16 * length), "residual_ratio": 0.6}
    problem = make_problem(solid=solid, length=length, **law)
    spectrum = st.SquaredExponentialSpectrum(correlation_length=0.01)
    field = st.RandomField(st.Lognormal(mean=2.04e6, cv=0.2), spectrum, mean_mode=True)
    tau_p = field.sample(problem.interface, samples=6, seed=5)[[0, 3]]
    # Equilibrium counts jumps of any size; these slip as much as dynamics can tell from creep.
    unit = 0.4 * tau_p.mean() * length / modulus
    whole = solid.shear_modulus * length
    moments = [st.equilibrium_path(problem, one, [0.0]).event_moment.values for one in tau_p]
    expected = [int(np.sum(moment / whole > 5e-3 * unit)) for moment in moments]
    found = rupture(problem, tau_p, rate)
    assert found["arrested_events"].tolist() == expected == [1, 1]


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize(
    ("nodes", "lengths", "ratio", "samples"),
    [(48, 5, 0.5, 2), (48, 5, 1.0, 2), pytest.param(80, 8, 0.5, 20, marks=pytest.mark.slow)],
)
def test_first_instability_of_a_plane_at_a_slow_rate(nodes, lengths, ratio, samples):
    problem = make_problem((nodes, nodes), (lengths * LENGTH, lengths * LENGTH))
    tau_p = beta_strength(ratio * LENGTH).sample(problem.interface, samples=samples, seed=5)
    exact = exact_onset(problem, tau_p)
    slow = st.onset(problem, tau_p, method=st.Rupture(loading_rate=1e4, stop="onset"))
    # Equilibrium brackets to 1e-6; inertia at 1e4 Pa/s and the sizes of implicit steps leave less.
    found = slow.first_instability.values
    assert found == pytest.approx(exact.first_instability.values, rel=1e-5)
    apart = np.abs(slow.critical_position - exact.critical_position).max(axis=1).values
    # The same patch, perhaps around the period.
    assert np.all((apart < LENGTH) | (apart > (lengths - 1) * LENGTH))
