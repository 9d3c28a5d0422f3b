"""Failure probabilities where budgets do not suffice, onsets pile up, or methods differ."""

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
import scipy.stats
from setups import EXACT, LOCAL, exact_onset, local_onset, make_problem, turns

import stiction as st
from stiction.random.stresses import share_below_residual
from stiction.reliability.counting import count_failures

PROBLEM = st.paper.problem(nodes=256)
FIELD = st.paper.strength(PROBLEM, 0.5)
SYSTEM = PROBLEM, FIELD


def failure(stress=0.67e6, method=LOCAL, system=SYSTEM, **options):
    return st.failure_probability(*system, stress, method=method, **options)


def design(probability, method=LOCAL, system=SYSTEM, **options):
    return st.design_stress(*system, probability=probability, method=method, **options)


def shares(system, stress, samples, seed):
    """Share of plain samples that fail, by the local criterion and by equilibrium."""
    drawn = system[1].sample(system[0].interface, samples=samples, seed=seed)
    onsets = local_onset(system[0], drawn), exact_onset(system[0], drawn)
    return [np.mean(found.critical_stress.values < stress) for found in onsets]


@dataclass(frozen=True)
class Standing:
    """The local criterion under another name, its critical stresses perhaps changed."""

    type = "equilibrium"
    first_stage: str | None = "local_criterion"
    change: Callable = np.asarray
    label = "stand-in"
    variables = staticmethod(LOCAL.variables)

    def supports(self, problem):
        return []

    def seconds_per_sample(self, problem):
        return 1e-3

    def prepare(self, problem):
        def solver(rows):
            values = LOCAL.prepare(problem)(rows)
            return values | {"critical_stress": self.change(values["critical_stress"])}

        return solver


@pytest.mark.parametrize("algorithm", ["auto", "plain", "subset", "two_level"])
@pytest.mark.parametrize("allowed", [100, 400])
def test_the_smallest_budgets_are_kept_to(algorithm, allowed):
    with pytest.warns(st.AccuracyWarning, match="max_evaluations"):
        result = failure(
            0.665e6, EXACT, algorithm=algorithm, target_cv=0.05, max_evaluations=allowed
        )
    assert 0 < result.evaluations <= allowed
    # P is about 7e-5.
    assert result.interval[0] < 7e-5 < result.interval[1]


def test_budget_too_small_for_any_failure():
    with pytest.warns(st.AccuracyWarning, match="come down to"):
        result = failure(0.6605e6, algorithm="subset", max_evaluations=3000)
    # The same repetition, asked for where it ended: its upper limit, and not its estimate.
    reached = float(re.search(r"come down to (\S+) Pa", " ".join(result.warnings)).group(1))
    there = failure(reached, algorithm="subset", max_evaluations=3000, target_cv=1.0)
    assert result.interval == (0.0, pytest.approx(there.interval[1], rel=0.03))
    assert there.evaluations == result.evaluations
    with pytest.warns(st.AccuracyWarning, match="do not reach"):
        answer = design(1e-9, max_evaluations=3000)
    assert answer.interval == (0.66e6, answer.stress)
    assert failure(answer.stress, algorithm="subset", target_cv=0.5).probability > 1e-9
    with pytest.warns(st.AccuracyWarning, match="do not reach"):
        curve = st.failure_curve(*SYSTEM, method=LOCAL, smallest=1e-9, max_evaluations=3000)
    assert 1e-5 < float(curve["probability"].min()) < 1e-2
    with pytest.warns(st.AccuracyWarning):
        nothing = failure(0.6605e6, EXACT, algorithm="two_level", max_evaluations=100)
    # A dozen of its samples show next to nothing, and the interval says so.
    assert nothing.interval[0] < 3e-9 < nothing.interval[1]


def test_a_median_interface_that_fails_at_once():
    """At the origin of the draws the strength is its median, 0.97 MPa, everywhere."""
    result = failure(0.99e6, algorithm="subset")
    assert result.probability == 1.0
    # A thousand of a thousand: by Clopper and Pearson at least 0.025^(1/1000), or 1 - 0.0037.
    assert result.interval == (pytest.approx(0.025**0.001, abs=4e-4), 1.0)
    chosen = failure(0.99e6)
    assert (chosen.algorithm, chosen.probability) == ("plain", 1.0)
    assert not any("evaluations" in text for text in chosen.warnings)


def test_the_pilot_that_chose_to_count_is_not_counted():
    """It holds more failures than it should where it leads to counting."""
    found = failure(0.7e6, target_cv=0.1, seed=4)
    state = st.external.limit_state(*SYSTEM, LOCAL)
    options = {"target_cv": 0.1, "least": 1000, "max_evaluations": 10**5}
    after, before = (count_failures(state, 4, 0.7e6, start=i, **options)[0] for i in (1000, 0))
    assert found.probability == after.probability != before.probability
    # What the printed line calls what.
    low, high = found.interval
    assert f"P = {found.probability:.3g} (95 %: {low:.3g} to {high:.3g}, c.o.v." in str(found)
    spread = dataclasses.replace(found, members=np.linspace(0.0, 0.4, 101)[::-1])
    assert spread.band == pytest.approx((0.02, 0.38))
    assert "5 % have at most P = 0.02 and 95 % have at most P = 0.38" in str(spread)


@pytest.mark.parametrize("first_stage", ["local_criterion", None])
def test_onsets_that_pile_up_on_the_bound(first_stage):
    """As by rounding; over two levels, and by subset simulation."""
    method = Standing(
        first_stage=first_stage, change=lambda x: np.where(x < 0.675e6, 0.66e6, x)
    )
    piled = partial(design, method=method, target_cv=0.3)
    with pytest.warns(st.AccuracyWarning, match="is the bound itself"):
        answer = piled(1e-5)
    assert answer.algorithm == ("two_level" if first_stage else "subset")
    assert (answer.stress, answer.stress_above_bound) == (0.66e6, 0.0)
    # Too few evaluations: what was seen is the bound, below which nothing lies.
    with pytest.warns(st.AccuracyWarning):
        few = piled(1e-12, max_evaluations=100)
    assert few.interval[0] == 0.66e6 <= few.interval[1]


