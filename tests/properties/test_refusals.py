"""Whatever is no value of a field is refused by its name, and what is next to its border is taken.

Of numbers between borders, whole numbers, choices and flags; of objects in Python and in a study,
and of arguments of public functions.
"""

import dataclasses
import math
import re
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some
from setups import LOCAL, SOLID, beta_strength, make_problem
from small_study import small_study

import stiction as st

PROBLEM, FIELD = make_problem(), beta_strength(4e-3)
ANY, SHARE, FLAG = "(0, inf)", "(0, 1]", "flag"
SIZE, LENGTH = "(-1e18, 1e18)", "(1e-15, 1e15)"
MOMENTS = {"mean": "(1e-18, 1e18)", "cv": "(1e-9, inf)", "low": SIZE}
FIELDS = {  # an object, where it stands in a study, and what its fields may hold
    SOLID: ("problem.solid", {
        "shear_modulus": ANY, "poisson_ratio": "(-1, 0.5)", "density": ANY,
        "plane": ("strain", "stress"),
    }),
    st.Interface(0.1, 128, width=0.01): ("problem.interface", {
        "width": ANY, "ends": ("periodic", "free"), "length": ANY, "nodes": "[8, 16777216]",
    }),
    st.EdgeLoad(excess=0.3, decay=0.02, edge=0.1): ("problem.load.profile", {
        "excess": "[0, inf)", "decay": ANY, "edge": "[0, 1)",
    }),
    st.GradientLoad(amplitude=0.2, centre=0.3): ("problem.load.profile", {
        "amplitude": "[0, 1)", "centre": "[0, 1)",
    }),
    st.Load(pressing_force=4e3): ("", {"pressing_force": ANY}),
    st.Load(normal_pressure=2e6): ("", {"normal_pressure": ANY, "profile": ANY}),
    st.LinearWeakening(weakening_rate=2e11): ("", {
        "weakening_rate": ANY, "residual_strength": "[0, inf)",
    }),
    st.ExponentialWeakening(critical_slip=2e-6, residual_ratio=0.2): ("", {
        "critical_slip": ANY, "residual_ratio": "[0, 1)",
    }),
    st.PiecewiseWeakening(slip=(0.4, 1.0), strength=(0.3, 0.0), fracture_energy=2.0): ("", {
        "fracture_energy": ANY,
    }),
    st.Platen(stiffness=1e7): ("", {"stiffness": "[0, inf]", "mass": "[0, inf)"}),
    st.Pusher(height=0.01, width=0.004, stiffness=1e7): ("", {
        "height": ANY, "width": ANY, "side": ("left", "right", "both"), "stiffness": "[0, inf]",
    }),
    st.Blocks(height=0.05, thickness=0.01): ("", {
        "height": ANY, "thickness": ANY, "pressing": ("frictionless", "glued"),
        "quality_factor": "[0.01, inf]",
    }),
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6): ("random.strength.marginal", {
        "alpha": ANY, "beta": ANY, "low": SIZE, "high": SIZE,
    }),
    **{
        family(mean=1e6, cv=0.2, low=1e5): ("random.strength.marginal", MOMENTS)
        for family in (st.Lognormal, st.Weibull, st.Gamma, st.TruncatedNormal)
    },
    st.PowerLawSpectrum(4e-3, exponent=3.0, truncation=2.5): ("random.strength.spectrum", {
        "correlation_length": LENGTH, "exponent": "[0.6, 64]", "truncation": LENGTH,
    }),
    st.ExponentialSpectrum(4e-3, power_kept=0.9): ("random.strength.spectrum", {
        "correlation_length": LENGTH, "power_kept": "(1e-6, 1)",
    }),
    st.SquaredExponentialSpectrum(4e-3, truncation=2.5): ("random.strength.spectrum", {
        "correlation_length": LENGTH, "truncation": LENGTH,
    }),
    dataclasses.replace(FIELD, anisotropy=1.2): ("random.strength", {
        "mean_mode": FLAG, "anisotropy": ANY,
    }),
    st.Equilibrium(events=2, gap=1e-5): ("method", {
        "sensitivity": FLAG, "slip": FLAG, "events": "[0, 1000000]", "gap": "[1e-10, 1e-2]",
    }),
    st.Rupture(loading_rate=1e8): ("method", {
        "loading_rate": ANY, "end_time": ANY, "kernel_tolerance": ANY, "courant": SHARE,
        "slip_step": SHARE, "load_step": SHARE, "implicit": FLAG, "arrival": SHARE,
        "start": ("equilibrium", "rest"), "stop": ("sliding", "onset", "rest", "time"),
        "max_steps": "[1, 1000000000]",
    }),
    st.Save(every=7): ("save", {"every": "[1, 1000000]"}),
    st.Ensemble(samples=9, seed=2, first=3): ("ensemble", {
        "samples": "[1, 10000000000]", "seed": "[0, 1000000]", "first": "[0, 4611686018427387904]",
    }),
}  # fmt: skip
WHOLE = ("nodes", "events", "samples", "seed", "first", "every", "max_steps", "workers")
WHOLE += ("max_evaluations", "bootstrap")
OPTIONAL = ("width", "thickness", "truncation", "power_kept", "anisotropy", "end_time")
OPTIONAL += ("loading_rate", "workers", "max_evaluations", "pressing_force")
PROFILES = ("normal_pressure", "profile", "weakening_rate", "residual_strength")
PROFILES += ("critical_slip", "residual_ratio", "fracture_energy")
OPTIONAL += PROFILES
CALLS = {
    partial(st.monte_carlo, PROBLEM, FIELD, method=LOCAL, samples=1): {
        "samples": "[1, 9]", "seed": "[0, 9]", "first": "[0, 9]", "workers": "[1, 2]",
        "pilot": FLAG,
    },
    partial(st.failure_probability, PROBLEM, FIELD, 8e5, method=LOCAL): {
        "target_cv": "(0, 1)", "seed": "[0, 9]", "max_evaluations": "[1, 2]",
        "algorithm": ("auto", "plain", "subset", "two_level"),
    },
    partial(st.failure_curve, PROBLEM, FIELD, method=LOCAL): {"smallest": "(0, 1)"},
    partial(st.design_stress, PROBLEM, FIELD, method=LOCAL, probability=0.1): {
        "probability": "(0, 1)",
    },
    partial(FIELD.sample, PROBLEM.interface): {
        "samples": "[0, 9]", "seed": "[0, 9]", "first": "[0, 9]",
    },
    partial(st.fit_field, np.ones(64), PROBLEM.interface): {
        "bootstrap": "[0, 9]", "seed": "[0, 9]",
    },
}  # fmt: skip
OTHERS = ("1.5", "", None, True, False, [], {}, [1.0], 1j, math.nan, math.inf, -math.inf)
SEVERAL = settings(
    max_examples=100, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)


