"""Inference: scaling, densities and the posterior against what they stand for."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from recording import stored
from setups import LOCAL, turns

import stiction as st
from stiction.inference.density import densities_of, log_likelihoods
from stiction.inference.likelihood import (
    Simulation,
    effective_samples,
    experiments_at,
    make_likelihood,
    moved,
    simulate,
)
from stiction.inference.posterior import grid_of
from stiction.inference.prior import find_scaling, make_prior

PROBLEM = st.paper.problem(nodes=256)
H_N = PROBLEM.nucleation_length
STRENGTH = st.paper.strength(PROBLEM, correlation_ratio=0.6)
LENGTH = {"low": 0.25 * H_N, "high": 4.0 * H_N, "spacing": "log"}
LOW, SMALL = {"marginal.low": (0.4e6, 0.9e6)}, {"marginal.low": (0.1, 0.3)}
THREE = {"correlation_length": LENGTH} | LOW | {"marginal.high": (1.2e6, 2.2e6)}


def with_marginal(marginal, field=STRENGTH):
    return dataclasses.replace(field, marginal=marginal)


def with_friction(**options):
    return dataclasses.replace(PROBLEM, friction=st.LinearWeakening(**options))


def with_load(**options):
    return dataclasses.replace(PROBLEM, load=st.Load(**options))


def likelihood_of(prior, error=0.0, samples=400, lengths=(None,)):
    simulation = Simulation(LOCAL, samples, seed=0)
    return make_likelihood(
        prior, simulation, lengths=lengths, error=error, variable="critical_stress"
    )


def onsets(prior, theta, method=LOCAL, samples=60, seed=3):
    experiments = experiments_at(prior, np.atleast_2d(theta), method)
    return simulate(experiments, Simulation(method, samples, seed), 0, "critical_stress")


WAVE = np.cos(turns(256))
PRESSED = with_load(normal_pressure=3e6)
UNEVEN = with_load(normal_pressure=3e6 * (1.0 + 0.7 * WAVE))
SPECIMEN = dataclasses.replace(
    with_friction(weakening_rate=0.5e12, residual_ratio=0.4),
    specimen=st.Blocks(height=0.03, drive=st.Pusher(height=0.01, width=0.004)),
)
WITH_RESIDUAL = with_friction(weakening_rate=0.5e12, residual_strength=0.3e6)
WEIBULL = with_marginal(scipy.stats.weibull_min(4.0, scale=1e6))
COEFFICIENTS = dataclasses.replace(
    STRENGTH,
    marginal=st.Beta(alpha=2.0, beta=3.0, low=0.2, high=0.6),
    quantity="friction_coefficient",
)

SCALING = stored("cases")["scaling of onsets"]
"""Problem, field, method, prior and the number of keys that scale: none where scaling fails."""


@pytest.mark.parametrize("name", SCALING)
def test_parameters_scale_every_onset(name):
    problem, random, method, prior, count = eval(SCALING[name], globals())
    prior = make_prior(problem, random, prior)
    scaling = find_scaling(prior, method, "critical_stress")
    assert len(scaling.keys) == count
    for u in (0.15, 0.85) if count else ():
        theta = prior.theta(np.full((1, prior.dimension), u))
        base = theta.copy()
        base[0, list(scaling.keys)] = scaling.reference[list(scaling.keys)]
        shift, stretch = scaling.of(theta)
        expected = shift + stretch * onsets(prior, base, method)[0]
        # Round-off of the strength, 1e-9 by the quantile table, and of equilibrium's steps.
        np.testing.assert_allclose(onsets(prior, theta, method)[0], expected, rtol=3e-9)


def log_densities_at(samples, points, error=0.0, bound=-np.inf):
    found, out = densities_of(samples[None, :], np.array([bound])), np.empty((1, points.size))
    nodes, weights, same = np.zeros((1, 1), dtype=np.int64), np.ones((1, 1)), [[0.0], [1.0]]
    of_v = found.between(nodes, weights)
    log_likelihoods(found.table, nodes, weights, of_v, np.array(same), error, points, out)
    return out[0]


EVEN = (np.arange(4000) + 0.5) / 4000


@pytest.mark.parametrize("error", [0.0, 2.0])
def test_density_of_a_normal_sample(error):
    points = np.linspace(-8.0, 8.0, 1601)
    found = np.exp(log_densities_at(3.0 + scipy.stats.norm.ppf(EVEN), 3.0 + points, error))
    exact = scipy.stats.norm.pdf(points, scale=np.hypot(1.0, error))
    # The kernel keeps mean and variance; groups and the grid's interpolation cost 0.5 % of it.
    assert np.abs(found - exact).max() < 0.005 * exact.max()
    assert np.trapezoid(found, points) == pytest.approx(1.0, abs=2e-3)


def test_density_far_out_falls_and_stays_finite():
    sample = np.random.default_rng(0).gamma(4.0, size=1000)
    found = log_densities_at(sample, np.array([15.0, 50.0, 100.0]))
    assert np.isfinite(found).all()
    assert found[2] < found[1] < found[0] < -5.0


@pytest.mark.parametrize(
    ("shape", "error", "most"), [(1.5, 0.0, 0.03), (4.0, 0.6, 0.01), (1.5, 0.2, 0.04)]
)
def test_density_above_a_bound(shape, error, most):
    """Gamma distributions, one of which begins steeply at its bound, with a load cell's error."""
    family = scipy.stats.gamma(shape, loc=10.0)
    points = 10.0 + np.linspace(0.02, 12.0, 400)
    found = np.exp(log_densities_at(family.ppf(EVEN), points, error, bound=10.0))
    exact = family.pdf(points)
    if error:
        fine = 10.0 + (np.arange(10_000) + 0.5) * 2e-3  # to 20 above the bound
        kernel = scipy.stats.norm.pdf(points[:, None], fine[None, :], error)
        exact = 2e-3 * kernel @ family.pdf(fine)
    # The logarithm is not normal: a kernel of 0.2 in it rounds the steep flank a little.
    assert np.abs(found - exact).max() < most * exact.max()
    nothing = log_densities_at(family.ppf(EVEN), np.array([9.99]), bound=10.0)
    assert nothing[0] == -np.inf


