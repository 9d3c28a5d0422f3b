"""Linear limit states in many dimensions, whose failure probability is known."""

import math
import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
from checks import assert_mean, standard_error
from crooked import LINE
from scipy.stats import chi2, norm
from scipy.stats import t as student
from setups import beta_strength
from stand_ins import StandIn

import stiction as st
from stiction.random import equally_likely
from stiction.random.equally_likely import EquallyLikely
from stiction.reliability.subset import Descent, Population, descend, generator
from stiction.reliability.tail import Tail, log_width, repeat_until_precise, share_picked
from stiction.reliability.two_level import _covered, bridge

DIMENSION = 200
RUNS = 100


def linear(draws):
    """Standard normal in many dimensions, every draw with the same weight."""
    return draws.sum(axis=1) / math.sqrt(DIMENSION)


def first(draws):
    return draws[:, 0]


def root_mean(values):
    return math.sqrt(np.mean(values))


@lru_cache(maxsize=1)
def descents():
    """Independent runs to beta = 5; shallower tails are read off their earlier levels.

    And the difference of two draws in the last level of each, which failure does not depend on.
    """
    runs, across = [], []
    for seed in range(RUNS):
        run = descend(linear, DIMENSION, rng=generator(seed, 0), samples=1000, threshold=-5.0)
        across.append(run.populations[-1].draws[:, :2] @ (1.0, -1.0))
        runs.append(run.light())
    return runs, np.concatenate(across)


@pytest.mark.parametrize("beta", [3.0, 4.0, 5.0])
def test_subset_simulation_is_unbiased_and_knows_its_error(beta):
    runs, _ = descents()
    found = np.array([run.probability(-beta) for run in runs]) / norm.cdf(-beta)
    # Three standard errors of the mean of a hundred runs, 0.13 at beta = 5.
    assert_mean(found, 1.0, errors=3.0)
    reported = root_mean([run.relative_variance(-beta) for run in runs])
    # A hundred runs know their own spread to about 10 %; 30 % is three standard errors.
    assert reported == pytest.approx(found.std(ddof=1) / found.mean(), rel=0.3)


def test_levels_are_tenths_and_chains_move():
    for run in descents()[0][:5]:
        chances = np.exp([one.log_probability for one in run.populations])
        shares = chances[1:] / chances[:-1]
        # Ties, states that repeat along a chain, leave a few fewer than a tenth.
        assert shares[0] == pytest.approx(0.1, rel=1e-12)
        assert np.all((shares > 0.08) & (shares < 0.11))
        # The target is 0.37; the step adapts over nine steps a level.
        assert all(0.2 < one.acceptance < 0.6 for one in run.populations[1:])
        ceilings = [one.ceiling for one in run.populations]
        assert ceilings == sorted(ceilings, reverse=True)


def test_levels_chosen_from_the_samples_do_not_bias_the_estimate():
    """Four hundred small runs: ten seeds a level, where a biased rule adds a tenth each."""
    options = {"samples": 100, "threshold": -3.5}
    runs = [descend(first, 20, rng=generator(seed, 6), **options) for seed in range(400)]
    found = np.array([run.probability(-3.5) for run in runs]) / norm.cdf(-3.5)
    # With the threshold at the highest value that goes on, not the lowest that does not, the mean
    # is 1.34.
    assert standard_error(found) < 0.07
    assert_mean(found, 1.0, errors=4.0)


def test_samples_of_the_last_level_have_the_truncated_normal_distribution():
    runs, across = descents()
    excess = []
    for last in (run.populations[-1] for run in runs):
        excess.append(last.values.mean() + norm.pdf(last.ceiling) / norm.cdf(last.ceiling))
    assert_mean(excess, 0.0, errors=3.0)
    # Orthogonal directions remain standard normal. Each run holds some five independent families,
    # 500 in all: a standard error of 2 sqrt(2/500) = 0.13.
    assert across.var() == pytest.approx(2.0, abs=0.4)


