"""Results keep what they hold: copies, JSON, processes."""

import copy
import json
import pickle
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import joint
import numpy as np
import pytest

import stiction as st

PEAKS = [0.69e6, 0.70e6, 0.73e6, 0.68e6, 0.71e6]
TRAVEL = np.linspace(0.0, 1e-3, 400)
FORCE = np.where(TRAVEL < 4e-4, 1.23e7 * TRAVEL, 4.1e3)


@cache
def objects():
    problem = st.paper.problem(nodes=256)
    strength = st.paper.strength(problem, correlation_ratio=1.0)
    rows = strength.sample(problem.interface, samples=3, seed=1)
    how = {"method": st.LocalCriterion(), "progress": False}
    prior = {"marginal.low": (0.5e6, 0.8e6)}
    posterior = st.infer(problem, strength, PEAKS, unit="Pa", prior=prior, samples=200, **how)
    curves = st.read_curve((TRAVEL, FORCE), unit="N", travel_unit="m")
    kinds = {"marginal": "lognormal", "spectrum": "exponential", "noise": 0.0}
    return {
        "fit": st.fit_field(rows, problem.interface, **kinds, bootstrap=20, progress=False),
        "sample": problem.sample(rows),
        "moments": st.theory.nucleation_statistics(problem, strength),
        "curve": curves[0],
        "curves": curves,
        "peaks": posterior.peaks,
        "probability": st.failure_probability(problem, strength, stress=0.7e6, **how),
        "design": st.design_stress(joint.PROBLEM, joint.FIELD, probability=0.1, **joint.GIVEN),
        "posterior": posterior,
        "agreement": st.statistics.agreement(posterior, np.add(PEAKS, 4e3), unit="Pa"),
        "problem": joint.PROBLEM,
        "field": strength,
        "method": st.Rupture(loading_rate=2e7),
    }


RESULTS = ["fit", "sample", "moments", "curve", "curves", "peaks", "probability", "design"]
RESULTS += ["posterior", "agreement"]


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_equals_its_copies_and_becomes_json(name):
    result = objects()[name]
    for twin in (copy.deepcopy(result), pickle.loads(pickle.dumps(result))):
        assert result == twin
        assert hash(result) == hash(twin)
    assert result != next(objects()[other] for other in RESULTS if other != name)
    written = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert written.keys() == result.to_dict().keys()


def test_results_that_differ_are_not_equal():
    assert objects()["sample"] != objects()["sample"].part(slice(1))


def test_short_arrays_are_shown_in_full():
    short, long = (st.Load(profile=np.linspace(0.5, 1.5, n)) for n in (10, 11))
    assert "0.5, 0.6" in repr(short)
    assert "<11 array, 0.5 to 1.5>" in repr(long)


def test_a_lambda_in_a_process_pool_is_named():
    spectrum = st.CustomSpectrum(lambda k: np.exp(-((1e-3 * k) ** 2)), max_wavenumber=3e3)
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum)
    problem, method = st.paper.problem(nodes=256), st.LocalCriterion()
    refused = pytest.raises(st.InputError, match="executor: .*lambda")
    with ProcessPoolExecutor(1) as pool, refused:
        st.monte_carlo(problem, field, method=method, samples=4, executor=pool, progress=False)