def borders(interval):
    low, high = interval[1:-1].split(", ")
    return float(low), float(high), interval[0] == "[", interval[-1] == "]"


def no_value(name, valid):
    """Values that a field does not take."""
    taken = [None] * (name in OPTIONAL) + [math.inf] * (valid[-4:] == "inf]")
    others = [one for one in OTHERS if not any(one is other for other in taken)]
    if name in PROFILES:  # of a single node
        others.remove([1.0])
    if valid == FLAG:
        return some.sampled_from([0, 1, 1.0, np.ones(1), *others[:2], *others[5:]])
    if isinstance(valid, tuple):
        wrong = some.text(max_size=9).filter(lambda text: text not in valid)
        return wrong | some.sampled_from([valid[0].upper(), f" {valid[0]}", *others[1:]])
    low, high, with_low, with_high = borders(valid)
    found = [some.sampled_from(others)]
    if name in WHOLE:
        found += [some.integers(max_value=int(low) - 1)]
        found += [some.floats(low, min(high, 1e9)).filter(lambda x: x % 1)]
    else:
        found += [some.floats(max_value=low, exclude_max=with_low)]
        if high < math.inf:
            found += [some.floats(min_value=high, exclude_min=with_high)]
    return some.one_of(found)


def at_the_border(name, valid):
    """Values that a field just takes, on both sides."""
    low, high, with_low, with_high = borders(valid)
    if name in WHOLE:
        return [int(low), float(low), int(low) + 2, np.int32(low)]
    return [
        low if with_low else np.nextafter(low, 1.0) if low else 1e-9,
        high if with_high else np.nextafter(min(high, 1e9), 0.0),
    ]


