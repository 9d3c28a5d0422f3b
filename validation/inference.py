"""Are posteriors calibrated? Ranks of the truth over many simulated campaigns, and coverage.

Simulation-based calibration (Talts et al., 2018): parameters from the prior, peaks from them by
fresh samples and a load cell's error, and the rank of each true parameter among 99 draws from its
posterior. The ranks must be uniform.

Run: ``python validation/inference.py [--campaigns 100] [--only NAME]``
"""

import argparse
import warnings
from typing import Any, NamedTuple

import numpy as np
import scipy.stats

import stiction as st
from stiction.base.progress import SILENT
from stiction.inference.grid import grid_of
from stiction.inference.likelihood import experiments_at, make_likelihood, simulate
from stiction.inference.peaks import make_peaks
from stiction.inference.prior import make_prior

DRAWS, BINS, TESTS = 99, 10, 25
POINTS = 30**3


class Case(NamedTuple):
    """A prior of parameters of a problem, and how its peaks are measured."""

    problem: st.Problem
    random: st.RandomField
    prior: dict[str, Any]
    method: Any
    error: float
    """Standard deviation of the load cell, in the unit of the peaks."""
    variable: str = "critical_stress"
    lengths: tuple[float | None, ...] = (None,)
    tests: int = TESTS
    unit: str = "Pa"


def cases(nodes=256):
    """The paper's interface with bounds and correlation length not known, and harder ones."""
    problem = st.paper.problem(nodes=nodes)
    h_n = problem.nucleation_length
    strength = st.paper.strength(problem, correlation_ratio=0.6)
    length = {"low": 0.25 * h_n, "high": 4.0 * h_n, "spacing": "log"}
    bounds = {"marginal.low": (0.4e6, 0.9e6), "marginal.high": (1.2e6, 2.2e6)}
    local = st.LocalCriterion()

    def loaded(**load):
        return st.Problem(problem.solid, problem.interface, problem.friction, st.Load(**load))

    coefficients = st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=0.22, high=0.55), strength.spectrum,
        of="friction_coefficient",
    )  # fmt: skip
    wave = 1.0 + 0.5 * np.cos(2.0 * np.pi * np.arange(nodes) / nodes)
    weakening_rate = problem.friction.weakening_rate
    residual = st.Problem(
        problem.solid, st.Interface(0.05, nodes // 2),
        st.LinearWeakening(weakening_rate=weakening_rate, residual_ratio=0.5),
    )  # fmt: skip
    weibull = st.RandomField(st.Weibull(mean=1e6, cv=0.25), strength.spectrum, mean_mode=True)
    low = {"marginal.low": bounds["marginal.low"]}
    blocks = st.Problem(
        st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        st.Interface(0.1, 64), st.LinearWeakening(weakening_rate=0.12e12, residual_ratio=0.35),
        specimen=st.Blocks(
            height=0.05, thickness=0.006,
            drive=st.Pusher(height=0.02, width=0.01, stiffness=2e7),
        ),
    )  # fmt: skip
    return {
        "three parameters": Case(
            problem, strength, {"correlation_length": length, **bounds}, local, 5e3
        ),
        "coefficients": Case(
            loaded(normal_pressure=3e6), coefficients,
            {"marginal.low": (0.13, 0.3), "marginal.high": (0.4, 0.7)},
            local, 2e-3, "friction_coefficient",
        ),
        "coefficients, varying pressure": Case(
            loaded(normal_pressure=3e6 * wave), coefficients,
            {"correlation_length": length, "marginal.low": (0.13, 0.3)}, local, 5e3,
        ),
        "gradient load": Case(
            loaded(profile=st.GradientLoad(amplitude=0.5)), strength,
            {"correlation_length": length, **low}, local, 5e3,
        ),
        "residual strength": Case(
            residual, weibull, {"marginal.mean": (0.7e6, 1.4e6), "marginal.cv": (0.1, 0.5)},
            st.Equilibrium(), 5e3,
        ),
        "two lengths": Case(
            problem, strength, {"correlation_length": length, **low}, local, 5e3,
            lengths=(0.1, 0.04),
        ),
        "blocks behind a pusher, newtons": Case(
            blocks, st.RandomField(st.Weibull(mean=1e6, cv=0.25), strength.spectrum),
            {
                "marginal.mean": (0.7e6, 1.4e6),
                "correlation_length": {"low": 2e-3, "high": 2e-2, "spacing": "log"},
            },
            st.Equilibrium(), 3.0, tests=12, unit="N",
        ),
    }  # fmt: skip


def ranks(campaigns, tests=None, seed=0, samples=None, points=POINTS, case=None):
    """Ranks of the truth, and the truth and the posterior means as u, (campaigns, parameters)."""
    case = cases()["three parameters"] if case is None else case
    tests, area = tests or case.tests, case.problem.area if case.unit == "N" else 1.0
    prior = make_prior(case.problem, case.random, case.prior)
    simulated = make_likelihood(
        prior, method=case.method, lengths=case.lengths, error=case.error, samples=samples,
        seed=0, variable="critical_force" if case.unit == "N" else case.variable, meter=SILENT,
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    truth = rng.random((campaigns, prior.dimension))
    found, means = np.empty(truth.shape, dtype=int), np.empty(truth.shape)
    for i, u in enumerate(truth):
        peaks = []
        for number, length in enumerate(case.lengths):
            own = experiments_at(prior, prior.theta(u[None]), case.method, length)
            onsets = simulate(
                own, samples=tests, first=256 * (i + 10), seed=1000 + seed + number,
                variable=case.variable, meter=SILENT,
            )  # fmt: skip
            read = area * onsets[0] + case.error * rng.standard_normal(tests)
            peaks += make_peaks(read, case.unit).values
        likelihood = simulated.of(peaks)
        grid = grid_of(likelihood, likelihood.box, points=points)
        draws = grid.draws(DRAWS, i)
        found[i], means[i] = (draws < u).sum(axis=0), draws.mean(axis=0)
    return prior.names, found, truth, means


def p_value(own):
    """Of the hypothesis that ranks 0..DRAWS are uniform."""
    counts = np.histogram(own, bins=BINS, range=(0, DRAWS + 1))[0]
    return float(scipy.stats.chisquare(counts).pvalue)


def coverage(own, confidence=0.9):
    """Share of the truth in the central interval."""
    tail = 0.5 * (1.0 - confidence) * (DRAWS + 1)
    return float(np.mean((own >= tail) & (own < DRAWS + 1 - tail)))


def main():
    """Print p-values and coverage of every case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    warnings.simplefilter("ignore", st.AccuracyWarning)
    for title, case in cases().items():
        if options.only not in title:
            continue
        names, found, *_ = ranks(options.campaigns, case=case)
        for own, name in zip(found.T, names, strict=True):
            print(
                f"{title}: {name:20s} chi-square p = {p_value(own):.3f};"
                f" {coverage(own):.1%} in their 90 % intervals", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
