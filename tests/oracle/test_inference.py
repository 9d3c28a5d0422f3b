"""Posteriors of one parameter against kernel densities of simulated peaks over its whole prior."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from checks import standard_error
from recording import stored
from setups import EXACT, LOCAL, QUARTER, ensemble, gradient_load, turns
from specimens import crooked

import stiction as st

WAVE = 1.0 + 0.6 * np.cos(turns(128))
GRADIENT = gradient_load(st.Interface(0.1, 128), 0.6).profile
SLOW = pytest.mark.slow


def problem(nodes=128, share=0.1, residual_ratio=None, **load):
    """An interface of 0.1 m with a nucleation length of a share of it."""
    weakening_rate = 2.0 * 0.5788869418506 * QUARTER.effective_modulus() / (share * 0.1)
    friction = st.LinearWeakening(weakening_rate=weakening_rate, residual_ratio=residual_ratio)
    return st.Problem(QUARTER, st.Interface(0.1, nodes), friction, st.Load(**load))


def beta(low, high=1.6e6, of=None):
    marginal = st.Beta(alpha=2.0, beta=3.0, low=low, high=high)
    return st.RandomField(marginal, st.PowerLawSpectrum(8e-3), True, quantity=of)


def coefficient(low):
    return beta(low, 0.6, "friction_coefficient")


def lognormal(cv):
    return st.RandomField(st.Lognormal(mean=1e6, cv=cv), st.PowerLawSpectrum(7.5e-3), True)


SMALL, LARGE = ("marginal.low", (0.1, 0.3), 0.2), ("marginal.low", (0.4e6, 0.8e6), 0.6e6)
LAP_JOINT = crooked(
    nodes=24, height=0.009, weakening_rate=0.04e12, residual=0.2e6,
    drive=st.Pusher(height=0.004, width=0.003, side="both", stiffness=np.inf),
)  # fmt: skip
CASES = {name: eval(row) for name, row in stored("cases")["posteriors"].items()}
"""Problem, field by value, method, key, prior, the right value, and the number of peaks."""


def simulate(base, field, method, samples, seed):
    """Critical stresses."""
    return ensemble(base, field, samples, method=method, seed=seed).critical_stress.values


def by_counting(base, field, method, values, peaks, samples):
    """Mean and deviation of the posterior at some values of a flat prior, peaks by simulation."""
    found = np.empty(values.size)
    for i, value in enumerate(values):
        simulated = simulate(base, field(value), method, samples, 99)
        kernels = scipy.stats.gaussian_kde(simulated, "silverman")
        found[i] = kernels.logpdf(peaks).sum()
    fine = np.linspace(values[0], values[-1], 2001)
    density = np.exp(np.interp(fine, values, found) - found.max())
    density /= density.sum()
    mean = float(density @ fine)
    return mean, float(np.sqrt(density @ (fine - mean) ** 2))


QUICK = "coefficients", "gradient load", "residual strength"


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=SLOW) for name in CASES if name not in QUICK)]
)
def test_posterior_of_one_parameter(name):
    base, field, method, key, prior, truth, count = CASES[name]
    peaks = simulate(base, field(truth), method, count, 4)
    samples = 1500 if method is LOCAL else 150
    options = {"method": method, "samples": samples, "progress": False}
    found = st.infer(base, field(prior[0]), peaks, unit="Pa", prior={key: prior}, **options)
    own = found.draws[key]
    near = np.linspace(*np.clip(truth + 0.2 * np.array([-1, 1]) * np.ptp(prior), *prior), 13)
    mean, deviation = by_counting(base, field, method, near, peaks, samples)
    # Both scatter: by finite samples, and by kernels that round the flank at a bound.
    assert own.mean() == pytest.approx(mean, abs=1.0 * deviation)
    assert own.std() == pytest.approx(deviation, rel=0.4)
    # The box that was simulated holds it.
    model, u = found.likelihood, found.u[:, 0]
    low, high = model.box[:, 0]
    margin = 0.05 * (high - low)
    for end, side in ((low, u), (1.0 - high, 1.0 - u)):
        assert end == 0.0 or np.mean(side < end + margin) < 2e-3


def test_a_wider_prior_leaves_the_posterior():
    """A flat prior 3.6 times as wide, for an expensive method that the local criterion guides."""
    base, field, method, key, prior, truth, count = CASES["residual strength"]
    peaks = simulate(base, field(truth), method, count, 4)
    wide, few = (5e4, 1.5e6), 100
    found, other = (
        st.infer(base, field(truth), peaks, unit="Pa", prior={key: ends}, method=method,
                 samples=few, progress=False)
        for ends in (prior, wide)
    )  # fmt: skip
    # Interpolated between other nodes, of the same samples, by a tenth of their error.
    error = 0.1 * found.monte_carlo_error * found.draws[key].std()
    assert other.mean[key] == pytest.approx(found.mean[key], abs=error)
    lower = np.log(np.ptp(wide) / np.ptp(prior))
    assert found.log_evidence - other.log_evidence == pytest.approx(lower, abs=0.02)
    # A control variate by 2000 samples leaves the variance that it does not explain.
    alike = np.corrcoef(*(simulate(base, field(truth), m, few, 0) for m in (EXACT, LOCAL)))
    left = alike[0, 1] ** 2 / 2000 + (1.0 - alike[0, 1] ** 2) / few
    assert found.monte_carlo_error == pytest.approx(np.sqrt(count * left), rel=0.15)


def test_designs_of_one_parameter():
    """Expected information of five tests, by counting: a shift of a known distribution."""
    base, prior = problem(), {"marginal.loc": (0.5e6, 0.7e6)}
    marginal = scipy.stats.lognorm(0.3, loc=0.6e6, scale=0.5e6)
    field = dataclasses.replace(beta(0.6e6), marginal=marginal)
    onsets = simulate(base, field, LOCAL, 1000, 5)
    kernels = scipy.stats.gaussian_kde(onsets - 0.6e6, "silverman")
    steps = 0.5e6 + 0.2e6 * (np.arange(200) + 0.5) / 200
    rng = np.random.default_rng(0)
    gains = []
    for _ in range(100):
        peaks = rng.choice(onsets, 5) + rng.uniform(-1e5, 1e5)
        log = kernels.logpdf((peaks[:, None] - steps).ravel()).reshape(5, -1).sum(axis=0)
        mass = np.exp(log - log.max())
        mass /= mass.sum()
        gains.append(np.sum(mass * np.log(np.maximum(mass * steps.size, 1e-300))))
    found = st.design_of_tests(
        base, field, prior=prior, designs={"five": 5}, method=LOCAL, repetitions=100,
        progress=False,
    )  # fmt: skip
    claimed, own = float(found.standard_error[0, 0]), standard_error(gains)
    assert claimed == pytest.approx(own, rel=0.4)  # spreads of a hundred each
    error = 3.0 * np.hypot(claimed, own)
    assert float(found.information[0, 0]) == pytest.approx(np.mean(gains), abs=error)


def test_a_posterior_by_a_criterion_that_does_not_hold_says_so():
    """Lognormal strength of cv 0.9 reaches its residual strength long before the onset."""
    base, random = problem(64, 0.25), lognormal(0.9)
    peaks = simulate(base, random, LOCAL, 40, 3)
    options = {"prior": {"marginal.cv": (0.3, 1.5)}, "samples": 300, "progress": False}
    with pytest.warns(st.AccuracyWarning, match="differs from the exact onset"):
        found = st.infer(base, random, peaks, unit="Pa", method=LOCAL, **options)
    assert any("Equilibrium" in note for note in found.notes)
