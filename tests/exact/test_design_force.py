"""The posterior of mean and scatter between specimens beside an own computation in closed form."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import norm
from setups import make_problem

import stiction as st
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState
from stiction.inference.density import TABLE_REACH, densities_of
from stiction.inference.specimens import (
    MEAN_KEY,
    SCATTER_KEY,
    Onsets,
    Prediction,
    Profiles,
    Tables,
    grid_of_profiles,
)
from stiction.random.equally_likely import EquallyLikely
from stiction.reliability.counting import solve_specimens

sys.path.append(str(Path(__file__).parents[2] / "validation"))
import design_force_closed as closed

RNG = np.random.default_rng(3)
LEVELS = np.exp(0.07 * RNG.standard_normal(5))
PEAKS = np.exp(0.09 * RNG.standard_normal(8) - 0.02)
FIELD = st.RandomInterface(
    strength=st.RandomField(st.Lognormal(mean=1.0, cv=0.2), st.PowerLawSpectrum(4e-3))
)


def package(levels, peaks):
    """The package's grids by levels alone and by both, of levels and peaks about 1."""
    within = np.full((1, len(levels)), closed.OF_LEVEL**2)
    profiles = Profiles((FIELD,), 1.0, np.array(levels), within)
    ratios = np.exp(closed.OF_PEAK * ndtri((np.arange(4000) + 0.5) / 4000))[None, None]
    z = np.linspace(-TABLE_REACH, TABLE_REACH, 401)
    # The density itself, not a kernel density of the onsets.
    known = densities_of(ratios[0], np.zeros(1))._replace(
        mean=np.zeros(1), spread=np.full(1, closed.OF_PEAK), table=norm.logpdf(z)[None]
    )
    onsets = Onsets(np.zeros(1), ratios, (known,))
    return grid_of_profiles(profiles, Tables(profiles, None, (onsets,), 0.0, (peaks,)))


@pytest.mark.parametrize("levels", [LEVELS, LEVELS[:0]], ids=["both", "tests alone"])
def test_posterior_is_that_of_the_closed_form(levels):
    """Means, deviations and families to three digits: both integrate by midpoints."""
    _, grid = package(levels, PEAKS)
    logs, weights = closed.posterior(levels, PEAKS)
    m = np.exp(logs)
    mass = np.array(list(weights.values()))
    mean = np.sum(mass * m)
    deviation = np.sqrt(np.sum(mass * (m - mean) ** 2))
    scatter = np.sum(mass * closed.CVS[:, None])
    of_mean, of_scatter = grid.mass.sum(axis=(0, 1, 2)), grid.mass.sum(axis=(0, 1, 3))
    found, cvs = np.exp(grid.means), grid.profiles.prior.cells()
    assert of_mean @ found == pytest.approx(mean, rel=1e-3)
    assert np.sqrt(of_mean @ (found - mean) ** 2) == pytest.approx(deviation, rel=2e-3)
    assert of_scatter @ cvs == pytest.approx(scatter, rel=2e-3)
    shares = {family: own.sum() for family, own in weights.items()}
    assert grid.families == pytest.approx(shares, abs=1e-3)
    drawn = grid.described(grid.draws(40_000, np.random.default_rng(1)))
    assert drawn[MEAN_KEY].mean() == pytest.approx(mean, abs=4.0 * deviation / 200.0)
    assert drawn[SCATTER_KEY].mean() == pytest.approx(scatter, rel=0.02)  # four errors


LINE = make_problem(64, 0.05, weakening_rate=0.25e12)
LOCAL = {"method": st.LocalCriterion(), "progress": False}


def scattering(mean, cv, of_factor):
    """A field that scatters by `cv` within, and a log-normal factor between specimens."""
    field = st.RandomField(st.Gamma(mean=mean, cv=cv), st.PowerLawSpectrum(4e-3), True)
    factor = st.Lognormal(mean=1.0, cv=of_factor)
    return st.RandomInterface(strength=field, between={"strength": factor})


