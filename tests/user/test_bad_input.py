"""What a mistake or a doubt is about beside its words, which tests/records hold."""

import dataclasses
import pickle
import warnings

import numpy as np
import pytest
from recording import stored
from setups import EXACT, LOCAL, beta_strength, make_problem

import stiction as st
from stiction.methods.equilibrium.solver import follow_to_sliding
from stiction.problem import checks

PROBLEM, FIELD = make_problem(), beta_strength(2e-3)
ONE = np.full(256, 1e6)


def test_a_refusal_is_short_pickles_and_is_a_value_error():
    with pytest.raises(ValueError, match="workers") as caught:
        st.monte_carlo(PROBLEM, FIELD, method=LOCAL, samples=1, workers="x" * 10_000)
    assert len(str(caught.value)) < 200
    error = st.InputError(["a", "b"])
    assert pickle.loads(pickle.dumps(error)).problems == ("a", "b")


def test_errors_of_equilibrium_are_warned_of():
    no, stress = np.zeros(2, dtype=bool), np.full(2, 1e6)
    values = {"residual_reached": no, "certificate_gap": np.array([1e-6, np.nan])}
    values |= {"first_instability": stress, "critical_stress": stress}
    rows = PROBLEM.sample(np.full((2, PROBLEM.interface.size), 1e6))
    with pytest.warns(st.AccuracyWarning, match="to within 1e-09 of the load in 1 of 2"):
        EXACT.prepare(PROBLEM)._warn(rows, values, np.stack([no, ~no, no], axis=-1))


def test_a_path_whose_end_is_not_known_is_said(monkeypatch):
    def lost(*given, **options):
        return follow_to_sliding(*given, **options)._replace(known=False)

    monkeypatch.setattr("stiction.methods.equilibrium.path.follow_to_sliding", lost)
    with pytest.warns(st.AccuracyWarning, match="no equilibrium was found beyond 900000 Pa"):
        st.equilibrium_path(PROBLEM, 0.9 * ONE, [1e5, 2e6])
    with warnings.catch_warnings(action="error"):
        st.equilibrium_path(PROBLEM, 0.9 * ONE, [1e5])


def test_objects_are_frozen_compare_and_hash_by_value():
    a, b = (dataclasses.replace(PROBLEM, load=st.Load(profile=np.ones(256))) for _ in range(2))
    assert a == b
    assert hash(a) == hash(b)
    assert a != PROBLEM
    for each in (a, FIELD):
        assert pickle.loads(pickle.dumps(each)) == each
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.mode = "III"
    with pytest.raises(ValueError, match="read-only"):
        a.load.profile[0] = 2.0


IN_MPA = make_problem(load=st.Load(initial_stress=0.1))
DOUBTFUL = stored("cases")["doubtful calls"]


@pytest.mark.parametrize("doubt", DOUBTFUL)
def test_a_warning_stands_where_the_caller_is_and_once(doubt):
    call = compile(DOUBTFUL[doubt], __file__, "eval")
    with pytest.warns((st.UnitWarning, st.AccuracyWarning)) as caught:
        eval(call)
    assert {warning.filename for warning in caught} == {__file__}
    assert len(caught) == len({str(warning.message) for warning in caught})


STUDIED = stored("studied")
"""Solid, weakening rate, length and strength of what people study."""


@pytest.mark.parametrize("what", STUDIED)
def test_what_people_study_raises_no_doubt(what):
    solid, friction, length, strength = STUDIED[what]
    h_n = 2 * 0.5789 * solid[0] / (1 - solid[1]) / friction
    interface = st.Interface(length, max(64, 2 * int(4 * length / h_n)))
    with warnings.catch_warnings(action="error", category=st.UnitWarning):
        law, load = st.LinearWeakening(friction), st.Load(initial_stress=1e-4 * strength)
        system = st.Problem(st.Solid(*solid), interface, law, load)
        checks.doubt_strengths(system, strength)
    if strength > 1e-4 * solid[0] > 1e4:  # kPa that were given as MPa, on no rubber
        with pytest.warns(st.UnitWarning, match="times the shear modulus"):
            checks.doubt_strengths(system, 1e3 * strength)


def test_a_model_of_others_may_hold_plain_dataclasses():
    """A key that such a dataclass does not have stands beside the other mistakes."""

    @dataclasses.dataclass
    class Plain:
        p: float

    @st.extensions.model
    class Owner:
        plain: Plain
        either: st.Solid | Plain | None = None

    with pytest.raises(st.InputError) as refusal:
        Owner({"p": "x", "q": 3}, {"r": 1.0})
    problems = refusal.value.problems
    assert "Owner.plain: unknown 'q'" in problems
    assert "Owner.either: unknown 'r'" in problems
    assert any(text.startswith("Owner.plain.p: must be a valid number") for text in problems)
