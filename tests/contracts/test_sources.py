"""Laws of random inputs: a source is its interfaces, and what hardly varies is a constant."""

from __future__ import annotations

import dataclasses
import inspect
import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from contracts.bodies import SOLID, attempt
from recording import evaluated

import stiction as st
from stiction.problem.sample import REPLACED
from stiction.random.dotted_keys import with_values
from stiction.random.equally_likely import EquallyLikely
from stiction.random.stresses import mean_in_stress, profiles_in_stress, support_in_stress
from stiction.random.synthesis import FACTORS

pytestmark = pytest.mark.filterwarnings("ignore")
QUIET, MEMBERS, SEED = {"progress": False}, 20, 5
LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
FRICTION = st.LinearWeakening(weakening_rate=0.25e12)
INTERFACE = st.Interface(0.05, 64, width=0.013)
PROBLEM = st.Problem(SOLID, INTERFACE, FRICTION, st.Load(normal_pressure=2e6))
SPECTRUM = st.PowerLawSpectrum(4e-3)
FIELD = st.RandomField(st.Gamma(mean=1e6, cv=0.2), SPECTRUM, mean_mode=True)
FACTORED = st.RandomInterface(
    strength=FIELD, between={"strength": st.Lognormal(mean=1.0, cv=0.1)}
)
PEAKS = 0.8e6 * np.exp(0.05 * np.random.default_rng(8).standard_normal(6))
LENGTHS = {0.05: PEAKS[:3], 0.075: PEAKS[3:]}
PRIOR = {"marginal.mean": (0.8e6, 1.2e6)}


@cache
def fit(between: bool) -> st.FieldFit:
    records = FIELD.sample(INTERFACE, samples=3) * [[1.0], [0.93], [1.08]]
    quick = {"marginal": "gamma", "noise": False, "bootstrap": 20, "between": between}
    return st.fit_field(records, INTERFACE, **quick, **QUIET)


def inferred(random: Any, peaks: Any = PEAKS, **more: Any) -> Any:
    return st.infer(
        PROBLEM, random, peaks, unit="Pa", method=LOCAL, samples=100, **more, **QUIET
    )


SOURCES: dict[str, Any] = {  # all kinds of random inputs, and what the package makes of them
    "field": lambda: FIELD,
    "interface": lambda: FACTORED,
    "list": lambda: [FIELD, dataclasses.replace(FIELD, marginal=st.Gamma(mean=9e5, cv=0.2))],
    "fit": lambda: fit(False),
    "fit with scatter": lambda: fit(True),
    "posterior": lambda: inferred(FIELD, prior=PRIOR),
    "posterior of two lengths": lambda: inferred(FIELD, LENGTHS, prior=PRIOR),
    "tests alone": lambda: inferred(FIELD),
    "tests of two lengths": lambda: inferred(FACTORED, LENGTHS),
    "profiles and tests": lambda: inferred(fit(True)),
}
source_of = cache(lambda name: SOURCES[name]())
ASKED = {"target_cv": 0.5, "seed": SEED} | QUIET
CALLS: dict[str, Any] = {  # every call that takes what may be random, here p and r, by a method m
    "monte_carlo": lambda p, r, m: st.monte_carlo(
        p, r, method=m, samples=8, seed=SEED, pilot=False, **QUIET).critical_stress.values,
    "Study": lambda p, r, m: st.Study(problem=p, random=r, method=m, samples=8, seed=SEED).run(
        pilot=False, **QUIET).critical_stress.values,
    "failure_probability": lambda p, r, m: st.failure_probability(
        p, r, 0.8e6, method=m, **ASKED).probability,
    "design_stress": lambda p, r, m: st.design_stress(
        p, r, probability=0.2, sensitivities=False, method=m, **ASKED).stress,
    "failure_curve": lambda p, r, m: st.failure_curve(
        p, r, smallest=0.1, method=m, **ASKED).stress.values,
    "external.limit_state": lambda p, r, m: (
        lambda state: state(state.draws(0, 0, 8)))(st.external.limit_state(p, r, m)),
    "external.simulator": lambda p, r, m: st.external.simulator(
        p, r, ("marginal.cv",), method=m, samples=4)([0.2]),
    "infer": lambda p, r, m: st.infer(
        p, r, PEAKS, unit="Pa", method=m, samples=100, **QUIET).mean["mean"],
    "infer with a prior": lambda p, r, m: st.infer(
        p, r, PEAKS, unit="Pa", prior={"marginal.cv": (0.1, 0.3)}, method=m, samples=100, **QUIET
    ).mean["marginal.cv"],
    "infer from coefficients": lambda p, r, m: st.infer(
        p, r, PEAKS / 2e6, unit="1", method=m, samples=100, **QUIET).mean["mean"],
}  # fmt: skip
ELSEWHERE = {"design_of_tests"}
"""See tests/user/test_expected_widths.py."""
NO_SOURCE = {name for name in CALLS if "infer" in name or "simulator" in name}
"""Calls that change a field, or join it with peaks."""


