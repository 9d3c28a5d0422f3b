"""Inference as a user meets it: results, mistakes, libraries of others, the page and its data."""

import dataclasses
import runpy
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from refusals import refuses

import stiction as st
from stiction.ensemble.experiment import Experiment
from stiction.inference.infer import UNFINISHED

pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")

PROBLEM = st.paper.problem(nodes=256)
H_N = PROBLEM.nucleation_length
STRENGTH = st.paper.strength(PROBLEM, correlation_ratio=0.6)
LOCAL = st.LocalCriterion()
PRIOR = {
    "correlation_length": {"low": 0.25 * H_N, "high": 4.0 * H_N, "spacing": "log"},
    "marginal.low": (0.4e6, 0.9e6),
    "marginal.high": (1.2e6, 2.2e6),
}
LOW = {"marginal.low": (0.4e6, 0.9e6)}


def peaks_of(problem, seed):
    options = {"method": LOCAL, "samples": 30, "seed": seed, "pilot": False}
    return st.monte_carlo(problem, STRENGTH, **options).critical_stress.values


PEAKS = peaks_of(PROBLEM, 99)


def infer(peaks=PEAKS, problem=PROBLEM, random=STRENGTH, prior=LOW, **options):
    options = {"method": LOCAL, "samples": 400} | options
    return st.infer(problem, random, peaks, prior=prior, **options)


@pytest.fixture(scope="module")
def posterior():
    return infer(prior=PRIOR, samples=1000, load_cell_error=5e3)


def test_arviz(posterior):
    arviz = pytest.importorskip("arviz")
    found = posterior.to_arviz()
    groups = {"posterior", "prior", "log_likelihood", "posterior_predictive", "observed_data"}
    assert all(group in found for group in groups)
    likely = found["log_likelihood"]["peak"]
    assert likely.dims[-1] == "test"
    assert found["observed_data"]["peak"].size == PEAKS.size
    theta = np.stack([posterior.draws[name][:5] for name in PRIOR], axis=1)
    whole = likely.sum("test").values[0, :5]
    np.testing.assert_allclose(posterior.log_likelihood(theta), whole, rtol=1e-9)
    loo = arviz.loo(found)
    assert np.isfinite(getattr(loo, "elpd_loo", None) or loo.elpd)


def test_predicted_campaigns_have_as_many_independent_tests_as_the_measured_one():
    """Nearly nothing is unknown, so that tests of a campaign scatter as those of all do."""
    prior = {"marginal.low": scipy.stats.uniform(0.659e6, 2e3)}
    both = infer({0.1: PEAKS, 0.05: PEAKS[:6] + 1e4}, prior=prior, load_cell_error=2e3)
    campaigns = both.to_arviz()["posterior_predictive"]["peak"].values.reshape(4000, 36)
    alike = np.corrcoef(campaigns.T)[np.triu_indices(36, 1)]
    assert np.abs(alike).max() < 0.1  # 630 pairs of 4,000: 4 standard errors are 0.064
    for columns, one in zip((slice(30), slice(30, 36)), both.predicted, strict=True):
        own = campaigns[:, columns]
        assert own.mean() == pytest.approx(one.mean(), abs=0.1 * one.std())
        within = np.sqrt(own.var(axis=1, ddof=1).mean())
        assert within == pytest.approx(one.std(), rel=0.1)


CELL = {"load_cell_error": 30.0, "unit": "N"}
PLATE = st.Blocks(height=0.05, thickness=6e-3)
WIDE = st.Interface(length=0.1, nodes=160, width=0.02)
BY_AREA = {  # key: problem, its range, area at the tenth of 25 nodes (m2), lengths of specimens
    "specimen.thickness": ({"specimen": PLATE}, (4e-3, 10e-3), 6.25e-3 * 0.1, (None,)),
    "interface.width": ({"interface": WIDE}, (9e-3, 33e-3), 18e-3 * 0.1, (0.05, 0.1)),
    "interface.length": ({"interface": WIDE}, (0.09, 0.114), 0.02 * 0.099, (None,)),
}


@pytest.mark.parametrize("key", BY_AREA)
def test_forces_are_of_the_area_at_each_point_of_the_prior(key):
    """Against stresses on the one area of a node of the prior, where the two are the same."""
    changes, (low, high), area, lengths = BY_AREA[key]
    problem, at = dataclasses.replace(PROBLEM, **changes), low + (high - low) * 9 / 24
    areas = [area * (length or 0.1) / 0.1 for length in lengths]
    kinds = [0.66e6 + 3e5 * np.linspace(0.1, 0.3, 4 + i) for i in range(len(lengths))]
    forces = {n: one * own for n, one, own in zip(lengths, kinds, areas, strict=True)}
    field = dataclasses.replace(STRENGTH, marginal=scipy.stats.weibull_min(4.0, scale=1e6))
    scaled, options = {"marginal.scale": (0.8e6, 1.4e6)}, {"samples": 100, "random": field}
    joint = infer(
        forces, problem, prior={f"problem.{key}": (low, high)} | scaled, **CELL, **options
    )
    part, _, name = key.partition(".")
    fixed = dataclasses.replace(getattr(problem, part), **{name: at})
    problem, jacobian = dataclasses.replace(problem, **{part: fixed}), 0.0
    if len(kinds) == 1:  # the error of the load cell is one stress
        error, jacobian = 30.0 / area, np.log(area) * kinds[0].size
        alone = infer(kinds[0], problem, prior=scaled, load_cell_error=error, **options)
    else:
        alone = infer(forces, problem, prior=scaled, **CELL, **options)
    scales = np.array([0.9e6, 1.05e6, 1.3e6])
    found = joint.log_likelihood(np.stack([np.full(3, at), scales], axis=1))
    np.testing.assert_allclose(
        found, alone.log_likelihood(scales[:, None]) - jacobian, atol=1e-6
    )
    for one, own in zip(joint.predicted, areas, strict=True):
        assert 0.5e6 < np.median(one) / own < 1.4e6


