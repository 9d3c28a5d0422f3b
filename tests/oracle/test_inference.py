"""Posteriors of one parameter against kernel densities of simulated peaks over its whole prior."""

import dataclasses

import numpy as np
import pytest
import scipy.stats

import stiction as st

pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")

SOLID = st.Solid(1e9, 0.25, 1170.0)
SPECTRUM = st.PowerLawSpectrum(8e-3)
LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
NODES = 128
WAVE = 1.0 + 0.6 * np.cos(2.0 * np.pi * np.arange(NODES) / NODES)


def problem(nodes=NODES, share=0.1, residual_ratio=None, **load):
    """An interface of 0.1 m with a nucleation length of a share of it."""
    rate = 2.0 * 0.5788869418506 * SOLID.effective_modulus() / (share * 0.1)
    friction = st.LinearWeakening(weakening_rate=rate, residual_ratio=residual_ratio)
    return st.Problem(SOLID, st.Interface(0.1, nodes), friction, st.Load(**load))


def beta(low, high, of=None):
    return st.RandomField(
        st.Beta(alpha=2.0, beta=3.0, low=low, high=high), SPECTRUM, True, of=of
    )


def lognormal(cv):
    return st.RandomField(st.Lognormal(mean=1e6, cv=cv), st.PowerLawSpectrum(7.5e-3), True)


CASES = {
    "coefficients": (
        problem(normal_pressure=3e6),
        lambda low: beta(low, 0.6, "friction_coefficient"),
        LOCAL, "marginal.low", (0.1, 0.3), 0.2, 30,
    ),
    "coefficients under a pressure that varies": (
        problem(normal_pressure=3e6 * WAVE),
        lambda low: beta(low, 0.6, "friction_coefficient"),
        LOCAL, "marginal.low", (0.1, 0.3), 0.2, 30,
    ),
    "gradient load": (
        problem(profile=st.GradientLoad(amplitude=0.6)),
        lambda low: beta(low, 1.6e6),
        LOCAL, "marginal.low", (0.4e6, 0.8e6), 0.6e6, 30,
    ),
    "residual strength": (
        problem(64, 0.25, residual_ratio=0.5),
        lambda low: beta(low, 1.6e6),
        EXACT, "marginal.low", (0.4e6, 0.8e6), 0.6e6, 30,
    ),
    "beyond what the local criterion finds": (
        problem(64, 0.25), lognormal, EXACT, "marginal.cv", (0.1, 1.5), 0.9, 60,
    ),
}  # fmt: skip


def simulate(base, field, method, samples, seed):
    """Critical stresses."""
    found = st.monte_carlo(
        base, field, method=method, samples=samples, seed=seed, progress=False, pilot=False
    )
    return found.critical_stress.values


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


@pytest.mark.parametrize(
    "name",
    [
        "coefficients",
        "gradient load",
        "residual strength",
        pytest.param("coefficients under a pressure that varies", marks=pytest.mark.slow),
        pytest.param("beyond what the local criterion finds", marks=pytest.mark.slow),
    ],
)
def test_posterior_of_one_parameter(name):
    base, field, method, key, prior, truth, count = CASES[name]
    peaks = simulate(base, field(truth), method, count, 4)
    samples = 1500 if method is LOCAL else 150
    found = st.infer(
        base, field(prior[0]), peaks, prior={key: prior}, method=method, samples=samples,
        progress=False,
    )  # fmt: skip
    own = found.draws[key]
    near = np.linspace(*np.clip(truth + 0.2 * np.array([-1, 1]) * np.ptp(prior), *prior), 13)
    mean, deviation = by_counting(base, field, method, near, peaks, samples)
    # Both scatter: by finite samples, and by kernels that round the flank at a bound.
    assert own.mean() == pytest.approx(mean, abs=1.0 * deviation)
    assert own.std() == pytest.approx(deviation, rel=0.4)
    # The box that was simulated holds it.
    model = found.likelihood
    for end, side in (
        (model.low[0], found.u[:, 0]),
        (1.0 - model.high[0], 1.0 - found.u[:, 0]),
    ):
        assert end == 0.0 or np.mean(side < end + 0.05 * (model.high - model.low)[0]) < 2e-3


def test_designs_of_one_parameter():
    """Expected information of five tests, by counting: a shift of a known distribution."""
    base = problem()
    prior = {"marginal.loc": (0.5e6, 0.7e6)}
    marginal = scipy.stats.lognorm(0.3, loc=0.6e6, scale=0.5e6)
    field = dataclasses.replace(beta(0.6e6, 1.6e6), marginal=marginal)
    onsets = simulate(base, field, LOCAL, 1000, 5)
    kernels = scipy.stats.gaussian_kde(onsets - 0.6e6, "silverman")
    steps = 0.5e6 + 0.2e6 * (np.arange(200) + 0.5) / 200
    rng = np.random.default_rng(0)
    gains, spreads = [], []
    for _ in range(100):
        peaks = rng.choice(onsets, 5) + rng.uniform(-1e5, 1e5)
        log = kernels.logpdf((peaks[:, None] - steps).ravel()).reshape(5, -1).sum(axis=0)
        mass = np.exp(log - log.max())
        mass /= mass.sum()
        gains.append(np.sum(mass * np.log(np.maximum(mass * steps.size, 1e-300))))
        spreads.append(np.sqrt(mass @ (steps - mass @ steps) ** 2) / (0.2e6 / np.sqrt(12.0)))
    found = st.design_of_tests(
        base, field, prior=prior, designs={"five": 5}, method=LOCAL, repetitions=100,
        progress=False,
    )  # fmt: skip
    error = 3.0 * np.hypot(float(found.standard_error[0, 0]), np.std(gains) / np.sqrt(100))
    assert float(found.information[0, 0]) == pytest.approx(np.mean(gains), abs=error)
    assert float(found.spread_left[0, 0]) == pytest.approx(np.mean(spreads), rel=0.15)


def test_a_posterior_by_a_criterion_that_does_not_hold_says_so():
    """Lognormal strength of cv 0.9 reaches its residual strength long before the onset."""
    base, random = problem(64, 0.25), lognormal(0.9)
    peaks = simulate(base, random, LOCAL, 40, 3)
    prior = {"marginal.cv": (0.3, 1.5)}
    with pytest.warns(st.AccuracyWarning, match="differs from the exact onset"):
        found = st.infer(
            base, random, peaks, prior=prior, method=LOCAL, samples=300, progress=False
        )
    assert any("Equilibrium" in note for note in found.notes)
