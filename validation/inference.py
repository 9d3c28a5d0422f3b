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
from stiction.inference.likelihood import Simulation, experiments_at, make_likelihood, simulate
from stiction.inference.peaks import make_peaks
from stiction.inference.posterior import grid_of
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
    tests: int = TESTS
    unit: str = "Pa"


def cases(nodes=256):
    """The paper's interface with bounds and correlation length not known, and joints in newtons."""
    problem = st.paper.problem(nodes=nodes)
    h_n = problem.nucleation_length
    strength = st.paper.strength(problem, correlation_ratio=0.6)
    bounds = {
        "correlation_length": {"low": 0.25 * h_n, "high": 4.0 * h_n, "spacing": "log"},
        "marginal.low": (0.4e6, 0.9e6),
        "marginal.high": (1.2e6, 2.2e6),
    }
    drive = st.Pusher(height=0.02, width=0.01, stiffness=2e7)
    blocks = st.Problem(
        st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        st.Interface(0.1, 64),
        st.LinearWeakening(weakening_rate=0.12e12, residual_ratio=0.35),
        specimen=st.Blocks(height=0.05, thickness=0.006, drive=drive),
    )
    weibull = st.RandomField(st.Weibull(mean=1e6, cv=0.25), strength.spectrum)
    mean_and_length = {
        "marginal.mean": (0.7e6, 1.4e6),
        "correlation_length": {"low": 2e-3, "high": 2e-2, "spacing": "log"},
    }
    return {
        "three parameters": Case(problem, strength, bounds, st.LocalCriterion(), error=5e3),
        "blocks behind a pusher, newtons": Case(
            blocks, weibull, mean_and_length, st.Equilibrium(), error=3.0, tests=12, unit="N"
        ),
    }


def ranks(campaigns, case, samples=None, points=POINTS, seed=0):
    """Names of the parameters, and ranks of their true values, (campaigns, parameters)."""
    newtons = case.unit == "N"
    area, variable = (
        (case.problem.area, "critical_force") if newtons else (1.0, "critical_stress")
    )
    prior = make_prior(case.problem, case.random, case.prior)
    simulation = Simulation(case.method, samples, seed=0)
    simulated = make_likelihood(
        prior, simulation, lengths=(None,), error=case.error, variable=variable
    )
    rng = np.random.default_rng(seed)
    truth = rng.random((campaigns, prior.dimension))
    found = np.empty(truth.shape, dtype=int)
    fresh = Simulation(case.method, case.tests, seed=1000 + seed)
    for i, u in enumerate(truth):
        experiments = experiments_at(prior, prior.theta(u[None]), case.method)
        onsets = simulate(experiments, fresh, 256 * (i + 10), "critical_stress")
        measured = area * onsets[0] + case.error * rng.standard_normal(case.tests)
        likelihood = simulated.of(make_peaks(measured, case.unit).values)
        draws = grid_of(likelihood, likelihood.box, points=points).draws(DRAWS, i)
        found[i] = (draws < u).sum(axis=0)
    return prior.names, found


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
        names, found = ranks(options.campaigns, case)
        for own, name in zip(found.T, names, strict=True):
            print(
                f"{title}: {name:20s} chi-square p = {p_value(own):.3f};"
                f" {coverage(own):.1%} in their 90 % intervals", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
