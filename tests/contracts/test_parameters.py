"""Laws of the parameters of public calls: a parameter without another value here fails."""

from __future__ import annotations

import dataclasses
import inspect
import re
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
import xarray as xr
from contracts.bodies import BODIES, FIELD, attempt
from public import names_of
from recording import evaluated
from refusals import warning_texts
from stand_ins import StandIn

import stiction as st

pytestmark = pytest.mark.filterwarnings("ignore")
LINE, OTHER = BODIES["line"], BODIES["line with ends"]
LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
WEAKER = st.RandomField(st.Lognormal(mean=0.9e6, cv=0.2), st.PowerLawSpectrum(4e-3))
ROWS = FIELD.sample(LINE.interface, samples=2, seed=2)
SHORT = st.Interface(0.03, 128)
RECORDS = FIELD.sample(SHORT, samples=2, seed=3)
NOISY = RECORDS + 1e4 * np.random.default_rng(1).standard_normal(RECORDS.shape)
PEAKS = [5.9e5, 6.2e5, 6.6e5, 7.1e5]
PRIOR, SECOND = {"marginal.low": (5.6e5, 7.2e5)}, {"marginal.low": (5e5, 7.2e5)}
DRAWN = {"problem": LINE, "random": FIELD, "method": LOCAL}
ROWS_OF_ONSETS = st.monte_carlo(**DRAWN, samples=40, pilot=False, progress=False)
BASE: dict[str, dict[str, Any]] = evaluated("arguments of calls", globals())
"""Arguments of a cheap example of each public call."""
OTHERS: dict[str, Any] = evaluated("other arguments", globals())
"""Another value of a parameter, for all calls, or by call in BY_CALL."""
BY_CALL: dict[tuple[str, str], Any] = {
    ("equilibrium_path", "method"): st.Rupture(), ("equilibrium_path", "profiles"): 0.98 * ROWS[0],
    ("simulate_rupture", "method"): st.Rupture(loading_rate=3e9),
    ("simulate_rupture", "profiles"): 0.98 * ROWS[0], ("fit_field", "profiles"): 1.02 * NOISY,
    ("monte_carlo", "samples"): 41,
    ("infer", "between"): {"strength": st.Lognormal(mean=1.0, cv=0.1)},
    ("design_of_tests", "designs"): {"few": 6},
}  # fmt: skip
REPLACES = {"friction_coefficient": "stress", "force": "stress"}
"""Parameters that are given in place of another one."""
SILENT = {("design_of_tests", "probability"), ("design_stress", "confidence")}
"""Used for a fit or a posterior, and for counted specimens only, as their docstrings say."""
CALLABLE = [line.split("(")[0][3:] for line in names_of(st, "st.") if "(" in line]
ELSEWHERE = {
    "external.limit_state", "external.event_table", "external.write_scec",
    "theory.griffith_length", "theory.nucleation_statistics", "theory.nucleation_stress",
}  # fmt: skip
"""Calls with few parameters, see tests/contracts and tests/exact."""
READERS = {"read_profile", "read_peaks", "read_curve", "open_run"}
"""Calls that read files, see tests/user and tests/fuzz."""
WITHOUT_EFFECT = {"workers", "executor", "progress"}
"""Parameters that change no number."""


def call_of(name: str) -> Any:
    return attrgetter(name)(st)


PARAMETERS = [
    (call, name) for call in BASE for name in inspect.signature(call_of(call)).parameters
]


def ask(call: str, **changes: Any) -> Any:
    given = BASE[call] | changes
    if "progress" in inspect.signature(call_of(call)).parameters:
        given = {"progress": False} | given
    return call_of(call)(**{k: v for k, v in given.items() if v is not None})


@cache
def example(call: str) -> Any:
    return ask(call)


def numbers(result: Any) -> str:
    """All numbers of a result, as text of nine digits: round-off does not count."""
    if isinstance(result, xr.Dataset):
        pilot = {key: value for key, value in result.attrs.items() if key.startswith("pilot")}
        text = repr((result.drop_attrs().to_dict(), pilot))
    else:
        text = repr(result([8e5]) if callable(result) else result.to_dict())
    return re.sub(
        r"\d\.\d{9,}(e[-+]\d+)?|\d+\.\d+", lambda found: f"{float(found[0]):.9g}", text
    )