def test_a_posterior_between_the_points_of_a_grid_counts_in_a_design_of_tests():
    """A prior so wide that one posterior of ten lies below the first point of any fixed grid."""
    field = dataclasses.replace(STRENGTH, marginal=scipy.stats.weibull_min(4.0, 1e6, 1e5))
    options = {"method": LOCAL, "samples": 100, "repetitions": 10, "seed": 141}
    wide, problem = {"marginal.loc": (1e6, 400e6)}, dataclasses.replace(PROBLEM, interface=WIDE)
    found = st.design_of_tests(problem, field, prior=wide, designs={"nine": 9}, **options)
    # Onsets scatter by some 20 kPa, and nine tests know their location to a third of that.
    assert found.information.item() == pytest.approx(np.log(399e6 / 2e4), abs=1.5)
    assert 0.0 < found.standard_error.item() < 0.2
    area = problem.area
    same = st.design_of_tests(
        problem, field, prior={"marginal.loc": (1e6, 2e6)}, designs={"few": 5},
        load_cell_error=1e4, **options,
    )  # fmt: skip
    force = st.design_of_tests(
        problem, field, prior={"marginal.loc": (1e6, 2e6)}, designs={"few": 5}, unit="kN",
        load_cell_error=10.0 * area, workers=1, **options,
    )  # fmt: skip
    xr.testing.assert_allclose(same, force, rtol=1e-9)


FIELDS = [st.paper.strength(PROBLEM, correlation_ratio=ratio) for ratio in (0.5, 0.6, 0.8)]


@pytest.mark.parametrize(
    "given",
    [{"random": FIELDS, "prior": None}, {"prior": {"correlation_length": (H_N, 2.0 * H_N)}}],
)
def test_what_an_interrupted_call_has_simulated_is_taken_up(given, monkeypatch):
    solve, solved = Experiment.results, []

    def results(self, first, count):
        if len(solved) == last:
            raise stop
        solved.append(first)
        return solve(self, first, count)

    monkeypatch.setattr(Experiment, "results", results)
    stop, last = KeyboardInterrupt, -1
    whole = infer(**given, workers=1)
    total, last = len(solved), len(solved) + 2
    with pytest.raises(KeyboardInterrupt):
        infer(**given, workers=1)
    last = -1
    found = infer(**given, workers=1)
    assert len(solved) == 2 * total  # nothing twice
    np.testing.assert_array_equal(found.u, whole.u)
    infer(**given, workers=1)
    assert len(solved) == 3 * total  # what is complete is not kept
    stop, last = MemoryError, len(solved) + 2
    with pytest.raises(MemoryError):
        infer(**given, workers=1)
    assert not UNFINISHED  # nor what ended in an error


@pytest.mark.filterwarnings("default::stiction.AccuracyWarning")
def test_doubts_are_named_where_the_caller_stands():
    with pytest.warns(st.AccuracyWarning, match="upper end of marginal.low, 640000") as caught:
        infer(prior={"marginal.low": (0.4e6, 0.64e6)})
    assert {one.filename for one in caught} == {__file__}


simulator = partial(st.external.simulator, PROBLEM, STRENGTH, method=LOCAL, samples=30, seed=99)


def test_limit_states_and_simulators_are_those_of_monte_carlo():
    state = st.external.limit_state(PROBLEM, STRENGTH, LOCAL)
    draws = state.draws(seed=99, first=0, samples=30)
    np.testing.assert_array_equal(state(draws), PEAKS)
    assert state(draws[3]) == PEAKS[3]
    refuses("draws ... shape", lambda: state(np.zeros((2, 3))))
    simulate = simulator(("marginal.low",))
    np.testing.assert_array_equal(simulate([0.66e6]), PEAKS)
    np.testing.assert_array_equal(simulate([0.66e6], first=10)[:20], PEAKS[10:])
    refuses("theta ... 1 finite", lambda: simulate([]))
    refuses("'lo' ... 'low'", lambda: simulator("marginal.lo"))
    refuses("'mean' ... 'marginal.mean' ... 'corr'", lambda: simulator(("mean", "corr")))


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def example(monkeypatch, tmp_path):
    """Run an example in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda name: runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_openturns_works_on_the_limit_state(example, capsys):
    pytest.importorskip("openturns")
    found = example("outside_openturns")
    theirs, own = found["found"], found["own"]
    error = np.hypot(theirs.getCoefficientOfVariation(), own.cv)
    ratio = theirs.getProbabilityEstimate() / own.probability
    assert abs(np.log(ratio)) < 4.0 * error  # joint standard errors
    assert "OpenTURNS" in capsys.readouterr().out


@pytest.mark.slow
def test_dynesty_finds_the_same_posterior(example):
    """Another sampler, likelihood and no scaling: 60 live points, two minutes."""
    pytest.importorskip("dynesty")
    found = example("outside_dynesty")
    for i, name in enumerate(found["names"]):
        own = found["posterior"].draws[name].ravel()
        # Sixty live points leave a tenth of the width; two seeds gave 0.04 to 0.11.
        assert abs(found["draws"][:, i].mean() - own.mean()) < 0.3 * own.std(), name
    # Silverman's kernel widens the variance of 1000 peaks by 750^-0.4, which each of the 25 pays.
    # Nested sampling adds sqrt(information / live points), 0.22 here: three of them.
    smoothing = 0.5 * 25 * np.log1p(750.0**-0.4)
    expected = found["posterior"].log_evidence - smoothing
    assert found["evidence"] == pytest.approx(expected, abs=0.66)
