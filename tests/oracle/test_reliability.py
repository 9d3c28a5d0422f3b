"""Failure probabilities by different algorithms of the same limit states, and laws of estimates.

Sample i depends on (seed, i) and on nothing else: not on workers, batches or compilation.
"""

import itertools
import math
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from crooked import LINE, uneven
from recording import stored
from setups import EXACT, LOCAL, SOLID, beta_strength, ensemble, make_problem, without

import stiction as st
from stiction.base.errors import collect_warnings
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState
from stiction.reliability.subset import descend, generator

PROBLEM = st.paper.problem(nodes=256)
SYSTEM = PROBLEM, st.paper.strength(PROBLEM, 0.5)


RARE = 0.6617e6
Known = namedtuple("Known", "probability cv")
SHIFTED = {LOCAL: Known(1.154e-6, 0.029), EXACT: Known(9.82e-7, 0.047)}
"""At 0.6617 MPa, by importance sampling around the most likely weak spot, put at a random place.

The sampler was tests/importance.py up to commit e0d582ff, with seed 0.
"""


def by(system, stress, algorithm, cv, method=LOCAL):
    if (algorithm, stress) == ("importance", RARE):
        return SHIFTED[method]
    options = {"method": method, "algorithm": algorithm, "target_cv": cv}
    return st.failure_probability(*system, stress, **options)


ALGORITHMS = stored("cases")["algorithms"]
MANY = [pytest.param(*row, marks=pytest.mark.slow) for row in ALGORITHMS["slow"]]


@pytest.mark.parametrize(
    ("ratio", "stress", "exact", "one", "other"), ALGORITHMS["quick"] + MANY
)
def test_algorithms_agree(ratio, stress, exact, one, other):
    """Within four joint standard errors of logarithms, at P of about 1e-2, 1e-4 (slow) and 1e-6.

    By equilibrium also at xi_0/h_n = 0.25, where interaction lowers the typical onset most.
    """
    system, method = (PROBLEM, st.paper.strength(PROBLEM, ratio)), EXACT if exact else LOCAL
    first, second = (by(system, stress, *how, method) for how in (one, other))
    apart = math.log(first.probability / second.probability)
    assert abs(apart) < 4.0 * math.hypot(first.cv, second.cv)
    # The exact limit state is asked for a few hundred samples a run, not a few thousand a level.
    if one[0] == "two_level" and other[0] == "importance":
        assert first.evaluations < 0.2 * first.first_stage_evaluations


def test_design_stress_has_the_probability_asked_for():
    """The interval of nine in ten, twice as wide, holds the stress that has it."""
    known = SHIFTED[EXACT].probability
    answer = st.design_stress(*SYSTEM, probability=known, method=EXACT, target_cv=0.2)
    low, high = answer.interval["stress"]
    assert 0.66e6 < low < answer.stress < high
    assert 2.0 * low - answer.stress < RARE < 2.0 * high - answer.stress


def test_two_very_different_interfaces_against_counting_and_each_alone():
    """On a crooked line: short and weak, or long and strong with a random residual strength."""
    problem = without(LINE, "friction.residual_strength")
    residual = st.Lognormal(mean=0.2e6, cv=0.1)
    pair = [
        st.RandomInterface(
            strength=beta_strength(length, low, 1.9e6),
            residual_strength=st.RandomField(residual, st.ExponentialSpectrum(5e-3)),
            between={"strength": st.Lognormal(mean=1.0, cv=cv)},
        )
        for length, low, cv in ((2.3e-3, 0.66e6, 0.03), (17e-3, 0.73e6, 0.11))
    ]
    onsets = [ensemble(problem, one, 4000, seed=4).critical_stress.values for one in pair]
    together = ensemble(problem, pair, 4000, seed=9).critical_stress.values
    for share in (0.2, 0.02):
        stress = float(np.quantile(np.concatenate(onsets), share))
        each = np.array([(own < stress).mean() for own in onsets])
        # Counting the list, and the tail of the list, within four standard errors.
        error = 4.0 * (share / 4000) ** 0.5
        assert (together < stress).mean() == pytest.approx(share, abs=error)
    found = by((problem, pair), stress, "subset", 0.1)
    error = math.hypot(found.cv, (share * 8000) ** -0.5)
    assert found.probability == pytest.approx(share, rel=4.0 * error)
    assert each.min() < 0.5 * each.max()
    assert found.members == pytest.approx(each, rel=0.3, abs=0.05 * each.max())
    assert found.probability == pytest.approx(found.members.mean(), rel=1e-9)
    design = st.design_stress(problem, pair, probability=0.001, method=LOCAL, target_cv=0.1)
    alone = [by((problem, one), design.stress, "subset", 0.15).probability for one in pair]
    assert np.mean(alone) == pytest.approx(0.001, rel=4.0 * math.hypot(0.1, 0.15))
    # In the other order they are the same two.
    back = by((problem, pair[::-1]), stress, "plain", 0.1)
    assert back.members[::-1] == pytest.approx(each, rel=0.3, abs=0.05 * each.max())