def test_every_call_that_takes_what_is_random_has_a_line():
    modules = {"": st, "external.": st.external}
    calls = {
        prefix + name
        for prefix, module in modules.items()
        for name in module.__all__
        if inspect.isfunction(getattr(module, name)) or name == "Study"
        if "random" in inspect.signature(getattr(module, name)).parameters
    }  # fmt: skip
    assert calls - ELSEWHERE == {name.split()[0] for name in CALLS}


OF_SOURCES = [call for call in CALLS if call not in NO_SOURCE]
TAIL = {"design_stress": ["list", "posterior"], "failure_curve": ["list", "profiles and tests"]}
"""Calls that draw members as `failure_probability` does, and a few sources for each."""


@pytest.mark.parametrize(
    ("call", "name"), [(call, name) for call in OF_SOURCES for name in TAIL.get(call, SOURCES)]
)
def test_a_source_is_the_list_of_its_interfaces(call, name, monkeypatch):
    """To the bit, also for a source that draws more members when an answer needs them."""
    for place in ("stiction.study.study", "stiction.random.equally_likely"):
        monkeypatch.setattr(f"{place}.FIRST_MEMBERS", MEMBERS)
    source = source_of(name)
    seed = 0 if call == "external.limit_state" else SEED
    members = source.interfaces(MEMBERS, seed) if hasattr(source, "interfaces") else source
    found, expected = (CALLS[call](PROBLEM, given, LOCAL) for given in (source, members))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("call", sorted(NO_SOURCE))
@pytest.mark.parametrize("name", SOURCES)
def test_a_call_that_changes_a_field_takes_a_source_or_names_it(call, name):
    result, refusal = attempt(lambda: CALLS[call](PROBLEM, source_of(name), LOCAL))
    assert "random" in refusal if refusal else np.isfinite(result).all()


CLOSE = {"design_stress": 0.1, "failure_curve": 0.1, "infer with a prior": 0.04}
"""Chains of samples take other ways with more draws, and a posterior may be interpolated."""
CONSTANTS = {  # a value of each constant of a problem that may be random
    "residual_strength": 1e5, "initial_stress": 2e4, "normal_pressure": 2e6,
    "weakening_rate": 0.25e12, "critical_slip": 5e-6, "fracture_energy": 4.0,
}  # fmt: skip
COEFFICIENT = st.RandomField(
    st.Gamma(mean=0.5, cv=0.2), SPECTRUM, mean_mode=True, quantity="friction_coefficient"
)


OF_LAW, QUICK = REPLACED["critical_slip"], ("monte_carlo", "Study", "external.limit_state")
VARYING = [  # properties of a law are solved exactly, which takes a minute for some calls
    (name, call)
    for name, keys in REPLACED.items()
    for call in CALLS
    if call in QUICK
    or not {*keys} & {*OF_LAW}
    or (name == "critical_slip" and call not in CLOSE)
]


@pytest.mark.parametrize(("name", "call"), VARYING)
def test_a_property_that_hardly_varies_is_a_constant(name, call):
    """Each constant of a problem may be random in each call, with the same draws of the rest."""
    value, strength = CONSTANTS[name], COEFFICIENT if name == "normal_pressure" else FIELD
    (key,) = [key for key in REPLACED[name] if key.endswith(f".{name}")]
    of_law = key in OF_LAW
    friction, method = (st.LinearWeakening(), EXACT) if of_law else (FRICTION, LOCAL)
    bare = dataclasses.replace(PROBLEM, friction=friction, load=st.Load())
    constant = with_values({"problem": bare}, {f"problem.{key}": value})["problem"]
    field = st.RandomField(st.Lognormal(mean=value, cv=1e-8), SPECTRUM)
    both = st.RandomInterface(**{"strength": strength, name: field})
    (found, refusal), (expected, other) = (
        attempt(lambda p=problem, r=random: CALLS[call](p, r, method))
        for problem, random in ((bare, both), (constant, strength))
    )
    assert bool(refusal) == bool(other), refusal or other
    if not refusal:
        np.testing.assert_allclose(found, expected, rtol=CLOSE.get(call, 1e-5))