def test_every_public_call_has_an_example_and_every_parameter_another_value():
    elsewhere = ("plot.", "paper.", "extensions.")  # contracts of their own
    calls = {
        c for c in CALLABLE if inspect.isfunction(call_of(c)) and not c.startswith(elsewhere)
    }
    assert calls == BASE.keys() | READERS | ELSEWHERE
    names = {name for _, name in PARAMETERS}
    silent = {name for _, name in SILENT} - OTHERS.keys()
    assert names - WITHOUT_EFFECT - silent == OTHERS.keys() & names
    assert names >= WITHOUT_EFFECT | OTHERS.keys() - {"event"}


@pytest.mark.parametrize(
    ("call", "name"),
    [pair for pair in PARAMETERS if pair[1] not in WITHOUT_EFFECT and pair not in SILENT],
)
def test_each_parameter_counts_or_is_refused_by_its_name(call, name):
    changes = {name: BY_CALL.get((call, name), OTHERS[name])}
    if name in REPLACES:
        changes[REPLACES[name]] = None
    result, refusal = attempt(lambda: ask(call, **changes))
    if refusal:
        assert name in refusal
    else:
        assert numbers(result) != numbers(example(call)), f"{name} has no effect"


LATER = evaluated("parameters that are looked at after others", globals())


@pytest.mark.parametrize("call", [c for c in CALLABLE if not c.startswith("extensions.")])
def test_objects_of_no_kind_are_refused_by_the_names_of_their_parameters(call):
    names = [*inspect.signature(call_of(call)).parameters]
    _, refusal = attempt(lambda: call_of(call)(**dict.fromkeys(names, object())))
    unnamed = [name for name in names if not re.search(rf"\b{name}: ", refusal)]
    assert unnamed == LATER.get(call, [])


@pytest.mark.parametrize("call", BASE)
def test_arguments_in_the_wrong_place_are_refused_by_their_names(call):
    """Each two that follow each other; and a method by its name is led to its class."""
    parameters = inspect.signature(call_of(call)).parameters.values()
    names = [
        p.name for p in parameters if p.kind is not p.KEYWORD_ONLY and p.name in BASE[call]
    ]
    for first, second in pairwise(names):
        given = {first: BASE[call][second], second: BASE[call][first]}
        _, refusal = attempt(lambda given=given: ask(call, **given))
        assert f"{first}: " in refusal or f"{second}: " in refusal or f"{second}=" in refusal
        assert (first, second) != ("random", "peaks") or "peaks=" in refusal
    if "method" in BASE[call]:
        _, refusal = attempt(lambda: ask(call, method="equilibrium"))
        assert "Write st.Equilibrium(" in refusal or "must be a Rupture" in refusal


@pytest.mark.parametrize(
    "call", [call for call, name in PARAMETERS if name in ("workers", "executor")]
)
def test_workers_change_no_number(call):
    names = inspect.signature(call_of(call)).parameters
    algorithms = ["plain", "subset", "two_level"] if "algorithm" in names else [None]
    for algorithm in algorithms:
        given = {"algorithm": algorithm} | (
            {"method": EXACT} if algorithm == "two_level" else {}
        )
        assert numbers(ask(call, workers=2, **given)) == numbers(ask(call, workers=1, **given))
    if "executor" in names:
        with ThreadPoolExecutor(2) as executor:
            assert numbers(ask(call, executor=executor)) == numbers(ask(call))


@pytest.mark.parametrize("call", [call for call, name in PARAMETERS if name == "progress"])
def test_progress_rises_to_its_total_and_changes_no_number(call):
    seen: list[tuple[int, int]] = []
    result = ask(call, progress=lambda done, total: seen.append((done, total)))
    assert numbers(result) == numbers(example(call))
    assert seen
    for done, total in seen:
        assert 0 <= done <= (total or done)  # a total of 0 is not known
    assert seen[-1][0] == (seen[-1][1] or seen[-1][0])


def test_samples_of_an_ensemble_are_drawn_alone():
    whole = ask("monte_carlo", samples=6, seed=5).critical_stress[4:]
    alone = ask("onset", profiles=FIELD.sample(LINE.interface, samples=2, seed=5, first=4))
    np.testing.assert_array_equal(whole, alone.critical_stress)


