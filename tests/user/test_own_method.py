"""Classes of somebody else that do not do as their members promise."""

import dataclasses

import numpy as np
import pytest
import scipy.stats  # noqa: F401  # own_methods.json calls it
from recording import refusals
from setups import beta_strength, make_problem
from stand_ins import StandIn

import stiction as st
from stiction import extensions
from stiction.base.variables import Variable
from stiction.inference.prior import find_scaling, make_prior
from stiction.methods.protocol import optional_member
from stiction.problem.results import onset_variables


@dataclasses.dataclass
class Broken:
    """A method whose solver does not keep what its variables promise."""

    change: dict
    promise: dict = dataclasses.field(default_factory=dict)
    unfit: list | str = dataclasses.field(default_factory=list)
    type = label = "broken"

    def variables(self, problem):
        return onset_variables(problem.interface) | self.promise

    def seconds_per_sample(self, problem):
        return 1e-6

    def supports(self, problem):
        return self.unfit

    def prepare(self, problem):
        names = onset_variables(problem.interface)
        return lambda sample: {name: np.ones(sample.samples) for name in names} | self.change


PROBLEM, FIELD = make_problem(), beta_strength(7e-3)
MARGIN = {"margin": Variable("Pa", "margin")}


class Negative(st.PowerLawSpectrum):
    def density(self, wavenumber, dimensions=1):
        return np.where(wavenumber < 100.0, -1.0, 1.0)


def field_of(distribution, spectrum=FIELD.spectrum):
    members = {"type": "from_scipy", "distribution": property(lambda _: distribution)}
    return st.RandomField(type("FromScipy", (extensions.Marginal,), members)(), spectrum)


def onset(method):
    return st.onset(PROBLEM, 1e6 + np.arange(256.0) * np.ones((3, 1)), method=method)


def chance(method):
    return st.failure_probability(PROBLEM, FIELD, 0.7e6, method=method)


def design(value):
    method = StandIn(lambda rows, _: np.full(rows.samples, value))
    given = {"probability": 0.1, "progress": False, "max_evaluations": 100}
    return st.design_stress(PROBLEM, FIELD, method=method, **given)


test_a_member_that_returns_the_wrong_thing_is_refused = refusals("own_methods", globals())


class Described(Broken):
    """A method whose author says how its onsets follow the strength."""

    scaling = "affine"

    def __init__(self):
        super().__init__({})

    def bounded_by_strength(self, problem, event):
        return True, event == "critical_stress"


@pytest.mark.parametrize("method", [Broken({}), Described()])
def test_bounds_and_scaling_hold_only_if_a_method_says_so(method):
    described = isinstance(method, Described)
    bounds = st.external.limit_state(PROBLEM, FIELD, method).bounds
    assert np.allclose(bounds, (0.66e6, 1.66e6) if described else (-np.inf, np.inf))
    prior = make_prior(PROBLEM, FIELD, {"marginal.low": (0.5e6, 0.7e6)})
    assert len(find_scaling(prior, method, "critical_stress").keys) == described
    assert optional_member(method, "counted_only") is False


def test_no_onset_is_an_onset_at_any_stress():
    never = design(np.nan)
    assert never.interval["stress"][1] == never.stress == np.inf
    assert "No stress has this probability" in str(never)
    assert never.warnings