def test_quantiles_of_pooled_runs_and_where_the_interval_of_a_probability_ends():
    tail = Tail(descents()[0])
    for beta in (1.0, 3.0, 4.5):
        # dP/P = beta d(beta): the pooled cv is below 0.06, so the quantile is good to 0.02.
        cv = tail.cv(-beta)
        assert cv < 0.07
        assert tail.quantile(norm.cdf(-beta)) == pytest.approx(-beta, abs=3.0 * cv / beta)
    tail, chance, cv = Tail(descents()[0][:10]), norm.cdf(-4.0), 0.3
    # Ten pooled runs step by some 1e-4 of the probability.
    for end, sign in zip(tail.stress_interval(chance, cv, -9.0), (-1.0, 1.0), strict=True):
        assert tail.probability(end) == pytest.approx(
            chance * math.exp(sign * log_width(cv)), rel=0.01
        )
    # Below what any run has seen there is only the bound.
    assert tail.stress_interval(1e-8, 2.0, -9.0)[0] == -9.0
    assert tail.stress_interval(chance, math.inf, -9.0)[0] == -9.0


@pytest.mark.slow
def test_runs_until_precise_are_unbiased():
    """Stopping when the estimate looks good must not favour estimates that look good."""

    def one(seed):
        def make(samples, number, left):
            rng = generator(seed, 1, number)
            return descend(linear, DIMENSION, rng=rng, samples=samples, threshold=-4.0)

        limits = {"first": 1000, "largest": 5000, "max_evaluations": 10**7}
        runs = repeat_until_precise(
            make, lambda runs: Tail(runs).cv(-4.0), target_cv=0.2, **limits
        )
        return Tail(runs).probability(-4.0), Tail(runs).cv(-4.0)

    found, reported = np.array([one(seed) for seed in range(50)]).T
    found /= norm.cdf(-4.0)
    assert np.all(reported <= 0.2)
    assert_mean(found, 1.0, errors=3.0)
    observed = found.std(ddof=1) / found.mean()
    assert root_mean(reported**2) == pytest.approx(observed, rel=0.3)


def test_two_levels_correct_for_an_imperfect_first_stage():
    """The cheap limit state may fail where the exact one holds and the other way round."""

    def cheap(draws):
        return draws[:, :2] @ (0.9, math.sqrt(0.19))

    options = {"samples": 300, "max_evaluations": 10**6, "threshold": -4.0}
    runs = [bridge(cheap, first, 50, rng=generator(i, 2), **options) for i in range(200)]
    found = np.array([run.probability(-4.0) for run in runs]) / norm.cdf(-4.0)
    # A standard error of some 0.06. Walks that start from what the cheap limit state sees, and
    # forget too little of it, are 0.25 low.
    assert_mean(found, 1.0, errors=3.0)
    # The median: a few runs with two or three failures report an error of several hundred per cent.
    reported = math.sqrt(np.median([run.relative_variance(-4.0) for run in runs]))
    assert reported == pytest.approx(found.std(ddof=1) / found.mean(), rel=0.35)
    assert bridge(first, first, 50, rng=generator(0, 2), **options).last == 1.0
    run = next(run for run in runs if run.last < 1.0)
    [level] = run.populations
    seen = math.exp(level.log_probability) * np.mean(level.values < -4.0)
    assert run.probability(-4.0) == pytest.approx(seen / run.last, rel=1e-12)
    assert run.last_variance > 0.0


def test_the_last_factor_is_of_walks_that_have_forgotten_where_they_began():
    """All walkers start where the guide sees them; it sees a fifth of what fails, -1.28 of 0."""

    def guide(draws):
        return draws[:, 0] + 1.8  # reaches zero one level later

    options = {"samples": 400, "max_evaluations": 1000, "threshold": 0.0}
    runs = [bridge(guide, first, 3, rng=generator(seed, 8), **options) for seed in range(300)]
    # A standard error of 0.003; with the first five steps of each walk the mean is 0.26.
    assert_mean([run.last for run in runs], 0.2, errors=4.0)
    spread = np.std([run.last for run in runs]) / 0.2
    # 300 runs know their spread to 4 %; a ceiling that varies adds a little.
    reported = root_mean([run.last_variance for run in runs])
    assert reported == pytest.approx(spread, rel=0.2)


def test_few_unequal_families_have_their_whole_variance():
    """Of a mean weighted by sizes, about the mean itself: each family pulls it to its own."""
    rng = np.random.default_rng(4)
    families = rng.permutation(np.repeat(np.arange(4), [19, 7, 5, 2]))
    seen = rng.normal(0.0, 0.1, (4000, 4)) + 0.7
    found = []
    for own in seen:
        covered = rng.random((200, families.size)) < own[families]
        states = np.where(covered, -1.0, 1.0).reshape(-1, 1)
        found.append(_covered(states, first, 0.0, families, 1000))
    last, variance = np.array(found).T
    # Without the pull it is 0.4 of that.
    assert np.mean(variance * last**2) == pytest.approx(last.var(), rel=0.1)


