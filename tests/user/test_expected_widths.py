"""`st.design_of_tests` of a fit and of a posterior: widths that further tests will leave."""

import numpy as np
import pytest
from setups import LOCAL, make_problem

import stiction as st
from stiction.inference.specimens import Prediction

PROBLEM = make_problem(64, 0.05, weakening_rate=0.25e12)
FIELD = st.RandomField(st.Gamma(mean=1e6, cv=0.15), st.PowerLawSpectrum(4e-3), mean_mode=True)
GIVEN = {"method": LOCAL, "progress": False}
FEW = GIVEN | {"samples": 100, "between": "lognormal"}


def test_intervals_become_narrower_as_the_root_of_the_tests():
    factors = np.exp(0.1 * np.random.default_rng(2).standard_normal(8))
    onsets = st.monte_carlo(PROBLEM, FIELD, samples=8, pilot=False, **GIVEN)
    peaks = onsets.critical_stress.values * factors
    posterior = st.infer(PROBLEM, FIELD, peaks, unit="Pa", **FEW)
    designs = {"many": 56}
    found = st.design_of_tests(PROBLEM, posterior, designs=designs, repetitions=12, **GIVEN)
    assert found.design.values.tolist() == ["now", "many"]
    for name in ("mean", "between"):
        now, many = found.width.sel(parameter=name).values
        assert now == pytest.approx(np.ptp(posterior.interval[name]), rel=0.1)
        # Eight times as many tests: a third of the width, less where eight leave heavy tails.
        assert 0.15 * now < many < 0.5 * now
    assert found.design_low[1] < found.design_stress[1] < found.design_high[1]
    assert found.design_stress[1] > found.design_stress[0]  # what is known better carries more


def test_a_design_is_for_specimens_of_the_problem():
    """Tests of two lengths in either order. By chance the designs of the lengths differ by 4 %."""
    peaks = {0.025: 1e6 * np.array([0.83, 0.9, 0.87]), 0.05: 1e6 * np.array([0.8, 0.85, 0.77])}
    given = GIVEN | {"repetitions": 10, "designs": {"few": 1}}
    stresses = []
    for lengths in ((0.025, 0.05), (0.05, 0.025)):
        groups = {length: peaks[length] for length in lengths}
        posterior = st.infer(PROBLEM, FIELD, groups, unit="Pa", **FEW)
        found = st.design_of_tests(PROBLEM, posterior, **given)
        kinds = [posterior.likelihood.of(peaks.values(), [k, 1 - k]) for k in (0, 1)]
        stress = [Prediction(kind, posterior.grid).quantile(1e-3) for kind in kinds]
        by_kind = dict(zip(lengths, stress, strict=True))
        assert abs(by_kind[0.025] / by_kind[0.05] - 1.0) > 0.02
        assert found.design_stress[0] == pytest.approx(by_kind[0.05], rel=1e-3)
        stresses.append(float(found.design_stress[0]))
    assert stresses[0] == pytest.approx(stresses[1], rel=0.02)


def test_a_fit_is_taken(monkeypatch):
    for name in ("MAX_X_POINTS", "PREDICTED"):
        monkeypatch.setattr(f"stiction.inference.specimens.{name}", 400)
    records = [
        factor * FIELD.sample(PROBLEM.interface, seed=k)[0]
        for k, factor in enumerate((1.0, 0.9, 1.1, 1.04, 0.97))
    ]
    options = {"marginal": "gamma", "noise": False, "between": "lognormal", "bootstrap": 20}
    fit = st.fit_field(records, PROBLEM.interface, progress=False, **options)
    designs = {"few": 5, "profiles": {"profiles": 6}}
    numbers = {"repetitions": 10, "samples": 100}
    found = st.design_of_tests(PROBLEM, fit, designs=designs, **numbers, **GIVEN)
    for name in ("few", "profiles"):
        assert np.all(found.width.sel(design=name) < found.width.sel(design="now"))
