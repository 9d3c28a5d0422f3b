"""Which method takes which law, what it says if not, laws in files, and laws of one's own."""

from __future__ import annotations

import dataclasses
import json
import warnings
from typing import NamedTuple

import numpy as np
import pytest
from refusals import refuses

import stiction as st
from stiction.friction import FrictionLaw, register
from stiction.model import model

EXPONENTIAL = st.ExponentialWeakening(weakening_rate=0.5e12)
DUAL = st.PiecewiseWeakening(slip=[0.05, 1.0], strength=[0.8, 0.0], weakening_rate=0.5e12)
STEEPENING = st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=0.25e12)
RUPTURE = st.Rupture(loading_rate=2e8, kernel_tolerance=1e-4)


@pytest.fixture
def problem(solid):
    """17 nucleation lengths of 30 nodes."""
    interface = st.Interface(length=0.05, nodes=512)
    return st.Problem(solid, interface, st.LinearWeakening(weakening_rate=0.5e12))


@pytest.fixture
def with_law(problem):
    return lambda law: dataclasses.replace(problem, friction=law)


@pytest.fixture
def tau_p(problem, make_strength):
    return make_strength(0.25).sample(problem.interface, samples=1, seed=1)


@pytest.fixture
def rough(tau_p):
    """So wide a range that weak nodes pass corners before the first instability."""
    return 0.1e6 + 3.0 * (tau_p - tau_p.min())


def test_no_law_is_taken_for_another(with_law, rough):
    """By equilibrium; what ruptures make of each law is in tests/properties."""
    base, *others = (
        st.onset(with_law(law), rough, method=st.Equilibrium()).critical_stress.item()
        for law in (st.LinearWeakening(weakening_rate=0.5e12), DUAL, STEEPENING)
    )
    assert all(abs(other / base - 1.0) > 1e-3 for other in others)


def refusals(with_law, tau_p, field):
    """What a refusal names, and the call."""
    local, exact = st.LocalCriterion(), st.Equilibrium()
    exponential, steep = with_law(EXPONENTIAL), with_law(STEEPENING)
    pieces = "ExponentialWeakening has none ... from_law ... Rupt"
    tail = {"method": exact, "algorithm": "two_level"}
    return [
        (pieces, lambda: st.onset(exponential, tau_p, method=exact)),
        (pieces, lambda: st.equilibrium_path(exponential, tau_p, [0.6e6])),
        ("up to 2.33 times as steeply", lambda: st.onset(steep, tau_p, method=local)),
        ("up to 2.33 times as steeply", lambda: st.theory.nucleation_stress(steep, tau_p)),
        ("strength does not fall linearly",
         lambda: st.failure_probability(with_law(DUAL), field, 0.7e6, **tail)),
        ("pieces: must be a whole number >= 2, got 1",
         lambda: st.PiecewiseWeakening.from_law(EXPONENTIAL, 1)),
        ("law: must be a FrictionLaw, got",
         lambda: st.PiecewiseWeakening.from_law("exponential", 4)),
        ("friction: must be a friction law such as ... got 0.2", lambda: with_law(0.2)),
    ]  # fmt: skip


def test_what_a_law_does_not_allow_is_refused(with_law, tau_p, make_strength):
    for words, call in refusals(with_law, tau_p, make_strength(1.0)):
        refuses(words, call)


@pytest.mark.parametrize("law", [EXPONENTIAL, DUAL])
@pytest.mark.filterwarnings("default::stiction.AccuracyWarning")
def test_local_criterion_speaks_of_other_laws(with_law, tau_p, law):
    problem = with_law(law)
    for call in (
        lambda: st.onset(problem, tau_p, method=st.LocalCriterion()),
        lambda: st.theory.nucleation_stress(problem, tau_p),
    ):
        with pytest.warns(st.AccuracyWarning, match="weakening rate at zero slip"):
            call()


def test_steepening_has_no_certificate_and_no_false_alarm(with_law, rough):
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.AccuracyWarning)
        found = st.onset(with_law(STEEPENING), rough, method=st.Equilibrium())
    assert np.isnan(found.certificate_gap.item())


