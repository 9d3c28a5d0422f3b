"""What moves a design, and constants of the problem that are uncertain."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from joint import GIVEN, PROBLEM, RANDOM
from refusals import refuses
from setups import LOCAL, ensemble

import stiction as st
from stiction.random.equally_likely import drawn_from

PRESSURE = "problem.load.normal_pressure"


def test_a_design_is_in_proportion_to_the_pressure():
    """Stated ends count, the others are 10 % off; common draws make the ratios exact."""
    families = (st.Lognormal, st.Weibull, st.TruncatedNormal)
    likely = [
        dataclasses.replace(RANDOM, between={"strength": kind(mean=1.0, cv=0.12)})
        for kind in families
    ]
    design = st.design_stress(
        PROBLEM, likely, probability=1e-2, mixture=True, sensitivities=True, **GIVEN
    )
    found = design.sensitivities.sel(source=PRESSURE)
    assert float(found.stress_at_low) == pytest.approx(0.9 * design.stress, rel=1e-6)
    assert float(found.force_at_high) == pytest.approx(1.1 * design.force, rel=1e-6)
    stated = {PRESSURE: (4e6, 8e6)}
    given = GIVEN | {"sensitivities": stated, "probability": 1e-2}
    wide = st.design_stress(PROBLEM, RANDOM, **given)
    ends = wide.sensitivities.sel(source=PRESSURE)
    assert float(ends.stress_at_high / ends.stress_at_low) == pytest.approx(2.0, rel=1e-6)
    assert wide.sensitivities.source.values[0] == PRESSURE  # the widest
    # The Weibull family has the heavier lower tail; the answer names both, and what it covers.
    by = {k: v for k, v in design.sensitivities.attrs.items() if k.startswith("stress by")}
    assert by["stress by weibull"] < design.stress < by["stress by lognormal"]
    assert "stress by normal" in by
    text = str(design)
    assert "the error of the computation only" in text
    assert "weibull to lognormal" in text
    assert st.plot.sensitivities(design).get_yticklabels()[-1].get_text()
    refuses(
        "sensitivities: problem.load.weight: is not a constant",
        lambda: st.design_stress(
            PROBLEM, RANDOM, **given | {"sensitivities": {"problem.load.weight": (1, 2)}}
        ),
    )
    plain = st.design_stress(PROBLEM, RANDOM, probability=1e-2, **GIVEN)
    refuses("has no sensitivities", lambda: st.plot.sensitivities(plain))


@pytest.mark.parametrize("several", [False, True], ids=["field", "list"])
def test_an_uncertain_pressure_is_one_more_factor(several):
    """The probability is an integral over pressure, factor and 5,000 onsets of the field."""
    law = scipy.stats.lognorm(0.15, scale=5e6)
    given = [RANDOM, RANDOM] if several else RANDOM
    source = st.uncertain(given, {PRESSURE: law})
    demand = 0.72e6
    found = st.failure_probability(PROBLEM, source, demand, seed=2, **GIVEN)
    inner = ensemble(PROBLEM, RANDOM.strength, 5000, method=GIVEN["method"])
    shares = (np.arange(200) + 0.5) / 200
    at = demand * 5e6 / law.ppf(shares)[:, None] / inner.critical_stress.values
    exact = RANDOM.between["strength"].distribution.cdf(at).mean()
    assert np.log(found.probability / exact) == pytest.approx(0.0, abs=4.0 * found.cv)
    assert len(source.constants(0)) == 40
    # Each failing profile has the pressure of its sample.
    assert np.all(found.failing_profiles.critical_stress < demand)


def test_a_coefficient_is_that_of_each_uncertain_pressure():
    """In proportion to the pressure, so that its scatter does not matter."""
    uncertain = st.uncertain(RANDOM, {PRESSURE: scipy.stats.lognorm(0.2, scale=5e6)})
    given = GIVEN | {"friction_coefficient": 0.12, "target_cv": 0.1}
    known = st.failure_probability(PROBLEM, RANDOM, **given)
    found = st.failure_probability(PROBLEM, uncertain, **given)
    error = 4.0 * np.hypot(known.cv, found.cv)
    assert np.log(found.probability / known.probability) == pytest.approx(0.0, abs=error)
    state = st.external.limit_state(PROBLEM, uncertain, GIVEN["method"])
    draws = state.draws(0, 0, 3)
    onset = st.onset(PROBLEM, {"strength": state.profiles(draws)["strength"]}, method=LOCAL)
    np.testing.assert_allclose(onset.critical_stress, state(draws), rtol=1e-9)


def test_a_study_has_uncertain_constants():
    table = {"count": 50, PRESSURE: [4e6, 6e6]}
    study = st.Study(
        problem=PROBLEM, random=RANDOM, method=GIVEN["method"], ensemble=st.Ensemble(samples=20),
        uncertain=table, reliability={"probability": 1e-2, "target_cv": 0.3},
    )  # fmt: skip
    (point,) = study.experiments
    design = study.reliability.answer(point)
    ends = design.sensitivities.sel(source=PRESSURE)
    assert [float(ends.low), float(ends.high)] == pytest.approx([4.1e6, 5.9e6])
    fixed = dataclasses.replace(study, uncertain=None)
    stress = study.run(progress=False, pilot=False).critical_stress
    own = fixed.run(progress=False, pilot=False).critical_stress
    ratio = (stress / own).values
    assert 0.8 < ratio.min() < 0.9
    assert 1.1 < ratio.max() < 1.2


def test_members_in_proportion_share_uncertain_values():
    """As 128 specimens are made of each solved one only where strengths are in proportion."""

    class Source:
        def interfaces(self, count, seed=0):
            cvs = np.array([0.12, 0.15, 0.2])[
                np.random.default_rng(seed).integers(3, size=count)
            ]
            marginals = [st.Gamma(mean=0.2 + 1e-5 * n, cv=cv) for n, cv in enumerate(cvs)]
            return [
                dataclasses.replace(
                    RANDOM, strength=dataclasses.replace(RANDOM.strength, marginal=marginal)
                )
                for marginal in marginals
            ]

    laws = {"strength.spectrum.correlation_length": (3e-3, 5e-3), PRESSURE: (4e6, 6e6)}
    random = drawn_from(st.uncertain(Source(), laws), 200, 0)
    forms = {}
    for number, (member, group) in enumerate(zip(random.members, random.groups, strict=True)):
        field, turn = member.strength, number % len(random.constants)
        form = field.marginal.cv, field.spectrum.correlation_length, turn
        assert forms.setdefault(group, form) == form
    assert 200 / 8 <= len(forms) <= 100
    moved = drawn_from(st.uncertain(Source(), {"strength.marginal.low": (0.0, 0.01)}), 200, 0)
    assert np.unique(moved.groups).size == 200