STATED = evaluated("constants with a factor", globals())
"""The constant of a problem that a factor multiplies."""


@pytest.mark.parametrize("name", FACTORS)
def test_what_has_a_factor_is_multiplied_and_no_onset_lies_beyond_the_bounds(name):
    """Sample by sample, and of samples near the ends of the strength and of the factor."""
    key, value = STATED.get(name, ("friction.weakening_rate", 0.25e12))
    pressed = name in ("normal_pressure", "pressing_force")
    scale = 1.0 if pressed else 2e6
    marginal = st.Beta(alpha=0.7, beta=0.7, low=0.4 * scale, high=0.6 * scale)
    strength = dataclasses.replace(COEFFICIENT if pressed else FIELD, marginal=marginal)
    friction = st.LinearWeakening() if key in REPLACED["critical_slip"] else FRICTION
    problem = dataclasses.replace(PROBLEM, friction=friction, load=st.Load())
    problem = with_values({"problem": problem}, {f"problem.{key}": value})["problem"]
    factor = st.Beta(alpha=2.0, beta=2.0, low=0.6, high=1.4)
    random = st.RandomInterface(strength=strength, between={name: factor})
    drawn = st.monte_carlo(
        problem, random, method=EXACT, samples=3, seed=SEED, pilot=False, **QUIET
    ).critical_stress.values
    rows = strength.sample(INTERFACE, samples=3, seed=SEED)
    profiles = random.profiles(INTERFACE, samples=3, seed=SEED)
    factors = [own[:, 0] for label, own in profiles.items() if label[0] == "b"]
    assert bool(factors) == (name != "strength")  # which the profiles hold times its factor
    for onset, by, row in zip(drawn, *factors or [[]], rows, strict=bool(factors)):
        scaled = with_values({"problem": problem}, {f"problem.{key}": by * value})["problem"]
        given = {"friction_coefficient": row} if pressed else row
        alone = st.onset(scaled, given, method=EXACT, **QUIET).critical_stress.item()
        assert onset == pytest.approx(alone, rel=1e-9)
    state = st.external.limit_state(problem, random, EXACT)
    onsets, (low, high) = state(2.5 * state.draws(0, 0, 60)), state.bounds
    assert low * (1.0 - 1e-9) <= onsets.min() < onsets.max() <= high * (1.0 + 1e-9)
    answer = st.design_stress(
        problem, random, probability=1e-3, method=LOCAL, sensitivities=False, **ASKED
    ) if key not in REPLACED["critical_slip"] else None  # fmt: skip
    assert answer is None or answer.lower_bound <= onsets.min() * (1.0 + 1e-9)


def test_what_a_result_holds_gives_its_numbers_again():
    """Kept and failing profiles as profiles, and onsets as peaks, of several random properties."""
    residual, initial = (
        st.RandomField(st.Beta(alpha=2.0, beta=2.0, low=low, high=high), SPECTRUM)
        for low, high in ((0.0, 2e5), (-2e4, 5e4))
    )
    random = st.RandomInterface(
        strength=FIELD, residual_strength=residual, initial_stress=initial
    )
    drawn = st.monte_carlo(PROBLEM, random, method=EXACT, samples=5, keep=random.names, **QUIET)
    answer = st.failure_probability(PROBLEM, random, 0.8e6, method=LOCAL, **ASKED)
    assert (answer.failing_profiles.critical_stress < 0.8e6).all()
    for result, method in ((drawn, EXACT), (answer.failing_profiles, LOCAL)):
        again = st.onset(PROBLEM, result[[*random.names]], method=method, **QUIET)
        np.testing.assert_array_equal(again.critical_stress, result.critical_stress)
    onsets = drawn.critical_stress
    labelled, plain = (inferred(FIELD, peaks).mean["mean"] for peaks in (onsets, onsets.values))
    assert labelled == plain


SHAPED = evaluated("members of a list", globals())
"""Each with the number of the group of strengths that are proportional."""