def test_sensitivity_along_a_polygon(with_law, rough):
    """d first_instability / d tau_p at fixed weakening rates against a difference."""
    problem, strength = with_law(DUAL), rough[0]
    method = st.Equilibrium(sensitivity=True, slip=True)
    found = st.onset(problem, strength, method=method).isel(sample=0)
    corner = 0.05 * DUAL.critical_slip_of(strength, 0.5e12)
    beyond = int(np.argmax(found.slip.values / corner))
    assert found.slip.values[beyond] > corner[beyond]  # on its second piece
    weakest = int(np.argmax(found.sensitivity.values))
    for node in (beyond, weakest):
        step = np.zeros_like(strength)
        step[node] = 10.0
        up, down = (
            st.onset(problem, strength + sign * step, method=method).first_instability.item()
            for sign in (1.0, -1.0)
        )
        # Round-off of 1e-9 Pa in 20 Pa; second differences cancel.
        assert (up - down) / 20.0 == pytest.approx(found.sensitivity.values[node], abs=1e-7)


@pytest.mark.parametrize("law", [EXPONENTIAL, DUAL])
def test_law_in_a_study_file(tmp_path, with_law, make_strength, law):
    study = st.Study(
        problem=with_law(law), random=make_strength(1.0), method=RUPTURE,
        ensemble=st.Ensemble(samples=2, seed=1),
    )  # fmt: skip
    path = tmp_path / "study.toml"
    study.to_toml(path)
    assert f'type = "{law.type}"' in path.read_text()
    assert st.Study.from_toml(path) == study
    path.write_text(path.read_text().replace(f'"{law.type}"', '"exponentail"'))
    words = "friction ... exponentail ... exponential ... piecewise"
    refuses(words, lambda: st.Study.from_toml(path))


def parameters_of(shape, slope=1.0):
    """Parameters of a type of their own, for which f and its slope are registered."""

    class Parameters(NamedTuple):
        initial_slope: float = slope

    register(Parameters, shape)
    return Parameters()


@model
class OwnLaw(FrictionLaw):
    """Exponential weakening, as somebody else would write it."""

    parameters = parameters_of(lambda law, u: (np.exp(-u), np.exp(-u)))

    def area(self, u):
        return 1.0 - np.exp(-np.asarray(u))

    def slip_at(self, fraction):
        return -np.log(fraction) if fraction > 0.0 else np.inf


@pytest.mark.slow  # its functions are compiled anew
def test_law_of_ones_own(with_law, tau_p):
    own = with_law(OwnLaw(weakening_rate=0.5e12))
    found, expected = (
        st.onset(problem, tau_p, method=RUPTURE) for problem in (own, with_law(EXPONENTIAL))
    )
    assert found.critical_stress.item() == pytest.approx(
        expected.critical_stress.item(), rel=1e-12
    )
    method = dataclasses.replace(RUPTURE, stop="onset")
    run = st.simulate_rupture(own, tau_p, method=method, save=st.Save([]))
    assert "a law of your own" in run.attrs["study_incomplete"]
    with pytest.raises(st.InputError, match="OwnLaw has none"):
        st.onset(own, tau_p, method=st.Equilibrium())
    polygon = st.PiecewiseWeakening.from_law(own.friction, 32)
    assert polygon == st.PiecewiseWeakening.from_law(EXPONENTIAL, 32)


def test_law_without_a_compiled_strength_is_refused(with_law, tau_p):
    @model
    class Sketch(OwnLaw):
        parameters = ()

    for method in (st.Equilibrium(), RUPTURE):
        with pytest.raises(st.InputError, match="Sketch"):
            st.onset(with_law(Sketch(weakening_rate=0.5e12)), tau_p, method=method)
    with pytest.raises(TypeError, match=r"abstract.*slip_at"):
        FrictionLaw(weakening_rate=0.5e12)


class ShapelessParameters(NamedTuple):
    scale: float = 1.0


def _plateau(u):
    """Falls to a half, rests, and falls three times as steeply to zero at u = 1."""
    if u < 0.5:
        return 1.0 - u, 1.0
    if u < 5.0 / 6.0:
        return 0.5, 0.0
    return (3.0 * (1.0 - u), 3.0) if u < 1.0 else (0.0, 0.0)


