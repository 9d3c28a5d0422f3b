"""Probabilities that are exactly zero or one, intervals, and the error estimates themselves."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binomtest, nbinom
from setups import EXACT, LOCAL, ensemble, local_onset, make_problem, turns
from stand_ins import StandIn

import stiction as st
from stiction.base.progress import SILENT
from stiction.reliability.answer import band_of
from stiction.reliability.counting import Counted, binomial_interval, count_failures
from stiction.reliability.solving import few_members
from stiction.reliability.subset import ancestral_variance, generator
from stiction.reliability.tail import Tail, lognormal_interval

PROBLEM = st.paper.problem(nodes=256)
STRENGTH = st.paper.strength(PROBLEM)


@pytest.mark.parametrize(("stress", "expected"), [(0.66e6, 0.0), (1.66e6, 1.0)])
def test_beyond_the_bounds_nothing_is_sampled(stress, expected):
    result = st.failure_probability(PROBLEM, STRENGTH, stress, method=LOCAL)
    assert result.probability == expected
    assert result.interval["probability"] == (expected, expected)
    assert result.cv == 0.0
    assert result.evaluations == 0
    assert result.algorithm == "exact"
    assert result.stress_above_bound == stress - 0.66e6
    # Three interfaces of a list say as much about others as three samples.
    listed = st.failure_probability(PROBLEM, [STRENGTH] * 3, stress, method=LOCAL)
    interval = binomtest(int(3 * expected), 3).proportion_ci(0.9)
    assert listed.interval["probability"] == pytest.approx([*interval], rel=1e-9)
    assert listed.members.tolist() == [expected] * 3


def test_bounds_follow_load_and_initial_stress():
    """Nothing slips below min (tau_p - tau_i)/p; in mean stress that is <tau_i> + load <p>."""
    wave = np.cos(turns(256))
    load = st.Load(profile=1.5 + 0.3 * wave, initial_stress=1e5 + 2e4 * wave)
    problem = st.Problem(PROBLEM.solid, PROBLEM.interface, PROBLEM.friction, load)
    # At x = 0: (0.66e6 - 0.12e6)/1.8 = 0.3e6, times 1.5, plus the mean initial stress 0.1e6.
    below = st.failure_probability(problem, STRENGTH, 0.5499e6, method=LOCAL)
    assert below.lower_bound == pytest.approx(0.55e6, rel=1e-12)
    assert below.probability == 0.0
    onset = local_onset(problem, STRENGTH.sample(problem.interface, samples=500))
    assert float(onset["critical_stress"].min()) > below.lower_bound


def rigid(marginal, weakening_rate):
    """A strip whose drive is held: slip lowers the mean stress before anything is unstable."""
    block = st.Blocks(height=0.03, thickness=6e-3, drive=st.Platen(stiffness=math.inf))
    problem = make_problem(40, mode="III", weakening_rate=weakening_rate * 1e9 / 0.06)
    problem = dataclasses.replace(problem, specimen=block)
    return problem, st.RandomField(marginal, st.SquaredExponentialSpectrum(0.02), True)


class First(st.Equilibrium):
    """Equilibrium whose interfaces fail at the first instability, which need not happen."""

    def bounded_by_strength(self, problem, event):
        return False, False

    def prepare(self, problem):
        solve = super().prepare(problem)

        def first(sample):
            values = solve(sample)
            return values | {"critical_stress": values["first_instability"]}

        return first


FIRST = {"method": First(), "progress": False}


def test_what_survives_counts_as_survived():
    """A quarter slides stably: counted, by levels, of two members, and as a curve."""
    problem, field = rigid(st.Lognormal(mean=1e6, cv=0.12), 1.05)
    problem = dataclasses.replace(problem, load=st.Load(normal_pressure=2.7e6))
    steep = dataclasses.replace(field, marginal=st.Lognormal(mean=0.97e6, cv=0.1))
    likely = [field, steep]
    plain = ensemble(problem, likely, 600, method=EXACT, seed=5).first_instability.values
    lost = np.isnan(plain).mean()
    assert 0.1 < lost < 0.5
    error = 3.0 * math.sqrt(0.25 / 600)
    options = FIRST | {"target_cv": 0.3, "max_evaluations": 20_000}
    design = st.design_stress(problem, likely, probability=0.1, **options)
    assert design.survived == pytest.approx(lost, abs=error)
    assert "fraction that survives any stress" in str(design)
    below = np.sum(plain < np.array(design.interval["stress"])[:, None], axis=1) / plain.size
    assert below[0] - error < 0.1 < below[1] + error
    for algorithm in ("plain", "subset"):
        found = st.failure_probability(
            problem, likely, design.stress, **options, algorithm=algorithm
        )
        assert found.survived == pytest.approx(lost, abs=error)
        share = np.mean(plain < design.stress)
        assert found.probability == pytest.approx(share, abs=4.0 * found.cv * share + error)
    pressed = st.failure_probability(
        problem, likely, friction_coefficient=9.9, **options, algorithm="plain"
    )
    # Whatever the stress, no more than those that have an instability.
    assert pressed.probability == pytest.approx(1.0 - lost, abs=error)
    never = st.design_stress(problem, likely, probability=0.97, **options)
    assert never.stress == math.inf
    (told,) = (text for text in never.warnings if "No stress has that probability" in text)
    assert f" {1.0 - never.survived:.3g} of all" in told
    assert "No stress has this probability" in str(never)
    curve = st.failure_curve(problem, likely, smallest=0.02, **options)
    assert curve.survived == pytest.approx(lost, abs=error)
    assert np.isfinite(curve.stress).all()


def test_where_most_survive_a_curve_begins_later():
    """Two thirds survive any stress, so there is no median stress, but a quantile at 0.29."""
    weak = STRENGTH.marginal.distribution.ppf(1.0 / 3.0)
    third = StandIn(lambda rows, stress: np.where(rows.strength[:, 0] < weak, stress, np.nan))
    curve = st.failure_curve(PROBLEM, STRENGTH, method=third, smallest=0.1, progress=False)
    assert curve.survived == pytest.approx(2.0 / 3.0, abs=0.04)  # four errors of 2000 samples
    assert np.isfinite(curve.stress).values.tolist() == [False, True, True, True]
    assert np.isnan(curve.to_array().values[:, 0]).all()


def test_a_curve_of_an_event_that_never_happens_is_unknown():
    never = StandIn(lambda rows, stress: np.nan * stress)
    with pytest.warns(st.AccuracyWarning, match="the event happens in none of 2000 samples"):
        curve = st.failure_curve(PROBLEM, STRENGTH, method=never, progress=False)
    assert curve.sizes["point"] == 1
    assert curve.survived == 1.0
    assert np.isnan(curve.probability.values).all()


@pytest.mark.parametrize(("known", "carried"), [(0.2, True), (math.nan, False)])
def test_a_short_list_names_only_interfaces_whose_probability_is_known(known, carried):
    random = SimpleNamespace(kinds=np.arange(5), source=None)
    members = np.array([known, *[math.nan] * 4])
    short = SimpleNamespace(members=members, cv=0.3, members_cv=0.25)
    (text,) = few_members(random, short, 0.1)
    assert ("1 of 5 different ones carry 90%" in text) == carried


def test_an_end_of_a_band_is_known_if_no_unknown_member_counts():
    rng = np.random.default_rng(3)
    for size in range(1, 60):
        members = np.sort(rng.uniform(0.1, 0.9, size))
        members[: rng.integers(size + 1)] = math.nan  # between zero and the least that is known
        members[: rng.integers(size + 1)] = 0.0
        least, most = (np.nan_to_num(members, nan=value) for value in (1e-9, 0.1))
        low, high = (np.quantile(of, [0.05, 0.95]) for of in (least, most))
        known = np.where(low == high, low, math.nan)
        np.testing.assert_allclose(band_of(rng.permutation(members)), known, rtol=1e-12)


def test_binomial_interval_has_its_coverage():
    """That of Clopper and Pearson."""
    for failures in (0, 7, 100):
        exact = binomtest(failures, 100).proportion_ci(0.9)
        assert binomial_interval(failures, 100) == pytest.approx([*exact], rel=1e-9)


def test_lognormal_interval():
    assert lognormal_interval(1e-6, math.inf) == (0.0, 1.0)
    assert lognormal_interval(0.9, 0.5)[1] == 1.0
    # Eleven families: Student's quantile with ten degrees of freedom; ten thousand: the normal's.
    for families, quantile in ((11.0, 1.812), (1e4, 1.645)):
        low, high = lognormal_interval(1e-6, families**-0.5)
        width = 2.0 * quantile * math.sqrt(math.log1p(1.0 / families))
        assert math.log(high / low) == pytest.approx(width, rel=1e-3)


def test_ancestral_variance_of_independent_families_is_binomial():
    # 100 failures among 10,000 independent samples: (1 - p)/(p N), up to the correction 1/(1-v).
    plain = (1.0 - 0.01) / 100.0
    found = ancestral_variance(np.arange(100), 10_000)
    assert found == pytest.approx(plain / (1.0 - plain), rel=1e-12)
    # Ten families of ten are worth ten.
    assert ancestral_variance(np.repeat(np.arange(10), 10), 10**9) == pytest.approx(1.0 / 9.0)
    assert ancestral_variance(np.zeros(0, dtype=np.int64), 100) == math.inf
    assert ancestral_variance(np.zeros(9, dtype=np.int64), 10**20) == math.inf


class Uniform:
    """A limit state whose stress is uniform between 0 and 1: P(stress < p) = p."""

    meter = SILENT

    def __init__(self, number):
        self.rng = generator(number, 40)

    def draws(self, seed, first, samples):
        return self.rng.random(samples)

    def __call__(self, draws):
        return draws

    def member(self, draws):
        return np.zeros(draws.size, dtype=np.int64)


@pytest.mark.parametrize(
    ("chance", "target_cv", "least", "most"),
    [(0.03, 0.3, 100, 10**6), (0.012, 0.3, 1000, 1500), (0.5, 0.2, 10, 99)],
)
def test_counting_is_unbiased_whenever_it_stops(chance, target_cv, least, most):
    repeats = 2000
    options = {"target_cv": target_cv, "least": least, "max_evaluations": most}
    counts = [count_failures(Uniform(i), 0, chance, **options) for i in range(repeats)]
    found = np.array([count.probability for count, _ in counts]) / chance
    # Three standard errors of two thousand runs: 2 %. Counting until the estimate looks precise
    # enough is 9 % high at a chance of 0.01.
    assert abs(found.mean() - 1.0) < 3.0 * found.std() / math.sqrt(repeats)
    reported = np.array([count.cv for count, _ in counts])
    assert math.sqrt(np.mean(reported**2)) == pytest.approx(found.std(), rel=0.1)
    if most == 10**6:
        assert reported.max() <= target_cv
    ends = [count.interval() for count, _ in counts]
    inside = [low <= chance <= high for low, high in ends]
    # Clopper and Pearson hold at least 90 %; three standard errors less.
    assert np.mean(inside) > 0.9 - 3.0 * math.sqrt(0.1 * 0.9 / repeats)
    assert all(count.samples <= all_of_them.samples <= most for count, all_of_them in counts)


def test_errors_and_intervals_of_counts():
    """Until a failure: the interval of the negative binomial law."""
    assert Counted(0, 100).cv == math.inf
    # All of a count is no certainty: as if one in 101 had held.
    assert Counted(100, 100).cv == pytest.approx(1.0 / math.sqrt(101 * 100))
    assert Counted(50, 100).cv == pytest.approx(0.1)
    count = Counted(5, 200, until_failure=True)
    low, high = count.interval()
    # So many or fewer samples until the fifth failure; so many or more.
    assert nbinom.cdf(195, 5, low) == pytest.approx(0.05)
    assert nbinom.sf(194, 5, high) == pytest.approx(0.05)
    assert count.probability == 4 / 199


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["auto", "plain"])
def test_frequent_failures_of_an_interface_are_counted_without_bias(algorithm):
    """Near P = 1e-2, where 'auto' takes now one algorithm and now another."""
    problem = st.paper.problem(nodes=136)
    field = st.paper.strength(problem, 0.5)
    onsets = ensemble(problem, field, 1_000_000, seed=10**6)["critical_stress"]
    stress = float(np.quantile(onsets, 0.01))
    options = {"method": LOCAL, "algorithm": algorithm, "target_cv": 0.3}
    found = np.array([
        st.failure_probability(problem, field, stress, seed=i, **options).probability
        for i in range(150)
    ])  # fmt: skip
    # Two standard errors: about 5 % for the mean of 150 runs, 2 % for the reference.
    error = math.hypot(2.0 * found.std() / 0.01 / math.sqrt(150), 0.02)
    assert abs(found.mean() / 0.01 - 1.0) < error


def test_every_key_has_its_own_generator():
    keys = [(0, 1), (0, 1, 0), (0, 1, 1), (0, 2, 1), (1, 1, 0)]
    found = {generator(*key).random() for key in keys}
    assert len(found) == len(keys)
    # Nor is any that of a random field: property 0 or 1, block 1.
    for key in ((0, 1), (1, 1)):
        sequence = np.random.SeedSequence(entropy=0, spawn_key=key)
        assert np.random.Generator(np.random.PCG64DXSM(sequence)).random() not in found


def test_runs_are_pooled_by_their_size():
    tail = Tail([
        SimpleNamespace(
            samples=samples,
            probability=lambda _, chance=chance: chance,
            relative_variance=lambda _, variance=variance: variance,
        )
        for samples, chance, variance in ((1000, 1e-3, 0.04), (3000, 2e-3, 0.01), (1000, 0.0, 9.0))
    ])  # fmt: skip
    assert tail.probability(1.0) == pytest.approx(0.2 * 1e-3 + 0.6 * 2e-3)
    # Standard errors of the parts: 0.2 * 1e-3 * 0.2 and 0.6 * 2e-3 * 0.1; nothing seen adds none.
    error = math.hypot(0.4e-4, 1.2e-4)
    assert tail.cv(1.0) == pytest.approx(error / 1.4e-3)