@pytest.mark.parametrize("order", [(), (3, 0, 5, 1, 4, 2)])
def test_a_sample_of_a_list_is_that_of_its_member_alone(order):
    """With the same draws for the same modes and factors, across two blocks of samples."""
    groups, members = zip(*SHAPED.values(), strict=True)
    mixture, count = EquallyLikely(members, order), 40
    assert mixture.groups.tolist() == [*groups]
    draws = mixture.draws(INTERFACE, count, SEED, 230)
    for chosen in (mixture.member(draws), np.arange(count) % 6):
        mixture.select(draws, np.arange(count), chosen)
        np.testing.assert_array_equal(mixture.member(draws), chosen)
        profiles = mixture.from_draws(INTERFACE, draws)
        for number, member in enumerate(members):
            rows = np.flatnonzero(chosen == number)
            alone = member.profiles(INTERFACE, samples=count, seed=SEED, first=230)
            assert rows.size
            assert {*alone} <= {*profiles}
            assert len(profiles) == 3  # the strength, and factors of slip and of pressure
            for name, values in profiles.items():
                expected = alone.get(name, np.ones_like(values))
                np.testing.assert_array_equal(values[rows], expected[rows])


NARROW = st.Beta(alpha=2.0, beta=3.0, low=0.6, high=0.6001)


@pytest.mark.parametrize("pressing", ["frictionless", "glued"])
@pytest.mark.parametrize("given", ["problem", "factor", "random"])
def test_means_and_bounds_of_a_property_are_those_of_its_stress(pressing, given):
    """Of friction coefficients that hardly vary, under a pressure that differs along x."""
    interface, load = st.Interface(0.05, 64), st.Load()
    if given != "random":
        pressure = 2e6 if pressing == "glued" else 2e6 + 1e6 * np.cos(60.0 * interface.x)
        load = st.Load(normal_pressure=pressure)
    blocks = st.Blocks(height=0.02, thickness=0.01, pressing=pressing)
    problem = st.Problem(SOLID, interface, FRICTION, load, specimen=blocks)
    field = st.RandomField(NARROW, SPECTRUM, quantity="friction_coefficient")
    more = {"normal_pressure": st.RandomField(st.Gamma(mean=3e6, cv=1e-5), SPECTRUM)}
    more = more if given == "random" else {}
    factor = {"normal_pressure": st.Gamma(mean=1.0, cv=1e-5)} if given == "factor" else None
    random = st.RandomInterface(strength=field, **more, between=factor)
    profiles = profiles_in_stress(problem, random, random.profiles(interface))
    for name in random.names:
        values, close = profiles[name], {"rel": 1e-3}
        assert mean_in_stress(problem, random, name) == pytest.approx(values.mean(), **close)
        ends = support_in_stress(problem, random, name, 1e-3)
        assert ends == pytest.approx((values.min(), values.max()), **close)


OTHER = dataclasses.replace(FIELD, marginal=st.Gamma(mean=9e5, cv=0.2))
MEASURED = xr.DataArray([0.9e6, 1.1e6], {"x": [0.01, 0.06]}, "x")
LONG, SHORT = (st.PowerLawSpectrum(length) for length in (0.4, 2e-4))
UNFIT: dict[str, Any] = {  # members of a list that a call refuses, or doubts
    "given beyond its end": FIELD.given(MEASURED, noise=1e4),
    "with anisotropy": dataclasses.replace(FIELD, anisotropy=2.0),
    "in another unit": dataclasses.replace(FIELD, marginal=st.Gamma(mean=1.0, cv=0.2)),
    "with a factor of what is not": st.RandomInterface(
        strength=FIELD, between={"residual_strength": st.Lognormal(mean=1.0, cv=0.1)}
    ),
    "short": dataclasses.replace(FIELD, spectrum=SHORT),
    "long": dataclasses.replace(FIELD, spectrum=LONG),
    "given": FIELD.given(MEASURED.assign_coords(x=[0.01, 0.03]), noise=1e4),
}
PLACES = [
    *((name, call) for name in ("short", "long") for call in QUICK),
    *((name, call) for name in [*UNFIT][:4] for call in OF_SOURCES),
    *((name, "infer") for name in ("with anisotropy", "given")),
]


@pytest.mark.parametrize(("name", "call"), PLACES)
def test_a_member_is_refused_and_doubted_at_any_place_of_a_list(name, call):
    """In the words for the member alone."""
    told = []
    for random in ([UNFIT[name]], [FIELD, OTHER, UNFIT[name]], [UNFIT[name], FIELD]):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            _, refusal = attempt(lambda given=random: CALLS[call](PROBLEM, given, LOCAL))
        told.append(refusal or {str(one.message) for one in caught})
    assert told[0] == told[1] == told[2]
    assert isinstance(told[0], str) or len(told[0]) == 2  # and the few nodes of the grid


