"""Are posteriors calibrated? Ranks of the truth over many simulated campaigns, and coverage.

Simulation-based calibration (Talts et al., 2018): parameters from the prior, 25 peaks from them by
fresh samples and a load cell's error, and the rank of each true parameter among 99 draws from its
posterior. The ranks must be uniform. Draws inference_calibration.png into a folder.

    python validation/inference.py [folder [campaigns]]
"""

import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import scipy.stats

import stiction as st
from stiction.progress import SILENT
from stiction.inference.grid import on_grid
from stiction.inference.likelihood import make_likelihood, make_model
from stiction.inference.onset_table import simulate
from stiction.inference.prior import make_prior

DRAWS, BINS, TESTS = 99, 10, 25
ERROR = 5e3
"""Standard deviation of the load cell, Pa."""
POINTS = 30**3


def setting(nodes=256):
    """The prior: bounds of the strength and its correlation length."""
    problem = st.paper.problem(nodes=nodes)
    h_n = problem.nucleation_length
    strength = st.paper.strength(problem, correlation_ratio=0.6)
    prior = {
        "correlation_length": {"low": 0.25 * h_n, "high": 4.0 * h_n, "spacing": "log"},
        "marginal.low": (0.4e6, 0.9e6),
        "marginal.high": (1.2e6, 2.2e6),
    }
    return make_prior(problem, strength, prior)


def ranks(campaigns, tests=TESTS, seed=0, samples=2000, points=POINTS):
    """Ranks of the truth, and the truth and the posterior means as u, (campaigns, parameters)."""
    prior, method = setting(), st.LocalCriterion()
    common = {"method": method, "variable": "critical_stress", "meter": SILENT}
    model = make_model(prior, lengths=[None], error=ERROR, samples=samples, seed=0, **common)
    rng = np.random.default_rng(seed)
    truth = rng.random((campaigns, prior.dimension))
    found, means = np.empty(truth.shape, dtype=int), np.empty(truth.shape)
    for i, u in enumerate(truth):
        peaks, _ = simulate(
            prior, prior.theta(u[None]), length=None, samples=tests, first=256 * (i + 10),
            seed=1000 + seed, **common,
        )  # fmt: skip
        peaks = peaks[0] + ERROR * rng.standard_normal(tests)
        draws = on_grid(make_likelihood(model, [peaks], [None]), SILENT, points).draws(DRAWS, i)
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


def main(folder=".", campaigns=100):
    """Print p-values and coverage, and draw the ranks."""
    warnings.simplefilter("ignore", st.AccuracyWarning)
    names, found, *_ = ranks(int(campaigns))
    figure, axes = plt.subplots(1, len(names), figsize=(9, 2.6), layout="constrained")
    low, high = scipy.stats.binom.ppf([0.005, 0.995], int(campaigns), 1.0 / BINS)
    for own, name, ax in zip(found.T, names, axes, strict=True):
        p, share = p_value(own), coverage(own)
        print(f"{name:20s} chi-square p = {p:.3f}; {share:.1%} in their 90 % intervals")
        ax.hist(own, bins=BINS, range=(0, DRAWS + 1), color="#14213d", rwidth=0.92)
        ax.axhspan(low, high, color="#d9d9d9", zorder=0)
        ax.set(xlabel=f"rank of the true {name}", ylabel="campaigns")
        ax.set_title(f"p = {p:.2f}, coverage {share:.0%}", fontsize=9, loc="left")
        ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(Path(folder) / "inference_calibration.png", dpi=130)


if __name__ == "__main__":
    main(*sys.argv[1:])
