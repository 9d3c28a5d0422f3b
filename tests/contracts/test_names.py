"""One key for each parameter: printed by fits and posteriors, accepted by priors and sweeps."""

import dataclasses
import re

import numpy as np
import pytest
from joint import FIELD, PROBLEM
from scipy.stats import loguniform, norm, truncnorm, uniform
from setups import LOCAL, make_problem

import stiction as st
from stiction.random.dotted_keys import full_key, short_key

KEYS = {  # the printed key, and all keys that are accepted
    "correlation_length": (
        "spectrum.correlation_length", "strength.spectrum.correlation_length",
        "random.strength.spectrum.correlation_length",
    ),
    "exponent": ("spectrum.exponent", "random.strength.spectrum.exponent"),
    "marginal.cv": ("strength.marginal.cv", "random.strength.marginal.cv"),
    "anisotropy": ("strength.anisotropy",),
    "residual_strength.spectrum.exponent": ("random.residual_strength.spectrum.exponent",),
    "problem.friction.residual_ratio": (),
}  # fmt: skip


@pytest.mark.parametrize("key", KEYS)
def test_every_way_to_name_a_parameter_is_printed_as_one_key(key):
    for name in (key, *KEYS[key]):
        assert short_key(name) == key
        assert full_key(name) == full_key(key)


@pytest.mark.parametrize(
    ("owner", "kind"), [("random", st.RandomInterface), ("random.strength", st.RandomField)]
)
def test_a_printed_key_leads_back_to_its_parameter(owner, kind):
    for field in dataclasses.fields(kind):
        key = f"{owner}.{field.name}.part"
        assert full_key(short_key(key)) == key


LOGNORMAL = st.Lognormal(mean=4e-3, cv=0.3)
WAYS = {  # to state the same prior
    "range": [(2e-3, 6e-3), [2e-3, 6e-3], {"low": 2e-3, "high": 6e-3}, uniform(2e-3, 4e-3)],
    "range of logarithms": [
        {"low": 2e-3, "high": 6e-3, "spacing": "log"}, loguniform(2e-3, 6e-3)],
    "marginal": [
        {"type": "lognormal", "mean": 4e-3, "cv": 0.3}, LOGNORMAL, LOGNORMAL.distribution],
}  # fmt: skip


@pytest.mark.parametrize("ways", WAYS.values(), ids=WAYS)
def test_a_prior_is_the_same_however_it_is_stated(ways):
    given = {"method": LOCAL, "samples": 100, "progress": False, "unit": "Pa"}
    means = [
        st.infer(PROBLEM, FIELD, [0.95e6, 1e6, 1.05e6], prior={"correlation_length": way}, **given)
        .mean["correlation_length"]
        for way in ways
    ]  # fmt: skip
    assert means == pytest.approx([means[0]] * len(ways), rel=1e-9)


def test_a_posterior_is_the_same_in_stresses_and_in_coefficients():
    """Of the strength and of the peaks, under a pressure or, of stresses, without."""
    pressed, free = (make_problem(load=st.Load(normal_pressure=p)) for p in (2e6, None))
    peaks, means = np.array([0.70e6, 0.72e6, 0.75e6]), []
    for problem, unit, quantity in (
        (free, "Pa", None), (pressed, "Pa", None), (pressed, "1", None),
        (pressed, "Pa", "friction_coefficient"), (pressed, "1", "friction_coefficient"),
    ):  # fmt: skip
        scale = 2e6 if quantity else 1.0
        marginal = st.Beta(alpha=1.5, beta=3.0, low=0.66e6 / scale, high=1.66e6 / scale)
        field = st.RandomField(marginal, st.PowerLawSpectrum(3e-3), quantity=quantity)
        posterior = st.infer(
            problem, field, peaks / (2e6 if unit == "1" else 1.0), unit=unit, method=LOCAL,
            prior={"marginal.low": (0.4e6 / scale, 0.9e6 / scale)}, samples=200, progress=False,
        )  # fmt: skip
        means.append(posterior.mean["marginal.low"] * scale)
    assert means == pytest.approx([means[0]] * 5, rel=1e-9)