@pytest.mark.parametrize("name", ["posterior", "tests alone"])
def test_the_error_of_a_posterior_is_the_root_of_peaks_over_samples(name):
    """Also of peaks of two lengths: six in all, and 100 samples of each length."""
    for kind in (name, f"{name.removesuffix(' alone')} of two lengths"):
        assert source_of(kind).monte_carlo_error == pytest.approx(np.sqrt(6 / 100), rel=1e-9)
        assert getattr(source_of(kind), "specimens", 6) == 6


def test_peaks_of_two_lengths_are_as_far_from_a_prediction_as_those_of_each():
    """Squares are added, and the largest deviation counts."""
    posterior, ask = source_of("posterior of two lengths"), st.statistics.agreement
    further = {length: 1.01 * peaks for length, peaks in LENGTHS.items()}
    both = ask(posterior, further, unit="Pa")
    each = [ask(posterior, {length: further[length]}, unit="Pa") for length in further]
    squares = sum(one.cramer_von_mises for one in each)
    deviation = max(one.largest_deviation for one in each)
    # With the same seed the draws of the posterior are the same.
    found = both.cramer_von_mises, both.largest_deviation
    assert found == pytest.approx((squares, deviation), rel=1e-9)


@pytest.mark.parametrize("name", ["posterior", "tests of two lengths", "profiles and tests"])
def test_a_draw_of_a_posterior_describes_the_interface_at_it(name):
    posterior = source_of(name)
    for draw in (0, 7):
        random = posterior.at(draw)[1]
        strength, factor = random.strength, (random.between or {}).get("strength")
        described = {
            "mean": strength.mean, "marginal.mean": strength.mean,
            "standard_deviation": strength.standard_deviation,
            "efolding_length": strength.spectrum.efolding_length,
            "between": factor and factor.distribution.std(),
        }  # fmt: skip
        drawn = {key: values[draw] for key, values in posterior.draws.items()}
        assert drawn == pytest.approx({key: described[key] for key in drawn}, rel=1e-6)


def test_fields_of_a_posterior_keep_the_shape_of_a_bounded_marginal():
    """Another mean scales the lower bound, too."""
    marginal = st.Lognormal(mean=1e6, cv=0.2, low=0.3e6)
    field = st.RandomField(marginal, st.PowerLawSpectrum(4e-3))
    given = {"between": "lognormal", "method": LOCAL, "samples": 100, "unit": "Pa"} | QUIET
    for peaks in (PEAKS, 0.8 * PEAKS):
        found = [
            m.strength.marginal for m in st.infer(PROBLEM, field, peaks, **given).interfaces(4)
        ]
        assert [m.low / m.mean for m in found] == pytest.approx([0.3] * len(found), rel=1e-9)


def test_designs_are_stresses_whatever_the_unit_of_the_peaks():
    """Of the same tests, as stresses and as coefficients under a pressure of 2 MPa."""
    found, given = [], {"between": "lognormal", "method": LOCAL, "samples": 100} | QUIET
    for scale, unit in ((1.0, "Pa"), (2e6, "1")):
        posterior = st.infer(PROBLEM, FIELD, PEAKS / scale, unit=unit, **given)
        few = {"designs": {"few": 2}, "repetitions": 10} | QUIET
        found.append(st.design_of_tests(PROBLEM, posterior, **few))
    for name in ("design_low", "design_stress", "design_high"):
        assert found[0][name].units == found[1][name].units == "Pa"
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-6)
    assert (found[0].design_low < found[0].design_high)[1]


@pytest.mark.parametrize("name", [n for n in SOURCES if " " in n or n == "posterior"])
def test_interfaces_of_a_source_depend_on_the_seed_alone(name):
    first, again, other = (source_of(name).interfaces(5, seed) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len({*first}) > 1


def test_records_of_one_specimen_count_by_their_length():
    """Of a long record and a short one with a lower mean, as all their points together."""
    long = st.Interface(0.3, 384)
    rows = FIELD.sample(long)[0], 0.8 * FIELD.sample(INTERFACE, seed=4)[0]
    records = [xr.DataArray(row, {"x": long.x[: row.size]}, "x") for row in rows]
    options = {"marginal": "gamma", "noise": False, "bootstrap": 20, "spectrum": "exponential"}
    one = st.fit_field(records, **options, **QUIET)
    known = one._with_levels([one.field])
    pooled, plain = np.concatenate(rows).mean(), np.mean([row.mean() for row in rows])
    assert abs(known.levels.item() - pooled) < 0.3 * abs(plain - pooled)
    assert known.within.item() < one._estimate.within.min()
    several = fit(True)
    (within,) = several._with_levels([several.field]).within
    np.testing.assert_allclose(within, several._estimate.within, rtol=1e-9)