def test_a_pilot_compares_the_samples_of_its_run():
    """With the exact onsets of the same samples."""
    part = {"samples": 6, "seed": 5}
    told = ask("monte_carlo", **part | {"pilot": True}).attrs
    local, exact = (
        ask("monte_carlo", method=method, **part).critical_stress.values
        for method in (LOCAL, EXACT)
    )
    relative = (local - exact) / exact.mean()
    assert told["pilot_samples"] == 6
    assert told["pilot_bias"] == pytest.approx(relative.mean(), rel=1e-9)
    assert told["pilot_scatter"] == pytest.approx(relative.std(ddof=1), rel=1e-9)


NO_AREA = dataclasses.replace(LINE.interface, width=None)
BARE = dataclasses.replace(LINE, interface=NO_AREA, load=st.Load())


def test_a_design_that_is_cut_short_lies_between_its_bound_and_its_lowest_sample():
    """Without an area and a pressure, there is neither a force nor a coefficient."""
    design = ask("design_stress", problem=BARE, probability=1e-9, max_evaluations=150)
    assert design.interval == {"stress": (design.lower_bound, design.stress)}
    assert design.lower_bound < design.stress < ask("design_stress", problem=BARE).stress


SOLVED = [0]


def counted(rows: Any, stress: Any) -> Any:
    """Onsets by the local criterion. It counts the samples."""
    SOLVED[0] += rows.samples
    return stress


SCATTERED = st.RandomInterface(
    strength=FIELD, between={"strength": st.Lognormal(mean=1.0, cv=0.1)}
)


class Growing:
    """A source of interfaces that differ so much that calls draw more of them than at first."""

    def interfaces(self, count: int, seed: int = 0) -> list[Any]:
        means = np.random.default_rng(seed).normal(9e5, 1e4, count)
        marginals = [st.Lognormal(mean=mean, cv=0.1) for mean in means]
        return [st.RandomField(marginal, FIELD.spectrum) for marginal in marginals]


@pytest.fixture(autouse=True)
def few_members(monkeypatch):
    """Lists of 10 members at first."""
    monkeypatch.setattr("stiction.random.equally_likely.FIRST_MEMBERS", 10)


@pytest.mark.parametrize(
    "random",
    [FIELD, [FIELD, WEAKER], [FIELD, WEAKER] * 51, SCATTERED, Growing()],
    ids=["field", "list", "long list", "factor", "source"],
)
@pytest.mark.parametrize("call", ["auto", "plain", "subset", "design_stress", "failure_curve"])
@pytest.mark.parametrize(
    ("most", "cv", "stress", "chance"), [(20_000, 0.1, 7.3e5, 0.1), (10_000, 0.3, 6.8e5, 1e-5)]
)
def test_evaluations_are_the_samples_that_were_solved(random, call, most, cv, stress, chance):
    """Also if an algorithm follows a count, or more interfaces are drawn.

    Checks of the method solve less than 100 besides, and the guide ranks the interfaces of a list.
    """
    asked = {"failure_curve": {"smallest": chance}}
    asked["design_stress"] = {"probability": chance, "sensitivities": False}
    name = call if call in asked else "failure_probability"
    given = asked.get(call, {"stress": stress, "algorithm": call}) | {"target_cv": cv}
    guide = "local_criterion" if isinstance(random, list | Growing) else None
    method = StandIn(counted, first_stage=guide, scaling="affine")
    given |= {"method": method, "random": random, "problem": BARE, "workers": 1}
    SOLVED[0] = 0
    answer = ask(name, max_evaluations=most, **given)
    assert 0 <= SOLVED[0] - answer.evaluations < 100
    assert answer.evaluations <= most
    if name == "failure_probability" and answer.probability:
        assert (answer.failing_profiles.critical_stress < stress).all()


LONG = st.RandomField(st.Lognormal(mean=2e6, cv=0.3), st.PowerLawSpectrum(0.02), True)
PRESSED = st.RandomInterface(strength=WEAKER, normal_pressure=LONG)
CHECKED = [  # calls at a probability of 0.08
    ("critical_stress", {"algorithm": "plain"}), ("critical_stress", {"algorithm": "subset"}),
    ("critical_stress", {"random": Growing(), "target_cv": 0.1}),
    ("friction_coefficient", {"random": PRESSED}),
    ("design_stress", {"probability": 0.08}), ("failure_curve", {"smallest": 0.08}),
]  # fmt: skip