def test_a_prior_of_scatter_holds_what_lies_between_its_limits():
    """A coefficient of variation is neither negative nor above 0.9."""
    given = {
        "method": LOCAL,
        "samples": 100,
        "progress": False,
        "unit": "Pa",
        "between": "normal",
    }
    means = [
        st.infer(PROBLEM, None, [0.95e6, 1e6, 1.05e6], prior={"between": way}, **given)
        .mean["between"]
        for way in (norm(0.1, 0.1), truncnorm(-1.0, 8.0, loc=0.1, scale=0.1))
    ]  # fmt: skip
    assert means[0] == pytest.approx(means[1], rel=1e-9)


@pytest.mark.parametrize("key", ["correlation_length", "marginal.cv"])
def test_a_key_is_accepted_by_every_call(key):
    ends = {"correlation_length": (3e-3, 5e-3), "marginal.cv": (0.1, 0.2)}[key]
    peaks = {"peaks": [0.95e6, 1e6, 1.05e6], "progress": False, "samples": 100}
    for name in (key, *KEYS[key]):
        posterior = st.infer(
            PROBLEM, FIELD, unit="Pa", prior={name: ends}, method=LOCAL, **peaks
        )
        assert posterior.names == (key,)
        study = st.Study(
            problem=PROBLEM, random=FIELD, method=LOCAL, samples=1, sweep=[{name: list(ends)}]
        )
        members = [point.random.members[0].strength for point in study.experiments]
        part, _, attribute = full_key(key).removeprefix("random.strength.").rpartition(".")
        assert [getattr(getattr(one, part), attribute) for one in members] == list(ends)


def refusal(call):
    """The text with which a call is refused."""
    with pytest.raises(st.InputError) as caught:
        call()
    return str(caught.value)


def table_of(count, folder):
    """A table with so many columns, any of which could be the strength."""
    heads = ";".join(["x (mm)", *(f"c{i} (MPa)" for i in range(count))])
    rows = [";".join(map(str, [k, *[1 + 0.1 * k] * count])) for k in range(9)]
    path = folder / "table.csv"
    path.write_text("\n".join([heads, *rows]))
    return path


def stated(count):
    """What is assumed of tests with so many stated fields."""
    marginals = (st.Gamma(mean=0.2 + 0.01 * i, cv=0.15) for i in range(count))
    fields = [dataclasses.replace(FIELD, marginal=marginal) for marginal in marginals]
    given = {"method": LOCAL, "samples": 100, "progress": False}
    return str(st.infer(PROBLEM, fields, [0.95e6, 1e6, 1.05e6], unit="Pa", **given).assumptions)


COUNTED = {  # a text about so many things, and what it says of each that it shows
    "stated fields": (lambda n, _: stated(n), "not measured: "),  # at most four
    "columns": (
        lambda n, folder: refusal(lambda: st.read_profile(table_of(n, folder))), r"column \d+ 'c"
    ),
    "mistakes": (
        lambda n, _: refusal(lambda: st.Solid(**{f"k{i}": 1 for i in range(n)})), "'k\\d+'"
    ),
}  # fmt: skip


COUNTS = [("stated fields", 2), *((name, n) for name in [*COUNTED][1:] for n in (2, 3, 60))]


@pytest.mark.parametrize(("name", "count"), COUNTS)
def test_a_text_counts_what_it_does_not_show(name, count, tmp_path):
    text, each = COUNTED[name]
    said = text(count, tmp_path)
    hidden = sum(map(int, re.findall(r"and (\d+) more", said)))
    shown = {*re.findall(each, said)}
    assert len(shown) + hidden == count, said


def test_a_fit_and_a_posterior_print_the_same_keys():
    records = [FIELD.sample(PROBLEM.interface, seed=seed)[0] for seed in range(3)]
    fit = st.fit_field(
        records, PROBLEM.interface, marginal="gamma", noise=False, bootstrap=20, between=True,
        quantity="friction_coefficient", progress=False,
    )  # fmt: skip
    posterior = st.infer(
        PROBLEM,
        fit,
        [0.95e6, 1e6, 1.05e6],
        unit="Pa",
        method=LOCAL,
        samples=100,
        progress=False,
    )
    assert {*posterior.names} <= {*fit.parameters}
    assert "correlation_length" in fit.parameters
    for name in posterior.names:
        low, high = posterior.interval[name]
        assert low <= posterior.mean[name] <= high