def test_evaluations_over_two_levels_are_the_samples_that_were_solved():
    """Of both functions, within the budget."""
    solved = {"exact": 0, "guide": 0}

    def counted(name, direction=(1.0, 0.0)):
        def function(draws):
            solved[name] += len(draws)
            return draws[:, :2] @ direction

        return function

    options = {"samples": 90, "threshold": -3.3, "max_evaluations": 333}
    away = (0.7, 0.714)  # a guide that often leads to no failure
    for seed, direction in ((1, (1.0, 0.0)), *((seed, away) for seed in range(12))):
        solved.update(exact=0, guide=0)
        guide, exact = counted("guide", direction), counted("exact")
        run = bridge(guide, exact, 7, rng=generator(seed, 9), **options)
        found = {"exact": run.evaluations, "guide": run.first_stage_evaluations}
        assert found == solved
        assert solved["exact"] <= 333
        assert (run.failing[1] < -3.3).all()


def test_a_poor_first_stage_is_told_by_its_ranks():
    rng = np.random.default_rng(0)
    exact = rng.standard_normal(1000)
    assert share_picked(exact, exact) == 1.0
    assert share_picked(3.0 * exact**3 + 7.0, exact) == 1.0
    # Independent ranks: a tenth, and 20 samples to tell it from.
    assert share_picked(rng.standard_normal(1000), exact) < 0.5
    # Half of the failures come from what the cheap limit state does not see.
    draws = rng.standard_normal((1000, 2))
    assert share_picked(draws[:, 0], draws.min(axis=1)) < 0.8


def test_runs_over_two_levels_that_find_no_failure_count_as_well():
    """The exact limit state lets go of one in a thousand of what the cheap one does."""

    def exact(draws):
        return np.where(draws[:, 1] < -3.0, draws[:, 0], draws[:, 0] + 10.0)

    options = {"samples": 100, "max_evaluations": 10**5, "threshold": -2.0}
    runs = [bridge(first, exact, 10, rng=generator(seed, 4), **options) for seed in range(600)]
    found = np.array([run.probability(-2.0) for run in runs])
    assert all(run.complete for run in runs)
    assert np.mean(found == 0.0) > 0.9
    # Some 20 runs find one. Were those that find none left out, or replaced by a look at a more
    # frequent level, the mean would be thirty times too high.
    assert_mean(found, norm.cdf(-2.0) * norm.cdf(-3.0), errors=4.0)


AT_ONE_PLACE = StandIn(lambda rows, stress: rows.strength[:, 37], seconds=1e-5)
"""Its onset is the strength at one node: its distribution is the marginal."""


def test_unknown_mean_and_variance_give_students_tail():
    """Five Gaussian peaks, of mean 1.1 MPa and deviation 30 kPa: their posterior in 7 x 8 cells."""
    count, mean, deviation = 5, 1.1e6, 30e3
    variances = (count - 1) * deviation**2 / chi2.ppf((np.arange(8) + 0.5) / 8, count - 1)
    places = norm.ppf((np.arange(7) + 0.5) / 7)
    pairs = [(mean + place * (v / count) ** 0.5, v**0.5) for v in variances for place in places]
    spectrum = beta_strength(9e-3).spectrum
    likely = [
        st.RandomInterface(strength=st.RandomField(norm(*pair), spectrum)) for pair in pairs
    ]
    options = {"method": AT_ONE_PLACE, "target_cv": 0.2, "seed": 5, "workers": 1}
    for score, algorithm in ((1.3, "plain"), (3.5, "subset")):
        stress, scale = mean - score * deviation, (1.0 + 1.0 / count) ** 0.5
        found = st.failure_probability(LINE, likely, stress, algorithm=algorithm, **options)
        each = np.array([norm.cdf(stress, *pair) for pair in pairs])
        error = 4.0 * found.cv * found.probability
        assert found.probability == pytest.approx(each.mean(), abs=error)
        # The cells are coarse: 21 % in the tail, where known parameters give a seventieth of it.
        tail = student.cdf(-score / scale, count - 1)
        assert found.probability == pytest.approx(tail, abs=0.21 * tail + error)
    assert norm.cdf(-score) < tail / 70.0
    # Those of members have this mean; of many no sample is so low.
    assert np.nansum(found.members) / len(pairs) == pytest.approx(found.probability, rel=0.05)
    assert np.isnan(found.members).mean() > 0.05
    assert np.isnan(found.band[0])
    carry = each > each.mean()
    assert found.members[carry].sum() == pytest.approx(each[carry].sum(), rel=4.0 * found.cv)
    assert found.band[1] == pytest.approx(np.quantile(each, 0.95), rel=0.5)


