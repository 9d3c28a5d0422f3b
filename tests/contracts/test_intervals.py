"""Laws of intervals and budgets: they hold the estimate, widen with an error, and end in time."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from joint import FIELD, GIVEN, PROBLEM, RANDOM
from refusals import refuses, warning_texts
from scipy.stats import binom, entropy
from setups import EXACT, LOCAL, make_problem

import stiction as st
from stiction.base.variables import unit_of_key
from stiction.inference.bootstrap import Refits, intervals

QUIET = {"progress": False}
RECORDS = st.Interface(0.12, 512)
ROUGH = st.PowerLawSpectrum(2e-3, exponent=1.5, power_kept=0.99)
FIXED = {"type": "power_law", "exponent": 1.5}
TRUTHS = {
    "beta": st.Beta(alpha=1.5, beta=3.0, low=0.6e6, high=1.66e6),
    "lognormal": st.Lognormal(mean=1e6, cv=0.2),
    "gamma": st.Gamma(mean=1e6, cv=0.2),
    "weibull": st.Weibull(mean=1e6, cv=0.2),
    "normal": st.TruncatedNormal(mean=1e6, cv=0.2, low=5e5, high=1.5e6),
}
FIELDS = [
    dataclasses.replace(FIELD, marginal=st.Gamma(mean=m, cv=0.15)) for m in (0.19, 0.2, 0.21)
]
LIST = [dataclasses.replace(RANDOM, strength=field) for field in FIELDS]


@cache
def fitted(marginal, noise, seed=0, of=None, bootstrap=20):
    """A fit to two records with noise of 8 kPa, and the values."""
    truth = st.RandomField(TRUTHS[marginal] if of is None else of, ROUGH)
    values = truth.sample(RECORDS, samples=2, seed=seed)
    values = values + 8e3 * np.random.default_rng(seed).standard_normal(values.shape)
    given = {"marginal": marginal, "spectrum": FIXED, "bootstrap": bootstrap} | QUIET
    return st.fit_field(values, RECORDS, noise=noise, **given), values


@pytest.mark.parametrize(
    ("marginal", "noise"),
    [*((name, True) for name in TRUTHS), ("beta", False), ("gamma", False), ("beta", 8e3),
     ("normal", 8e3)],
)  # fmt: skip
def test_intervals_of_a_fit_hold_its_estimates(marginal, noise):
    """Whether the noise of the records is fitted, left out or known."""
    fit, values = fitted(marginal, noise, 0)
    for name, estimate in fit.parameters.items():
        low, high = fit.interval[name]
        assert low <= estimate <= high, name
        if name in ("marginal.low", "marginal.high"):  # within ten ranges of the values
            assert abs(np.array([low, high]) - values.mean()).max() < 11.0 * np.ptp(values)


def test_a_noise_that_is_negative_by_chance_has_an_interval_from_zero():
    """As wide as that of an estimate of zero."""
    fit, values = fitted("beta", True)
    width, repeated = fit._estimate.noise[1], []
    for estimate in (0.0, -1e11):
        truth = dataclasses.replace(fit._estimate, noise=(estimate, width))
        repeated.append(intervals([Refits(truth, fit._repeated[0].fits)], values)["noise"])
    assert repeated[0][0] == 0.0 < repeated[0][1]
    assert repeated[1] == pytest.approx(repeated[0], rel=1e-9)


def test_a_p_value_is_the_fraction_of_repetitions_that_differ_as_much():
    """Of fits to different records, of which a fraction p of 20 repetitions scatters."""
    of = dataclasses.replace(TRUTHS["beta"], alpha=1.1)
    fits = [fitted("beta", False, 100 + seed, of)[0] for seed in range(4)]
    fits += [fitted("beta", False)[0], fitted("gamma", True)[0]]
    away = []
    for fit in fits:
        truth, repetitions = fit._repeated[0]
        for name, distance in (("marginal", "distance"), ("spectrum", "roughness")):
            far = [getattr(one, distance) >= getattr(truth, distance) for one in repetitions]
            p = fit.p_values[name]
            away.append((p - np.mean(far)) ** 2 / (p * (1.0 - p) / len(far)))
    assert np.mean(away) < 2.0  # 1 for a fraction that is independent of p


def test_ends_of_an_interval_are_admissible_with_ends_of_another():
    """With more noise, a bound may lie further inside the values: its interval says so."""
    inside = []
    for seed in range(2):
        fit, values = fitted("beta", True, seed)
        family = fit._estimate.setting.marginal
        noises = fit.parameters["noise"], fit.interval["noise"][1]
        limits = [family.quiet(values, noise).min() for noise in noises]
        end = fit.interval["marginal.low"][1]
        assert end <= limits[1] * (1.0 + 1e-12)
        inside.append(end > limits[0])
    assert any(inside)


def test_a_fit_in_another_unit_is_the_fit_in_that_unit():
    """Of strengths as of coefficients, with noise that is fitted."""
    fit, values = fitted("gamma", True)
    given = {"marginal": "gamma", "spectrum": FIXED, "bootstrap": 20} | QUIET
    given |= {"quantity": "friction_coefficient"}
    other = st.fit_field(values * 2.0**-21, RECORDS, noise=True, **given)
    for name, value in fit.parameters.items():
        factor = 2.0**-21 if unit_of_key(name, "Pa") == "Pa" else 1.0
        found = (other.parameters[name], *other.interval[name])
        assert found == pytest.approx(
            np.multiply((value, *fit.interval[name]), factor), rel=1e-6
        )
    assert other.p_values == pytest.approx(fit.p_values, rel=1e-6)


MANY = [pytest.param(*row, 40, marks=pytest.mark.slow) for row in ((1.1, False), (1.5, 8e3))]


@pytest.mark.parametrize(("alpha", "noise", "count"), [(1.1, False, 4), *MANY])
def test_shapes_near_their_limit_are_covered(alpha, noise, count):
    """A shape at a free bound is at least 1; the interval respects this, and is no shorter."""
    hits = {"marginal.alpha": 0, "marginal.beta": 0}
    truth = {"marginal.alpha": alpha, "marginal.beta": 3.0}
    of = dataclasses.replace(TRUTHS["beta"], alpha=alpha)
    for seed in range(count):
        fit, _ = fitted("beta", noise, 100 + seed, of, 40 if count > 4 else 20)
        for name, right in truth.items():
            low, high = fit.interval[name]
            assert low >= min(1.0, fit.parameters[name]), name
            hits[name] += low <= right <= high
    # 40 repetitions determine the tails of errors to two or three percent.
    assert min(hits.values()) >= binom.ppf(1e-3, count, 0.85)


def answers():
    """Calls whose answer rests on a list of equally likely interfaces."""
    given = GIVEN | {"seed": 4}
    demand = st.failure_probability(PROBLEM, LIST, 0.7e6, **given)
    yield demand.interval["probability"], demand.probability, demand.cv, demand.members_cv
    curve = st.failure_curve(PROBLEM, LIST, smallest=0.02, **given)
    names = ("probability_low", "probability_high", "probability", "cv", "members_cv")
    for low, high, *rest in np.transpose([curve[name].values for name in names]):
        yield (low, high), *rest


def test_the_list_widens_an_interval_beyond_sampling():
    for (low, high), estimate, cv, by_list in answers():
        assert low <= estimate <= high
        assert by_list < cv
        # The interval is at least the log-normal interval of its own error, at 90 %.
        whole = 2.0 * 1.644 * math.sqrt(math.log1p(cv**2))
        assert math.log(high / low) > whole or high == 1.0
        # A log-normal interval by sampling alone, with normal quantiles, is shorter.
        sampling = math.sqrt(math.log1p(cv**2 - by_list**2))
        assert math.log(high / low) > 2.0 * 1.64 * sampling or high == 1.0


@pytest.mark.parametrize("more", [{}, {"problem.friction.weakening_rate": (2e11, 4e11)}])
def test_intervals_of_a_posterior_hold_its_mean(more):
    problem = make_problem(64, 0.05)
    field = st.RandomField(TRUTHS["beta"], st.PowerLawSpectrum(4e-3))
    peaks, prior = [5.9e5, 6.2e5, 6.6e5, 7.1e5], {"marginal.low": (5.6e5, 7.2e5)}
    posterior = st.infer(
        problem, field, peaks, unit="Pa", prior=prior | more, method=LOCAL, samples=300, **QUIET
    )
    for u, name in zip(posterior.u.T, posterior.names, strict=True):
        low, high = posterior.interval[name]
        assert low <= posterior.mean[name] <= high, name
        # Of 4000 draws in 40 steps of the prior.
        information = math.log(40) - entropy(np.histogram(u, 40, (0.0, 1.0))[0])
        assert posterior.information[name] == pytest.approx(information, abs=0.05), name


@pytest.mark.parametrize(("share", "most"), [(0.05, 300), (0.5, 1000)])
@pytest.mark.parametrize("algorithm", ["auto", "plain", "subset", "two_level"])
def test_no_answer_takes_more_evaluations_than_allowed(algorithm, most, share):
    """With rough fields, which the guide ranks poorly, and with smooth ones."""
    problem = make_problem(96, 0.0144)
    marginal = st.Lognormal(mean=1e6, cv=0.4)
    field = st.RandomField(marginal, st.PowerLawSpectrum(share * 3.4e-3), True)
    answer = st.failure_probability(
        problem, field, 4.5e5, method=EXACT, algorithm=algorithm, max_evaluations=most,
        seed=1, workers=1, target_cv=0.5, **QUIET,
    )  # fmt: skip
    assert 0 < answer.evaluations <= most


def test_the_field_of_a_fit_is_not_taken_for_the_fit():
    """Where the fit says more than its field, a call with the field says so."""
    records = FIELD.sample(PROBLEM.interface, samples=3) * [[1.0], [0.9], [1.1]]
    given = {"marginal": "gamma", "noise": False, "bootstrap": 20, "progress": False}
    given["quantity"] = "friction_coefficient"
    fit = st.fit_field(records, PROBLEM.interface, between=True, **given)
    stress = 0.55e6
    rough = GIVEN | {"target_cv": 0.5}
    peaks, few = [0.9e6, 1e6, 1.1e6], {"method": LOCAL, "samples": 100} | QUIET
    calls = (
        lambda: st.infer(PROBLEM, fit.field, peaks, unit="Pa", **few),
        lambda: st.failure_probability(PROBLEM, fit.field, stress, **rough),
        lambda: st.design_stress(PROBLEM, fit.field, probability=0.1, **rough),
        lambda: st.failure_curve(PROBLEM, fit.field, smallest=0.1, **rough),
    )
    for call in calls:
        assert any("is the field of a fit" in text for text in warning_texts(call))
    mended = st.RandomInterface(strength=fit.field, between=RANDOM.between)
    texts = warning_texts(lambda: st.failure_probability(PROBLEM, mended, stress, **rough))
    assert not any("is the field of a fit" in text for text in texts)


JOINT = make_problem(
    64, 0.05, width=0.01, load=st.Load(pressing_force=2500.0), weakening_rate=0.25e12,
    residual_ratio=0.4,
)  # fmt: skip
SLIPS = 500.0 * np.array([1.0, 0.93, 1.08, 1.02, 0.96])  # N
OF_TESTS = {"method": LOCAL, "progress": False}


@pytest.fixture
def few_members(monkeypatch):
    """Lists of 300 members, where a thousand are drawn otherwise."""
    monkeypatch.setattr("stiction.random.equally_likely.FIRST_MEMBERS", 300)


@pytest.fixture(scope="module")
def tests_alone():
    return st.infer(JOINT, FIELD, SLIPS, unit="N", samples=100, **OF_TESTS)


@pytest.mark.usefixtures("few_members")
def test_a_design_from_tests_names_all_that_it_rests_on(tests_alone, tmp_path):
    """What tests calibrate has no effect twice; families, values and assumptions are told."""
    design = st.design_stress(
        JOINT, tests_alone, probability=1e-5, target_cv=0.3, max_evaluations=1000, **OF_TESTS
    )
    assert design.evaluations <= 1000
    effects = design.sensitivities.sel(source="problem.load.pressing_force")
    ends = float(effects.stress_at_low), float(effects.stress_at_high)
    # Coefficients of 10 % less under 10 % more force: the tests keep the onset.
    assert ends == pytest.approx((design.stress, design.stress), rel=5e-3)
    families = design.by_family
    # With five tests large scatters are likely, at which the normal is cut off at zero.
    assert min(families["weibull"], families["normal"]) < families["lognormal"]
    assert design.partial_factor == design.characteristic_stress / design.stress > 1.0
    stated = design.sensitivities.sel(source="variation along a specimen")
    assert float(stated.stress_at_high) == pytest.approx(design.stress, rel=1e-9)
    spread = abs(design.sensitivities.stress_at_high - design.sensitivities.stress_at_low)
    assert (
        np.diff(spread) <= 1e-9 * design.stress
    ).all()  # the largest effect of any sign first
    named = set(design.sensitivities.source.values)
    assert {"marginal.cv", "correlation_length"} <= named
    text = str(tests_alone)
    assert text.count("stated, not measured") == 1  # the field in words
    assert [*tests_alone.draws] == ["mean", "between"]
    page = design.write_page(tmp_path / "design.html").read_text("utf-8")
    for words in ("cv=0.15", "PowerLawSpectrum", "half-Cauchy", "465", "weibull", "seed 0"):
        assert words in page, words
    assert "NoneType" not in page
    # Another preload in new joints than in the tests moves the design in proportion.
    other = dataclasses.replace(JOINT, load=st.Load(pressing_force=2000.0))
    source = st.infer(JOINT, FIELD, SLIPS, unit="N", between="normal", samples=100, **OF_TESTS)
    moved = st.design_stress(
        other, source, probability=1e-2, target_cv=0.3, max_evaluations=1000, **OF_TESTS
    )
    effects = moved.sensitivities.sel(source="problem.load.pressing_force")
    assert float(effects.stress_at_high / effects.stress_at_low) == pytest.approx(
        1.1 / 0.9, rel=5e-3
    )


@pytest.mark.usefixtures("few_members")
def test_scatter_of_new_joints_alone_lowers_a_design(tests_alone):
    """As a quadrature over the factor gives it, with the tests as they are."""
    cv = 0.1
    scatter = {"pressing_force": st.Lognormal(mean=1.0, cv=cv)}
    joints = tests_alone.with_between(scatter)
    given = {"target_cv": 0.2, "sensitivities": False, "max_evaluations": 2000, **OF_TESTS}
    alone = st.design_stress(JOINT, tests_alone, probability=1e-2, **given)
    both = st.design_stress(JOINT, joints, probability=1e-2, **given)
    assert both.stress < 0.99 * alone.stress
    peaks = np.sort(tests_alone.predicted[0]) / JOINT.area
    factors = scatter["pressing_force"].distribution.ppf((np.arange(400) + 0.5) / 400)
    right = np.quantile(np.outer(peaks, factors), 0.01)
    assert both.stress == pytest.approx(right, rel=0.05)
    refuses("strength: is inferred", lambda: tests_alone.with_between({"strength": None}))


def test_a_deviation_is_in_the_band_if_its_p_value_is_above_ten_percent():
    """For campaigns of four tests from the prediction, and shifted more and more from it."""
    rng, seen = np.random.default_rng(0), set()
    prediction = st.monte_carlo(
        make_problem(256), st.RandomField(TRUTHS["beta"], ROUGH), method=LOCAL, samples=400,
        pilot=False, **QUIET,
    )  # fmt: skip
    known = prediction.critical_stress.values
    for shift in np.linspace(0.0, 6e4, 16):
        peaks = rng.choice(known, 4) + shift
        found = st.statistics.agreement(prediction, peaks, unit="Pa", seed=1)
        p_value = found.p_values["largest_deviation"]
        if abs(p_value - 0.1) > 0.02:  # 999 replicates know a p-value of 0.1 to 0.01
            seen.add(p_value > 0.1)
            assert (found.largest_deviation <= found.band) == (p_value > 0.1)
    assert seen == {True, False}


def test_the_fit_of_a_mirrored_record_is_the_mirrored_fit():
    """With a bound known at either end, where the shape may fall below 1."""
    truth = st.Beta(alpha=0.7, beta=2.6, low=0.6e6, high=1.6e6)
    line, smooth = st.Interface(0.5, 2048), st.SquaredExponentialSpectrum(3e-3)
    (values,) = st.RandomField(truth, smooth, mean_mode=True).sample(line, samples=1, seed=3)
    options = {"spectrum": "squared_exponential", "noise": False, "bootstrap": 20} | QUIET
    fits = [
        st.fit_field(record, line, marginal={"type": "beta"} | known, **options).field.marginal
        for record, known in ((values, {"low": 0.6e6}), (2.2e6 - values, {"high": 1.6e6}))
    ]
    pairs = [(one.alpha, one.beta) for one in fits]
    # Both searches end within 1e-6 of the same maximum.
    assert pairs[0] == pytest.approx(pairs[1][::-1], rel=1e-4)
    assert pairs[0][0] < 1.0 < pairs[0][1]
    assert fits[0].high == pytest.approx(2.2e6 - fits[1].low, rel=1e-4)
