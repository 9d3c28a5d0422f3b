"""Which method takes which law, what it says if not, laws in files, and laws of one's own."""

import dataclasses
import warnings

import numpy as np
import pytest
from refusals import refuses
from setups import LENGTH, beta_strength, make_problem

import stiction as st

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


def onset(law, strength, method):
    return st.onset(with_law(law), strength, method=method)


def test_steepening_has_no_certificate_and_no_false_alarm():
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.AccuracyWarning)
        found = onset(STEEPENING, ROUGH, st.Equilibrium())
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
            onset(DUAL, ROUGH + sign * step, st.Equilibrium()).first_instability.item()
            for sign in (1.0, -1.0)
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
