"""Which method takes which law, what it says if not, laws in files, and laws of one's own."""

import dataclasses
import warnings
from collections import namedtuple

import numpy as np
import pytest
from refusals import refuses
from setups import LENGTH, beta_strength, make_problem

import stiction as st
from stiction.base.model import model
from stiction.problem.friction import FrictionLaw

LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
EXPONENTIAL = st.ExponentialWeakening(weakening_rate=0.5e12)
DUAL = st.PiecewiseWeakening(slip=[0.05, 1.0], strength=[0.8, 0.0], weakening_rate=0.5e12)
STEEPENING = st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=0.25e12)
RUPTURE = st.Rupture(loading_rate=2e8, kernel_tolerance=1e-4)


def with_law(law):
    """17 nucleation lengths of 30 nodes."""
    return make_problem(512, 0.05, friction=law)


LINE = with_law(EXPONENTIAL).interface
TAU_P = beta_strength(0.25 * LENGTH, truncation=2.5).sample(LINE, samples=1, seed=1)
FIELD = beta_strength(LENGTH, truncation=2.5)
ROUGH = 0.1e6 + 3.0 * (TAU_P - TAU_P.min())
"""So wide a range that weak nodes pass corners before the first instability."""


def onset(law, strength=TAU_P, method=EXACT):
    return st.onset(with_law(law), strength, method=method)


@pytest.mark.parametrize("law", [EXPONENTIAL, DUAL])
@pytest.mark.filterwarnings("default::stiction.AccuracyWarning")
def test_local_criterion_speaks_of_other_laws(law):
    with pytest.warns(st.AccuracyWarning, match="weakening rate at zero slip") as found:
        onset(law, method=LOCAL)
    # Its error was measured for the exponential law only.
    assert ("at most 3 %" in str(found[0].message)) is (law is EXPONENTIAL)
    with pytest.warns(st.AccuracyWarning, match="weakening rate at zero slip"):
        st.theory.nucleation_stress(with_law(law), TAU_P)


def test_steepening_has_no_certificate_and_no_false_alarm():
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.AccuracyWarning)
        found = onset(STEEPENING, ROUGH)
    assert np.isnan(found.certificate_gap.item())


def test_sensitivity_along_a_polygon():
    """d first_instability / d tau_p at fixed weakening rates against a difference."""
    found = onset(DUAL, ROUGH, st.Equilibrium(sensitivity=True, slip=True)).isel(sample=0)
    corner = 0.05 * DUAL.critical_slip_of(ROUGH[0], 0.5e12)
    beyond = int(np.argmax(found.slip.values / corner))
    assert found.slip.values[beyond] > corner[beyond]  # on its second piece
    weakest = int(np.argmax(found.sensitivity.values))
    for node in (beyond, weakest):
        step = 10.0 * (np.arange(512) == node)
        up, down = (
            onset(DUAL, ROUGH + sign * step).first_instability.item() for sign in (1.0, -1.0)
        )
        # Round-off of 1e-9 Pa in 20 Pa; second differences cancel.
        assert (up - down) / 20.0 == pytest.approx(found.sensitivity.values[node], abs=1e-7)


@pytest.mark.parametrize("law", [EXPONENTIAL, DUAL])
def test_law_in_a_study_file(tmp_path, law):
    study = st.Study(
        problem=with_law(law), random=FIELD, method=RUPTURE,
        ensemble=st.Ensemble(samples=2, seed=1),
    )  # fmt: skip
    path = tmp_path / "study.toml"
    study.to_toml(path)
    assert f'type = "{law.type}"' in path.read_text()
    assert st.Study.from_toml(path) == study
    path.write_text(path.read_text().replace(f'"{law.type}"', '"exponentail"'))
    words = "friction ... exponentail ... exponential ... piecewise"
    refuses(words, lambda: st.Study.from_toml(path))


def own_law(shape, slip_at, area=np.asarray, slope=1.0, name="initial_slope"):
    """A law as somebody else would write it: f and its slope, its inverse and its integral."""

    fields = namedtuple("Fields", [name], defaults=[slope])
    parameters_type = type("Parameters", (fields,), {"f": shape, "__slots__": ()})

    @model
    class Own(FrictionLaw):
        parameters = parameters_type()

        def area(self, u):
            return area(np.asarray(u, dtype=float))

        def slip_at(self, fraction):
            return slip_at(fraction)

    return Own(weakening_rate=0.5e12)


def plateau(law, u):
    """Falls to a half, rests, and falls three times as steeply to zero at u = 1."""
    if u < 0.5:
        return 1.0 - u, 1.0
    if u < 5.0 / 6.0:
        return 0.5, 0.0
    return (3.0 * (1.0 - u), 3.0) if u < 1.0 else (0.0, 0.0)


def plateau_area(u):
    u = np.minimum(u, 1.0)
    first, last = np.minimum(u, 0.5), np.maximum(u - 5.0 / 6.0, 0.0)
    return first - first**2 / 2 + 0.5 * (u - first) - 1.5 * last**2


def plateau_slip(fraction):
    return 1.0 - fraction if fraction >= 0.5 else 1.0 - fraction / 3.0


def test_a_plateau_is_followed_and_its_later_slope_counts():
    law = own_law(plateau, plateau_slip, plateau_area)
    assert law.steepest_slope == 3.0
    assert onset(st.PiecewiseWeakening.from_law(law, 32)).critical_stress.item() > 0.0
    refuses("up to 3 times as steeply", lambda: onset(law, method=LOCAL))


def test_the_nucleation_length_is_that_of_the_steepest_slope():
    """A law that hardly falls at first is not one of an interface that slides as a whole."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.UnitWarning)
        law = st.PiecewiseWeakening(
            slip=[0.5, 1.0], strength=[0.99, 0.0], weakening_rate=0.005e12
        )
        late = make_problem(512, 0.05, friction=law)
    first = dataclasses.replace(late, friction=st.LinearWeakening(weakening_rate=0.5e12))
    # 1.98 against 0.02: a nucleation length of 99 times the first slope's.
    length = first.nucleation_length * 0.5e12 / (99.0 * 0.005e12)
    assert late.nucleation_length == pytest.approx(length, rel=1e-12)
    nodes = late.nodes_in_nucleation_length(0.005e12)
    assert nodes == pytest.approx([length / late.interface.spacing], rel=1e-12)
