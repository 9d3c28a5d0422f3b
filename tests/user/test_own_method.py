"""Classes of somebody else that do not do as their members promise."""

import numpy as np
import pytest
import scipy.stats
from refusals import refuses
from setups import beta_strength, make_problem
from stand_ins import StandIn

import stiction as st
from stiction import extensions
from stiction.base.variables import Variable
from stiction.inference.prior import find_scaling, make_prior
from stiction.methods.protocol import optional_member
from stiction.problem.results import onset_variables


class Broken:
    """A method whose solver does not keep what its variables promise."""

    type, label = "broken", "broken"

    def __init__(self, change, promise=()):
        self.change, self.promise = change, promise

    def variables(self, problem):
        return onset_variables(problem.interface) | dict(self.promise)

    def seconds_per_sample(self, problem):
        return 1e-6

    def supports(self, problem):
        return []

    def prepare(self, problem):
        names = onset_variables(problem.interface)
        return lambda sample: {name: np.ones(sample.samples) for name in names} | self.change


MARGIN = {"margin": Variable("Pa", "margin")}
BROKEN = {
    "broken must return ... , margin, but returned": Broken({}, MARGIN),
    "broken must return ... , but returned ... , margin": Broken({"margin": np.ones(3)}),
    "'critical_load' of shape (3,) over (sample), got (2,)": Broken({"critical_load": [1.0, 1.0]}),
}  # fmt: skip


@pytest.mark.parametrize("words", BROKEN)
def test_a_solver_that_breaks_its_promise_is_refused(words):
    strength = 1e6 + np.arange(256.0) * np.ones((3, 1))
    problem = st.paper.problem(nodes=256)
    refuses(words, lambda: st.onset(problem, strength, method=BROKEN[words]))


@pytest.mark.parametrize("seconds", [np.nan, -1.0, "fast"])
def test_a_time_that_is_none_is_refused(seconds):
    problem, method = st.paper.problem(nodes=256), StandIn(None, seconds=seconds)
    strength = st.paper.strength(problem, correlation_ratio=2.0)
    words = "method: seconds_per_sample of stand-in must return a number of seconds"
    refuses(words, lambda: st.onset(problem, np.full((3, 256), 1e6), method=method))
    refuses(words, lambda: st.failure_probability(problem, strength, 0.7e6, method=method))


class Described(Broken):
    """A method whose author says how its onsets follow the strength."""

    scaling = "affine"

    def __init__(self):
        super().__init__({})

    def bounded_by_strength(self, problem, event):
        return True, event == "critical_stress"


@pytest.mark.parametrize("method", [Broken({}), Described()])
def test_bounds_and_scaling_hold_only_if_a_method_says_so(method):
    problem, strength = make_problem(256), beta_strength(7e-3)
    described = isinstance(method, Described)
    bounds = st.external.limit_state(problem, strength, method).bounds
    assert np.allclose(bounds, (0.66e6, 1.66e6) if described else (-np.inf, np.inf))
    prior = make_prior(problem, strength, {"marginal.low": (0.5e6, 0.7e6)})
    assert len(find_scaling(prior, method, "critical_stress").keys) == described
    assert optional_member(method, "counted_only") is False


def test_an_onset_at_minus_infinity_is_refused():
    problem, strength = make_problem(256), beta_strength(7e-3)
    given = {"probability": 0.1, "progress": False, "max_evaluations": 100}

    def design(value):
        method = StandIn(lambda rows, _: np.full(rows.samples, value))
        return st.design_stress(problem, strength, method=method, **given)

    refuses("stand-in returned an onset at minus infinity", lambda: design(-np.inf))
    never = design(np.nan)
    assert never.interval["stress"][1] == never.stress == np.inf
    assert "No stress has this probability" in str(never)
    assert never.warnings


class Negative(st.PowerLawSpectrum):
    def density(self, wavenumber, dimensions=1):
        return np.where(wavenumber < 100.0, -1.0, 1.0)


def field_of(distribution):
    members = {"type": "from_scipy", "distribution": property(lambda _: distribution)}
    marginal = type("FromScipy", (extensions.Marginal,), members)()
    return st.RandomField(marginal, st.PowerLawSpectrum(correlation_length=2e-3))


def test_a_class_whose_members_return_the_wrong_thing_is_refused():
    problem = st.paper.problem(nodes=256)
    uniform, spectrum = scipy.stats.uniform(1e6, 1e6), Negative(correlation_length=2e-3)
    unlisted = Broken({})
    unlisted.supports = lambda problem: "it does not take lines"
    words = "supports must return a list of reasons, got 'it does"
    refuses(words, lambda: st.onset(problem, np.full(256, 1e6), method=unlisted))
    refuses("from_scipy: its distribution must be frozen", lambda: field_of(scipy.stats.norm))
    outside = scipy.stats.triang(2.0, 1e6, 1e6)
    refuses("must have a finite mean ... got nan", lambda: field_of(outside))
    field = st.RandomField(uniform, spectrum)
    words = "positive and finite ... smallest value of -1"
    refuses(words, lambda: field.sample(problem.interface))