@dataclass(frozen=True)
class UnknownMean:
    """Strengths of deviation 30 kPa whose mean is 1.1 MPa, known to a deviation of its own."""

    deviation: float

    def interfaces(self, count, seed=0):
        means = np.random.default_rng([seed, 8]).normal(1.1e6, self.deviation, count)
        spectrum = beta_strength(9e-3).spectrum
        return [
            st.RandomInterface(strength=st.RandomField(norm(m, 30e3), spectrum)) for m in means
        ]


def test_as_many_members_are_drawn_as_the_target_needs(monkeypatch):
    monkeypatch.setattr(equally_likely, "FIRST_MEMBERS", 100)
    source, options = UnknownMean(24e3), {"method": AT_ONE_PLACE, "seed": 3, "progress": False}
    scale = math.hypot(24e3, 30e3)
    stress = 1.1e6 - 2.9 * scale
    true = norm.cdf(-2.9)
    found = st.failure_probability(LINE, source, stress, **options, target_cv=0.3)
    # By 100 members the mean over them alone has an error of about a half.
    assert found.members.size > 200
    assert 0.0 < found.members_cv <= 0.6 * 0.3
    assert found.cv <= 0.3
    assert found.probability == pytest.approx(true, rel=4.0 * found.cv)
    options_of_design = options | {"target_cv": 0.5, "sensitivities": False}
    design = st.design_stress(LINE, source, probability=true, **options_of_design)
    slope = norm.pdf(2.9) / true / scale
    assert design.stress == pytest.approx(stress, abs=4.0 * design.cv / slope)
    curve = st.failure_curve(LINE, source, smallest=0.01, **options, target_cv=0.3)
    assert curve.sizes["member"] > 100
    assert 0.0 < curve.members_cv[-1] <= 0.6 * 0.3
    assert np.isnan(curve.band_low[-1])
    # A list is a sample, and the answer says so; what it was drawn from would do.
    few = source.interfaces(12, seed=1)
    given = st.failure_probability(LINE, few, stress, **options, target_cv=0.3)
    exact = norm.cdf(stress, [one.strength.mean for one in few], 30e3)
    shares = exact / exact.sum()
    # Failures are of some hundred ancestors.
    assert given.members_cv == pytest.approx(math.sqrt(np.sum(shares**2) - 1 / 12), rel=0.3)
    assert given.cv == pytest.approx(given.members_cv, rel=0.2)
    carriers = 1 + np.searchsorted(np.cumsum(np.sort(shares)[::-1]), 0.9)
    told = int(re.search(r"(\d+) of 12.*90% of the mean", given.warnings[-1])[1])
    assert told == pytest.approx(carriers, abs=1)
    assert np.isnan(found.band[0])  # few members have samples so low
    shown = re.search(r"95 % of interfaces have at most +([\d.e-]+)", str(given))
    assert float(shown[1]) == pytest.approx(given.band[1], rel=1e-5)
    alike = st.failure_probability(LINE, few[:1] * 12, 1.01e6, **options, target_cv=0.3)
    assert alike.members_cv == 0.0  # one interface, twelve times
    # Entries as a posterior holds them: the weak ones seldom, so that all fail about as often.
    counts = np.maximum(1, np.round(0.01 / exact)).astype(int).clip(max=40)
    many = [one for one, count in zip(few, counts, strict=True) for _ in range(count)]
    weighed = st.failure_probability(LINE, many, stress, **options, target_cv=0.3)
    shares, held = counts * exact / (counts @ exact), counts / counts.sum()
    assert math.sqrt(np.sum(shares**2) - np.sum(held**2)) < 0.7 * np.linalg.norm(shares - held)
    assert weighed.members_cv == pytest.approx(np.linalg.norm(shares - held), rel=0.3)