@pytest.mark.parametrize("seed", range(4))
def test_small_runs_whose_states_tie(seed):
    """Of twenty samples two go on, and chains repeat them."""
    problem = st.paper.problem(nodes=136)
    most = 100 + 50 * (seed % 2)
    with pytest.warns(st.AccuracyWarning):
        found = failure(
            0.66001e6, system=(problem, st.paper.strength(problem, 0.5)), algorithm="subset",
            max_evaluations=most, seed=seed // 2,
        )  # fmt: skip
    assert found.interval[0] < 1e-12 < found.interval[1]


@pytest.fixture(scope="module")
def joint():
    """Residual strength is reached within the critical patch, so that onsets come later."""
    problem = make_problem(96, 0.0144, weakening_rate=0.5e12, residual_ratio=0.5)
    spectrum = st.PowerLawSpectrum(0.3 * problem.nucleation_length)
    return problem, st.RandomField(st.Lognormal(mean=1e6, cv=0.25), spectrum, True)


@pytest.fixture(scope="module")
def short(joint):
    """Strength that varies within a tenth of h_n, where the criterion is too high."""
    problem = dataclasses.replace(joint[0], friction=st.LinearWeakening(weakening_rate=0.5e12))
    spectrum = st.PowerLawSpectrum(0.12 * problem.nucleation_length)
    return problem, st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum, True)


def test_the_local_criterion_is_checked_by_equilibrium(joint):
    """Both probabilities are given where they differ; counting tells that they do."""
    with pytest.warns(st.AccuracyWarning, match=r"fail by the local criterion and .* by equil"):
        found = failure(0.66e6, system=joint, algorithm="subset", target_cv=0.2)
    local, exact = shares(joint, 0.66e6, samples=2000, seed=3)
    assert exact < 0.7 * local
    assert 0.4 < found.probability / local < 2.5
    with pytest.warns(st.AccuracyWarning, match="by equilibrium the probability"):
        answer = design(1e-3, system=joint, target_cv=0.3)
    assert any("by equilibrium" in text for text in answer.warnings)


@pytest.mark.parametrize("stress", [0.7505e6, 0.7857e6])
def test_the_check_after_subset_simulation_sees_both_sides(short, stress):
    """P of 0.95e-3 and 0.95e-2: nearly all of the last level fails, and equilibrium fails more.

    By 1.45 and 1.36 times (subset simulation by both, 5 % each). A check of the last level alone
    saw no sample that fails by equilibrium only, and five of six seeds were not warned.
    """
    with pytest.warns(st.AccuracyWarning, match="by equilibrium the probability"):
        found = failure(stress, system=short, algorithm="subset")
    counts = re.search(r"(\d+) fail by the local criterion and (\d+) by", found.warnings[-1])
    local, exact = map(int, counts.groups())
    assert 16 <= local <= 48
    assert exact > local


@pytest.mark.parametrize("rho", [0.9, -0.6, 1.0])
def test_a_residual_strength_that_follows_the_strength_seldom_exceeds_it(rho):
    residual = dataclasses.replace(FIELD, marginal=st.Lognormal(mean=0.7e6, cv=0.15))
    random = st.RandomInterface(
        strength=FIELD, residual_strength=residual,
        correlation={("strength", "residual_strength"): rho},
    )  # fmt: skip
    profiles = random.profiles(PROBLEM.interface, samples=4000, seed=1)
    counted = np.mean(profiles["strength"] <= profiles["residual_strength"])
    # 4,000 samples of some twenty correlation lengths each.
    expected = pytest.approx(counted, rel=0.05, abs=1e-3)
    assert share_below_residual(PROBLEM, random) == expected


@pytest.mark.parametrize("units", [(1.0, 1.0), (2e6, 1.0), (1.0, 2e6), (2e6, 2e6)])
def test_strengths_in_coefficients_are_compared_as_stresses(units):
    """Both overlap in a quarter of each, in Pa (unit 1) or as coefficients (unit 2 MPa)."""
    pressure = 2e6 * (1.0 + 0.3 * np.cos(turns(256)) + 0.1 * np.sin(2.0 * turns(256)))
    pressed = dataclasses.replace(PROBLEM, load=st.Load(normal_pressure=pressure))
    strength, residual = (
        st.RandomField(
            scipy.stats.uniform(low / unit, 4e5 / unit),
            FIELD.spectrum,
            of=None if unit == 1.0 else "friction_coefficient",
        )
        for low, unit in zip((3e5, 0.0), units, strict=True)
    )
    random = st.RandomInterface(strength=strength, residual_strength=residual)
    # A thirty-second where both are the one or the other, whatever the pressure.
    sizes = [np.ones(256) if unit == 1.0 else pressure / 2e6 for unit in units]
    values = 3e5 + 4e5 * (np.arange(400)[:, None] + 0.5) / 400
    share = np.clip(1.0 - values * sizes[0] / (4e5 * sizes[1]), 0.0, 1.0).mean()
    assert share == pytest.approx(1 / 32, rel=1e-3) or len(set(units)) == 2
    # 64 pressures stand for those of all nodes.
    assert share_below_residual(pressed, random) == pytest.approx(share, rel=0.02)
    with pytest.warns(st.AccuracyWarning, match=r"\d % of its marginal"):
        st.monte_carlo(pressed, random, method=LOCAL, samples=1)