def test_specimens_of_each_solved_sample_are_those_of_its_draws():
    """Also of other interfaces of the same field: onsets of their draws are as counted."""
    of = (1e6, 0.2, 0.05), (1.2e6, 0.2, 0.1), (9e5, 0.1, 0.08)
    random = EquallyLikely(tuple(scattering(*each) for each in of))
    state = LimitState(Experiment(LINE, random, LOCAL["method"], seed=4))
    counts = solve_specimens(state, 0, 20)
    assert counts.values.shape == (20, 128)
    group = np.where(counts.members == 2, 1, 0)
    assert np.all(np.ptp(group, axis=1) == 0)
    assert {*counts.members.ravel().tolist()} == {0, 1, 2}
    picks = np.arange(0, 20 * 128, 37)
    draws = counts[picks]
    np.testing.assert_allclose(state(draws), counts.values.ravel()[picks], rtol=1e-9)
    np.testing.assert_array_equal(state.member(draws), counts.members.ravel()[picks])


@pytest.mark.parametrize("probability", [1e-2, 1e-4])
def test_a_design_by_specimens_of_solved_samples_is_that_of_an_integral(probability):
    """The integral over the factor is done by hand, over 20,000 onsets of the field within."""
    random = scattering(1e6, 0.15, 0.12)
    inner = st.monte_carlo(LINE, random.strength, samples=20_000, seed=9, pilot=False, **LOCAL)
    law = random.between["strength"].distribution
    found = st.design_stress(LINE, random, probability=probability, seed=2, **LOCAL)
    exact = np.mean(law.cdf(found.stress / inner.critical_stress.values))
    assert found.algorithm == "plain"
    assert found.evaluations < 0.2 / (probability * 0.1**2)
    assert np.log(exact / probability) == pytest.approx(0.0, abs=4.0 * found.cv)
    demand = st.failure_probability(LINE, random, found.stress, seed=3, **LOCAL)
    assert np.log(demand.probability / exact) == pytest.approx(0.0, abs=4.0 * demand.cv)
    assert np.all(demand.failing_profiles.critical_stress < found.stress)


def test_a_design_by_draws_is_a_quantile_of_the_predictive_distribution():
    peaks = 0.8e6 * PEAKS
    posterior = st.infer(
        LINE, scattering(1e6, 0.2, 0.1), peaks, unit="Pa", samples=2000, **LOCAL
    )
    prediction = Prediction(posterior.likelihood, posterior.grid)
    exact = prediction.quantile(1e-2)
    assert prediction.probability(exact) == pytest.approx(1e-2, rel=1e-4)
    given = LOCAL | {"probability": 1e-2, "target_cv": 0.2}
    low, high = st.design_stress(LINE, posterior, seed=1, **given).interval["stress"]
    assert low < exact < high


def test_a_uniform_specimen_slides_at_its_strength_by_any_law(monkeypatch):
    """So the law moves no probability, also far below the simulated mean strengths."""
    monkeypatch.setattr("stiction.random.equally_likely.FIRST_MEMBERS", 100)
    peaks, answers = [27.3e3, 29.1e3, 25.8e3, 31.4e3, 28.2e3], []
    for law in (
        {"weakening_rate": 1e11}, {"critical_slip": 9e-5},
        {"critical_slip": 5e-5, "residual_ratio": 0.4},
    ):  # fmt: skip
        load = st.Load(pressing_force=117e3)
        problem = make_problem(64, 0.173, width=0.023, load=load, **law)
        source = st.infer(
            problem, None, peaks, unit="N", between="normal", seed=1, progress=False
        )
        answers.append([
            st.failure_probability(problem, source, force=force, progress=False).probability
            for force in (1e3, 1e4, 19e3, 28e3, 60e3)
        ])  # fmt: skip
    assert (np.diff(answers) > 0.0).all()
    # Onsets in the middle of the range are interpolated between means, to 1e-9.
    for of_slip in answers[1:]:
        assert of_slip == pytest.approx(answers[0], rel=1e-6)
