"""Which method takes which law, what it says if not, laws in files, and laws of one's own."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

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


def test_equilibrium_refuses_what_has_no_pieces(with_law, tau_p):
    problem = with_law(EXPONENTIAL)
    for call in (
        lambda: st.onset(problem, tau_p, method=st.Equilibrium()),
        lambda: st.equilibrium_path(problem, tau_p, [0.6e6]),
    ):
        with pytest.raises(
            st.InputError, match=r"ExponentialWeakening has none.*from_law.*Rupt"
        ):
            call()


def test_local_criterion_speaks_of_other_laws(with_law, tau_p):
    for law in (EXPONENTIAL, DUAL):
        with pytest.warns(st.AccuracyWarning, match="weakening rate at zero slip"):
            st.onset(with_law(law), tau_p, method=st.LocalCriterion())
        with pytest.warns(st.AccuracyWarning, match="weakening rate at zero slip"):
            st.theory.nucleation_stress(with_law(law), tau_p)
    for call in (
        lambda problem: st.onset(problem, tau_p, method=st.LocalCriterion()),
        lambda problem: st.theory.nucleation_stress(problem, tau_p),
    ):
        with pytest.raises(st.InputError, match=r"up to 2.33 times as steeply"):
            call(with_law(STEEPENING))


def test_reliability_by_the_local_criterion_needs_the_linear_law(with_law, make_strength):
    with pytest.raises(st.InputError, match="strength does not fall linearly"):
        st.failure_probability(
            with_law(DUAL), make_strength(1.0), 0.7e6, method=st.Equilibrium(),
            algorithm="two_level",
        )  # fmt: skip


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


def test_law_in_a_study_file(tmp_path, problem, make_strength):
    for law in (EXPONENTIAL, DUAL):
        study = st.Study(
            problem=dataclasses.replace(problem, friction=law),
            random=make_strength(1.0), method=RUPTURE, ensemble=st.Ensemble(samples=2, seed=1),
        )  # fmt: skip
        study.to_toml(tmp_path / "study.toml")
        assert f'type = "{law.type}"' in (tmp_path / "study.toml").read_text()
        assert st.Study.from_toml(tmp_path / "study.toml") == study


def test_law_that_is_misspelt(tmp_path, problem, make_strength):
    study = st.Study(
        problem=dataclasses.replace(problem, friction=EXPONENTIAL),
        random=make_strength(1.0), method=RUPTURE, ensemble=st.Ensemble(samples=2, seed=1),
    )  # fmt: skip
    study.to_toml(tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text().replace('"exponential"', '"exponentail"')
    (tmp_path / "wrong.toml").write_text(text)
    with pytest.raises(st.InputError, match=r"friction.*exponentail.*exponential.*piecewise"):
        st.Study.from_toml(tmp_path / "wrong.toml")


def test_polygon_along_a_law_says_what_is_wrong():
    with pytest.raises(st.InputError, match="pieces: must be a whole number >= 2, got 1"):
        st.PiecewiseWeakening.from_law(EXPONENTIAL, 1)
    with pytest.raises(st.InputError, match=r"law: must be a FrictionLaw, got"):
        st.PiecewiseWeakening.from_law("exponential", 4)


def test_residual_ratio_and_fracture_energy_are_taken(problem, tau_p):
    for law in (
        st.LinearWeakening(fracture_energy=1.0),
        st.LinearWeakening(weakening_rate=0.5e12, residual_ratio=0.3),
    ):
        found = st.onset(
            dataclasses.replace(problem, friction=law), tau_p, method=st.Equilibrium()
        )
        assert found.critical_stress.item() > tau_p.min()


def test_checkpoint_of_another_law_is_refused(tmp_path, with_law, tau_p):
    method = dataclasses.replace(RUPTURE, stop="onset")
    options = {"method": method, "save": st.Save([], to=tmp_path / "run")}
    st.simulate_rupture(with_law(DUAL), tau_p, **options)
    with pytest.raises(st.InputError, match="another run"):
        st.simulate_rupture(with_law(STEEPENING), tau_p, **options)


class OwnParameters(NamedTuple):
    initial_slope: float = 1.0


register(OwnParameters, lambda law, u: (np.exp(-u), np.exp(-u)))


@model
class OwnLaw(FrictionLaw):
    """Exponential weakening, as somebody else would write it."""

    def area(self, u):
        return 1.0 - np.exp(-np.asarray(u))

    def slip_at(self, fraction):
        return -np.log(fraction) if fraction > 0.0 else np.inf

    @property
    def parameters(self):
        return OwnParameters()


@pytest.mark.slow  # its functions are compiled anew
def test_law_of_ones_own(with_law, tau_p):
    own = with_law(OwnLaw(weakening_rate=0.5e12))
    found, expected = (
        st.onset(problem, tau_p, method=RUPTURE) for problem in (own, with_law(EXPONENTIAL))
    )
    assert found.critical_stress.item() == pytest.approx(
        expected.critical_stress.item(), rel=1e-12
    )
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


class HumpParameters(NamedTuple):
    initial_slope: float = 1.0


class LateParameters(NamedTuple):
    initial_slope: float = 1.0


class SteeperParameters(NamedTuple):
    initial_slope: float = 2.0


register(HumpParameters, lambda law, u: (np.interp(u, [0.0, 0.2, 1.0], [1.0, 1.1, 0.0]), 1.0))
register(LateParameters, lambda law, u: (0.5 * np.exp(-u), 0.5 * np.exp(-u)))
register(SteeperParameters, lambda law, u: (np.exp(-u), 2.0 * np.exp(-u)))


@model
class Hump(OwnLaw):
    """Rises by a tenth before it falls: no method of the package can follow it."""

    parameters = HumpParameters()

    def slip_at(self, fraction):
        return 1.0 - 0.8 * fraction / 1.1


@model
class Late(OwnLaw):
    parameters = LateParameters()


@model
class Steeper(OwnLaw):
    """Its slope is not that of its f."""

    parameters = SteeperParameters()


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (Hump, "friction: Hump: strength must not rise with slip, as beyond u = 0"),
        (Late, r"friction: Late: f\(0\) must be 1, got 0.5"),
        (Steeper, r"Steeper: initial_slope is 2, but 1 by its f"),
        (Steeper, r"Steeper: -f'\(0.568\) is"),
    ],
)
def test_a_law_that_contradicts_itself_is_refused(with_law, law, words):
    with pytest.raises(st.InputError, match=words):
        with_law(law(weakening_rate=0.5e12))
    with pytest.raises(st.InputError, match=words.replace("friction", "law", 1)):
        st.PiecewiseWeakening.from_law(law(weakening_rate=0.5e12), 32)


def test_what_is_no_law_is_refused(problem):
    with pytest.raises(
        st.InputError, match=r"friction: must be a friction law such as .*got 0.2"
    ):
        dataclasses.replace(problem, friction=0.2)


def test_schema_asks_for_the_type_of_a_law():
    from stiction.study.study import study_schema

    definitions = study_schema()["$defs"]
    linear, *others = definitions["Problem"]["properties"]["friction"]["anyOf"]
    assert "LinearWeakening" in json.dumps(linear)
    assert len(others) == 2
    assert all(other["allOf"][1] == {"required": ["type"]} for other in others)
    assert "FrictionLaw" not in definitions


def test_example(capsys):
    path = Path(__file__).parents[2] / "examples" / "friction_laws.py"
    spec = importlib.util.spec_from_file_location("friction_laws_example", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(nodes=256)
    assert "exponential" in capsys.readouterr().out