@pytest.mark.parametrize("factor", [0.9, 1.0])
@pytest.mark.parametrize(("call", "given"), CHECKED)
def test_a_check_by_the_exact_method_counts_failures_near_the_stress(call, given, factor):
    """Half of the checked samples fail by the method. A difference is told once."""
    asked = {"problem": BARE, "random": WEAKER} | given
    if call not in BASE:
        drawn = ask("monte_carlo", samples=300, problem=BARE, random=asked["random"])[call]
        name = call.removeprefix("critical_")
        asked |= {"stress": None, name: factor * float(drawn.quantile(0.08))}
        call = "failure_probability"
    method = StandIn(lambda rows, stress: factor * stress, exact_method="local_criterion")
    texts = warning_texts(lambda: ask(call, method=method, workers=1, **asked))
    found = [re.findall(r"\d[\d.e-]*(?<!\.)", text) for text in texts if "in the tail" in text]
    assert len(found) == (factor < 1.0)
    for checked, failed, exactly, there, told in np.array(found, dtype=float):
        assert abs(failed - 0.5 * checked) <= 2.0 * checked**0.5  # four standard errors
        assert exactly < failed
        assert there == pytest.approx(told * max(exactly, 1.0) / failed, rel=0.1)


@pytest.mark.parametrize("scale", [0.0, 0.8])
def test_a_guide_that_misses_failures_is_doubted(scale):
    """Failures rest on the strength at one node, if the scale is not zero, and not on the guide."""

    def onset(rows: Any, stress: Any) -> Any:
        return stress + scale * (rows.strength.reshape(rows.samples, -1)[:, 5] - 8.5e5)

    answer = ask(
        "failure_probability", method=StandIn(onset, first_stage="local_criterion"),
        stress=5.5e5, algorithm="two_level", max_evaluations=500, workers=1,
    )  # fmt: skip
    doubts = [text for text in answer.warnings if "local criterion misses" in text]
    assert len(doubts) == (scale > 0.0)


def test_two_levels_answer_for_the_method_and_not_for_its_guide():
    """The method is 3 % weaker than its guide, so its probability is that of a higher stress."""
    weaker = StandIn(lambda rows, stress: 0.97 * stress, first_stage="local_criterion")
    two, same, guide = (
        ask("failure_probability", method=method, stress=stress, algorithm=algorithm,
            target_cv=0.1, max_evaluations=None, workers=1)
        for method, stress, algorithm in (
            (weaker, 0.97 * 5.7e5, "two_level"), (LOCAL, 5.7e5, "subset"),
            (LOCAL, 0.97 * 5.7e5, "subset"),
        )
    )  # fmt: skip
    errors = 4.0 * np.hypot(two.cv, same.cv)
    assert abs(np.log(two.probability / same.probability)) < errors
    assert np.log(two.probability / guide.probability) > errors


def test_the_budget_that_a_doubt_names_reaches_the_target():
    """Of plain samples, whose coefficient of variation falls as the root of their number."""
    given = {"stress": 5.8e5, "algorithm": "plain", "target_cv": 0.05, "workers": 1}
    few = ask("failure_probability", max_evaluations=200, **given)
    (named,) = re.findall(r"raise max_evaluations to about ([\d.e+]+)", " ".join(few.warnings))
    enough = ask("failure_probability", max_evaluations=int(float(named)), **given)
    assert few.cv > 0.1
    assert 0.03 < enough.cv < 0.055


@pytest.mark.parametrize("marginal", [FIELD.marginal, st.Lognormal(mean=1e6, cv=0.2)])
@pytest.mark.parametrize(("stress", "certain"), [(1e3, 0.0), (1e8, 1.0)])
def test_a_demand_far_from_all_onsets_is_certain_to_be_met_or_not(marginal, stress, certain):
    """Whether the strength has bounds or not."""
    field = st.RandomField(marginal, st.PowerLawSpectrum(4e-3))
    given = {"method": LOCAL, "progress": False}
    answer = st.failure_probability(LINE, field, stress=stress, **given)
    low, high = answer.interval["probability"]
    assert answer.probability == certain
    assert low <= certain <= high
    assert high - low < 1e-6