def test_the_likelihood_between_nodes_is_that_of_a_simulation_there():
    """Interpolated and scaled, against simulated at the very point, with the same draws."""
    prior = make_prior(PROBLEM, STRENGTH, THREE)
    model, peaks = likelihood_of(prior, samples=2000), 1e6 * np.linspace(0.66, 0.78, 7)
    for place in ([0.31, 0.45, 0.4], [0.72, 0.6, 0.3]):
        theta = prior.theta(np.array([place]))
        direct = onsets(prior, theta, LOCAL, 2000, seed=0)
        exact = log_densities_at(direct[0], peaks, bound=theta[0, 1])
        found = model.of([peaks]).parts(np.array([place]))[0]
        likely = exact > exact.max() - 3.0
        assert likely.sum() >= 2
        # Linear between nodes; where a test is likely that costs a hundredth of its density.
        np.testing.assert_allclose(found[likely], exact[likely], atol=0.03)
        # Predicted peaks are these onsets with the error of the load cell.
        again = dataclasses.replace(model, error=3e4).predicted(
            0, np.tile(place, (20_000, 1)), 1
        )
        assert again.mean() == pytest.approx(direct.mean(), abs=4.0 * again.std() / 140)
        assert again.std() == pytest.approx(np.hypot(direct.std(), 3e4), rel=0.03)


def test_specimens_of_two_lengths_have_samples_of_their_own():
    """One kind twice, so that the same samples would give the same onsets."""
    prior = make_prior(PROBLEM, STRENGTH, LOW)
    one, other = likelihood_of(prior, lengths=(None, 0.1)).densities
    # 400 samples: four standard errors of a correlation.
    assert abs(np.corrcoef(one.onsets[0], other.onsets[0])[0, 1]) < 0.2
    assert one.onsets.mean() == pytest.approx(other.onsets.mean(), rel=0.01)


def test_onsets_moved_to_another_method_are_worth_what_they_say():
    """The scatter of their mean over many campaigns, in a unit of their own."""
    rng, means, alike = np.random.default_rng(5), [], 0.9
    for _ in range(400):
        local = rng.standard_normal((1, 1000))
        rest = rng.standard_normal((1, 100))
        exact = alike * local[:, :100] + np.sqrt(1.0 - alike**2) * rest
        few, many = 0.7e6 + 2e4 * exact, 0.9e6 + 3e4 * local
        node = np.zeros((1, 1), dtype=np.int64), np.ones((1, 1))
        means.append(moved(many, few, many[:, :100], *node).mean())
    assert np.mean(means) == pytest.approx(0.7e6, abs=4.0 * np.std(means) / 20)
    # 400 campaigns know a variance to 7 %; that of quantiles is 2/(1 + alike) of that of a mean.
    assert effective_samples(alike, 1000, 100) == pytest.approx(
        (2e4 / np.std(means)) ** 2, rel=0.3
    )


def test_grid_against_a_sum_by_hand():
    """One shift, likelihood known on a fine grid: evidence, information and quantiles."""
    prior = make_prior(PROBLEM, STRENGTH, {"marginal.low": (0.5e6, 0.8e6)})
    rng = np.random.default_rng(1)
    peaks = onsets(prior, [[0.66e6]], LOCAL, 12)[0] + 2e4 * rng.standard_normal(12)
    likelihood = likelihood_of(prior, error=2e4).of([peaks])
    u = (np.arange(100_000) + 0.5) / 100_000
    values = likelihood(u[:, None])
    density = np.exp(values - values.max())
    evidence = values.max() + np.log(density.mean())
    density /= density.mean()
    held = density[density > 0.0]
    information = np.mean(held * np.log(held))
    grid = grid_of(likelihood, likelihood.box)
    # The midpoint rule on 512 cells of a smooth function within the zoomed box.
    assert grid.log_evidence == pytest.approx(evidence, abs=1e-3)
    assert grid.information(0) == pytest.approx(information, abs=1e-3)
    draws = grid.draws(20_000, 0)[:, 0]
    exact = np.interp([0.05, 0.5, 0.95], np.cumsum(density) / density.sum(), u)
    assert np.quantile(draws, [0.05, 0.5, 0.95]) == pytest.approx(exact, abs=3e-3)
    # Of two parameters, each with peaks of its own, evidences multiply.
    box = np.repeat(likelihood.box, 2, axis=1)
    pair = grid_of(lambda u: likelihood(u[:, :1]) + likelihood(u[:, 1:]), box, 10_000)
    assert pair.log_evidence == pytest.approx(2.0 * evidence, abs=1e-2)
    assert [pair.information(i) for i in (0, 1)] == pytest.approx([information] * 2, abs=1e-2)


def test_a_prior_that_begins_where_its_density_is_zero():
    """A length of zero is impossible, and so unlikely that it need not be simulated."""
    distribution = scipy.stats.gamma(9.0, scale=H_N / 9.0)  # no density at its infinite end
    prior = make_prior(PROBLEM, STRENGTH, {"correlation_length": distribution})
    low, high = prior.ends[:, 0]
    assert 0.1 * H_N < low < high < 10.0 * H_N