def beyond_the_border(name, valid):
    """Values that a field just does not take."""
    low, high, with_low, with_high = borders(valid)
    if name in WHOLE:
        return [int(low) - 1, int(low) + 0.5]
    below = np.nextafter(low, -np.inf) if with_low else low
    above = np.nextafter(high, np.inf) if with_high else high
    return [below, *([above] if not (with_high and high == np.inf) else [])]


ROWS = [
    (one, key, name, valid)
    for one, (key, fields) in FIELDS.items()
    for name, valid in fields.items()
]
CALLED = [(call, name, valid) for call, names in CALLS.items() for name, valid in names.items()]


def named(problems, name):
    return [
        text
        for text in problems
        if re.match(rf"(\w+\.)*{name}\b|(\w+Weakening|Load): {name} must", text)
    ]


@SEVERAL
@given(data=some.data())
def test_what_is_no_value_of_a_field_is_refused_by_its_name(data):
    one, _, name, valid = data.draw(some.sampled_from(ROWS))
    wrong = data.draw(no_value(name, valid))
    with pytest.raises(st.InputError) as caught:
        dataclasses.replace(one, **{name: wrong})
    assert named(caught.value.problems, name), (wrong, str(caught.value))


@SEVERAL
@given(data=some.data())
def test_what_is_no_value_of_an_argument_is_refused_by_its_name(data):
    call, name, valid = data.draw(some.sampled_from(CALLED))
    wrong = data.draw(no_value(name, valid))
    with pytest.raises(st.InputError) as caught:
        call(**{name: wrong})
    assert named(caught.value.problems, name), (wrong, str(caught.value))


@SEVERAL
@given(data=some.data())
def test_all_that_is_wrong_in_a_study_is_listed_by_its_keys(data):
    """Of several tables, and several keys of one."""
    study, wanted = small_study(), set()
    placed = {key: (one, fields) for one, (key, fields) in FIELDS.items() if key}
    for key in data.draw(
        some.lists(some.sampled_from(sorted(placed)), min_size=2, unique=True)
    ):
        one, fields = placed[key]
        *above, last = key.split(".")
        table = study
        for step in above:
            table = table.setdefault(step, {})
        table[last] = plain = {
            name: value
            for name, value in vars(one).items()
            if isinstance(value, str | int | float)
        } | ({k: v for k, v in table.get(last, {}).items() if isinstance(v, dict)})
        for name in data.draw(
            some.lists(some.sampled_from(sorted(fields)), min_size=1, max_size=2, unique=True)
        ):
            wrong = no_value(name, fields[name]).filter(lambda x: isinstance(x, str | float))
            plain[name] = data.draw(wrong)
            wanted.add(f"{key}.{name}")
    with pytest.raises(st.InputError) as caught:
        st.Study.from_dict(study)
    said = str(caught.value)
    for key in wanted:
        assert key in said, (study, said)


@pytest.mark.parametrize(("one", "name", "valid"), [(a, c, d) for a, _, c, d in ROWS])
@pytest.mark.filterwarnings("ignore")
def test_what_is_next_to_a_border_is_taken_within_and_refused_beyond(one, name, valid):
    """But where it contradicts another field: then the message is of both."""
    taken = valid if isinstance(valid, tuple) else (True, np.False_) if valid == FLAG else None
    for value in taken or at_the_border(name, valid):
        refused = []
        try:
            assert getattr(dataclasses.replace(one, **{name: value}), name) == value
        except st.InputError as error:
            refused = named(error.problems, name)
        assert not refused
    if taken is None:
        for value in beyond_the_border(name, valid):
            with pytest.raises(st.InputError, match=name):
                dataclasses.replace(one, **{name: value})