register(ShapelessParameters, lambda law, u: _plateau(u))


@model
class Plateau(FrictionLaw):
    parameters = parameters_of(lambda law, u: _plateau(u))

    def area(self, u):
        u = np.minimum(np.asarray(u, dtype=float), 1.0)
        first, last = np.minimum(u, 0.5), np.maximum(u - 5.0 / 6.0, 0.0)
        return first - first**2 / 2 + 0.5 * (u - first) - 1.5 * last**2

    def slip_at(self, fraction):
        return 1.0 - fraction if fraction >= 0.5 else 1.0 - fraction / 3.0


@model
class Instant(Plateau):
    """Its inverse says that the residual strength is there at once."""

    def slip_at(self, fraction):
        return fraction


@model
class Shorter(Plateau):
    def slip_at(self, fraction):
        return 0.9 * Plateau.slip_at(self, fraction)


@model
class Shapeless(Plateau):
    parameters = ShapelessParameters()


def test_a_plateau_is_followed_and_its_later_slope_counts(with_law, tau_p):
    law = Plateau(weakening_rate=0.5e12)
    assert law.steepest_slope == 3.0
    polygon = st.PiecewiseWeakening.from_law(law, 32)
    assert (
        st.onset(with_law(polygon), tau_p, method=st.Equilibrium()).critical_stress.item() > 0.0
    )
    refuses(
        "up to 3 times as steeply",
        lambda: st.onset(with_law(law), tau_p, method=st.LocalCriterion()),
    )
    refuses(
        "strength: must fall at every corner ... got (0.5, 0.5, 0.0); give a plateau a small fall",
        lambda: st.PiecewiseWeakening(
            slip=[0.5, 0.8, 1.0], strength=[0.5, 0.5, 0.0], critical_slip=1e-6
        ),
    )


@model
class Hump(OwnLaw):
    """Rises by a tenth before it falls: no method of the package can follow it."""

    parameters = parameters_of(
        lambda law, u: (np.interp(u, [0.0, 0.2, 1.0], [1.0, 1.1, 0.0]), 1.0)
    )

    def slip_at(self, fraction):
        return 1.0 - 0.8 * fraction / 1.1


@model
class Late(OwnLaw):
    parameters = parameters_of(lambda law, u: (0.5 * np.exp(-u), 0.5 * np.exp(-u)))


@model
class Steeper(OwnLaw):
    """Its slope is not that of its f."""

    parameters = parameters_of(lambda law, u: (np.exp(-u), 2.0 * np.exp(-u)), slope=2.0)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (Hump, "Hump: strength must not rise with slip, as beyond u = 0"),
        (Late, "Late: f(0) must be 1, got 0.5"),
        (Instant, "Instant: slip_at(0), or ... must be positive and finite, got 0"),
        (Shorter, "Shorter: f(slip_at(0)) is 0, but 0.3 by its f"),
        (Shapeless, "Shapeless: its parameters need a field initial_slope"),
        (Steeper, "Steeper: initial_slope is 2, but 1 by its f ... Steeper: -f'(0.568) is"),
    ],
)
def test_a_law_that_contradicts_itself_is_refused(with_law, law, words):
    refuses(f"friction: ... {words}", lambda: with_law(law(weakening_rate=0.5e12)))
    refuses(words, lambda: st.PiecewiseWeakening.from_law(law(weakening_rate=0.5e12), 32))


def test_schema_asks_for_the_type_of_laws_and_marginals():
    from stiction.study.study import study_schema

    definitions = study_schema()["$defs"]
    linear, *others = definitions["Problem"]["properties"]["friction"]["anyOf"]
    assert "LinearWeakening" in json.dumps(linear)
    assert len(others) == 2
    assert all(other["allOf"][1] == {"required": ["type"]} for other in others)
    assert "FrictionLaw" not in definitions
    marginals = definitions["RandomField"]["properties"]["marginal"]["anyOf"]
    assert all("type" in one["required"] for one in marginals)