class Again(UnknownMean):
    """The same hundred again and again, but for one that long lists hold."""

    def interfaces(self, count, seed=0):
        known = super().interfaces(101, seed)
        return [known[100 if number == 150 else number % 100] for number in range(count)]


def test_a_longer_list_without_others_is_not_computed(monkeypatch):
    monkeypatch.setattr(equally_likely, "FIRST_MEMBERS", 100)
    options = {"method": AT_ONE_PLACE, "target_cv": 0.3, "progress": False}
    found = st.failure_probability(LINE, Again(40e3), 0.96e6, **options)
    assert found.members.size == 100
    assert "more repetitions" in found.warnings[-1]


@pytest.mark.parametrize(("spread", "count"), [(0.0, 25), (1.2, 25), (1.2, 3), (0.7, 4)])
def test_the_error_of_a_list_is_not_that_of_its_samples(spread, count):
    """Pairs of runs of 40 and 60 families, pooled; of a few or many entries two are equal."""
    rng = np.random.default_rng(2)
    chances = np.exp(spread * rng.standard_normal(count))
    chances[count // 3] = chances[-1]
    shares, kinds = chances / chances.sum(), np.append(np.arange(count - 1), count // 3)
    found = []
    for _ in range(200):
        runs = []
        for size, copies in ((40, 5), (60, 3)):
            members = np.repeat(rng.choice(count, size, p=shares), copies)
            ancestors = np.repeat(np.arange(size), copies)
            values = np.zeros(members.size)
            level = Population(math.inf, 0.0, values, ancestors, members, np.zeros((0, 0)))
            runs.append(Descent(1000, [level], 1.0, 1000, True))
        found.append(Tail(runs).members_cv(1.0, kinds) ** 2)
    entries, own = np.bincount(kinds) / count, np.bincount(kinds, shares)
    expected = np.sum((own - entries) ** 2) / (1.0 - np.sum(entries**2))
    # With the samples of each entry as they are it is 0.01 higher; below zero it is cut off.
    assert np.mean(found) == pytest.approx(expected, abs=4e-3, rel=0.05 * (count < 9))


def test_small_repetitions_over_members_are_unbiased():
    """Five members in an order that is not that of their strength: the weakest carries the tail."""
    shifts = np.array([1.5, -0.4, 0.3, 1.1, 0.0])
    random = EquallyLikely((st.RandomInterface(strength=beta_strength(9e-3)),) * 5)

    def lowest(draws):
        return draws[:, 1:].sum(axis=1) / 5.0 + shifts[random.member(draws)]

    options = {"samples": 100, "threshold": -3.3, "label": random.member}
    runs = [descend(lowest, 26, rng=generator(seed, 8), **options) for seed in range(400)]
    true = norm.cdf(-3.3 - shifts)
    found = np.array([run.probability(-3.3) for run in runs]) / true.mean()
    assert standard_error(found) < 0.12
    assert_mean(found, 1.0, errors=3.5)
    # The probability of each member is unbiased as well, those that are seen in few runs too.
    shares = []
    for run in runs:
        each, members, *_ = run.below(-3.3)
        shares.append(5 * each * np.bincount(members, minlength=5))
    for number in (1, 2, 4):
        assert_mean(np.array(shares)[:, number], true[number], errors=3.5)
    resolved = Tail(runs).of_members(-3.3, 5)
    assert resolved[[1, 2, 4]] == pytest.approx(true[[1, 2, 4]], rel=0.5)
    assert np.isnan(resolved[0])  # of the strongest no sample is so low
    # Where every plain sample fails, how many were drawn of a member makes no difference.
    assert Tail(runs).of_members(99.0, 5) == pytest.approx(np.ones(5), rel=1e-12)
    # Nor that many runs hold none of a member of a long list.
    many = EquallyLikely(random.members[:1] * 300)
    options |= {"label": many.member}
    generators = (generator(seed, 8) for seed in range(60))
    long = [descend(lambda draws: draws[:, 1], 26, rng=rng, **options) for rng in generators]
    assert Tail(long).of_members(99.0, 300) == pytest.approx(np.ones(300), rel=1e-12)