def test_subset_simulation_visits_disjoint_failure_regions():
    """Twelve half-spaces at right angles: each holds a twelfth of the failures."""
    counts = np.zeros(12)

    def lowest(draws):
        return draws[:, :12].min(axis=1)

    for seed in range(20):
        run = descend(lowest, 100, rng=generator(seed, 9), samples=1000, threshold=-4.0)
        last = run.populations[-1]
        regions = last.draws[last.values < -4.0, :12].argmin(axis=1)
        counts += np.bincount(regions, minlength=12)
        # Every single run has failures in most of the regions, not in one.
        assert np.unique(regions).size >= 5
    # Each run holds about ten independent families: 200 in all, a standard error of 0.02.
    assert np.abs(counts / counts.sum() - 1.0 / 12).max() < 0.07


def test_a_curve_is_monotone_and_that_of_counting():
    options = {"method": LOCAL, "target_cv": 0.3}
    curve = st.failure_curve(*SYSTEM, smallest=1e-5, **options)
    stress, chance = curve["stress"].values, curve["probability"].values
    for name, values in (("stress", stress), ("probability", chance)):
        assert np.all(np.diff(values) < 0.0)
        assert np.all(curve[f"{name}_low"] <= values)
        assert np.all(curve[f"{name}_high"] >= values)
    assert chance[-1] == pytest.approx(1e-5, rel=0.05)
    np.testing.assert_allclose(curve["stress_above_bound"], stress - 0.66e6)
    # Where plain sampling reaches, they agree: four joint standard errors.
    onsets = ensemble(*SYSTEM, 4000).critical_stress.values
    counts = np.sum(onsets < stress[:, None], axis=1)
    seen = counts > 2
    assert seen.sum() >= 4
    error = np.hypot(curve["cv"].values[seen], 1.0 / np.sqrt(counts[seen]))
    assert np.all(np.abs(np.log(chance[seen] / counts[seen] * 4000.0)) < 4.0 * error)


DRIVES = {
    "line": None, "dead load": st.Platen(), "rigid": st.Platen(stiffness=math.inf),
    "machine": st.Pusher(height=0.009, width=0.011, side="both", stiffness=2e8),
}  # fmt: skip


def random_of(rng, initial, pressed, between):
    """Strength with a lower end, perhaps as coefficients under a random pressure, and more."""

    def field(low, high, **options):
        marginal = st.Beta(alpha=0.6, beta=rng.uniform(0.7, 6.0), low=low, high=high)
        return st.RandomField(marginal, st.SquaredExponentialSpectrum(4e-3), True, **options)

    low = rng.uniform(4e5, 9e5) / (2.1e6 if pressed else 1.0)
    high, of_what = low + 8e5, {}
    found = {"normal_pressure": field(1.6e6, 3.1e6)} if pressed else {}
    if pressed:
        high, of_what = low + 0.38, {"quantity": "friction_coefficient"}
    if initial:
        found["initial_stress"] = field(-initial, 0.7 * initial)
    spread = {"strength": st.Beta(alpha=2.0, beta=2.0, low=0.8, high=1.2)} if between else None
    return st.RandomInterface(strength=field(low, high, **of_what), between=spread, **found)


@pytest.mark.parametrize("between", [False, True])
@pytest.mark.parametrize(
    ("system", "method"), [(s, m) for s in DRIVES for m in (EXACT, LOCAL)][:-1]
)
def test_no_sample_lies_beyond_the_bounds(system, method, between):
    """Whatever is driven, random and asked for; what need not happen has no upper bound."""
    drive, rng = DRIVES[system], np.random.default_rng(between)
    specimen = drive and st.Blocks(height=0.019, thickness=0.006, drive=drive)
    # A little steeper than a strip unloads: much of the specimen slips before the instability.
    rate = 3.4e10 if drive else 0.3e12
    law = st.LinearWeakening(weakening_rate=rate, residual_strength=1e5)
    interface, mode = st.Interface(0.036, 72), "III" if system == "rigid" else "II"
    for initial, pressed in itertools.product((0.0, 1e5, 3e5), (False, True)):
        load = st.Load(
            profile=1.0 if drive else 1.2 + 0.4 * uneven(interface, seed=1),
            initial_stress=0.0 if initial else -4e4 + 9e4 * uneven(interface, seed=2),
            normal_pressure=None if pressed else 2.3e6,
        )
        with collect_warnings():
            problem = st.Problem(SOLID, interface, law, load, mode=mode, specimen=specimen)
            random = random_of(rng, initial, pressed, between)
            state = LimitState(Experiment(problem, random, method), per_pressure=pressed)
            draws = state.draws(2, 0, 16)
            draws[:8] *= 2.5  # near the ends of the marginals
            found, (least, most) = state._stress(draws), state.bounds
        error = 1e-9 * np.abs(found)
        assert not (found < least - error).any()
        assert most == np.inf or (found <= most + error).all()
        assert np.isfinite(least) != (system == "rigid" and method is LOCAL)
        assert np.isfinite(most) == (method is EXACT or drive is None)


def test_a_batch_of_rough_planes_stays_small():
    problem = make_problem((48, 48), length=(0.02, 0.02))
    rough = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    experiment = Experiment(problem, rough, LOCAL)
    assert experiment.dimension > 100 * problem.interface.size
    assert experiment.batch * experiment.dimension <= 2**20


SOURCES = Path(__file__).parents[2] / "src"


def test_no_kernel_may_be_reassociated():
    """Fast-math makes the order of a sum depend on what was inlined where."""
    for path in SOURCES.rglob("*.py"):
        assert "fastmath=" not in path.read_text(encoding="utf-8")
        assert '"fastmath"' not in path.read_text(encoding="utf-8")
