"""Decisions under uncertain parameters: total probability over simulated campaigns.

A campaign draws a truth from the prior that `infer` is given, measures the peaks of 5, 12 or 50
tests of it, estimates its parameters, and designs for a failure probability of 1 %: once for the
estimate alone (plug-in), once for the mean over 30 equally likely interfaces (predictive). The true
failure probability at these stresses is then known. Its mean over the campaigns should be 1 %.
Campaigns of profiles, and of profiles and tests, are in families.py.

Run: ``python validation/decisions.py [CAMPAIGNS]``
"""

import sys
import warnings

import numpy as np

import stiction as st

LOCAL = st.LocalCriterion()
PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 128),
    st.LinearWeakening(weakening_rate=0.25e12),
)
TARGET, INTERFACES, TESTS = 0.01, 30, (5, 12, 50)
PRIOR = {
    "marginal.low": (0.5e6, 0.8e6),
    "marginal.high": (1.3e6, 2.1e6),
    "correlation_length": {"low": 2e-3, "high": 1.2e-2, "spacing": "log"},
}
QUIET = {"method": LOCAL, "progress": False, "workers": 1}


def strength(marginal, correlation_length):
    """Return a strength with a mean mode: nothing fixes the mean of a sample."""
    return st.RandomField(marginal, st.PowerLawSpectrum(correlation_length), mean_mode=True)


def beta(low, high):
    """Return a marginal of the prior."""
    return st.Beta(alpha=1.5, beta=3.0, low=low, high=high)


def onsets(field, samples, seed):
    """Return sorted onsets, Pa."""
    found = st.monte_carlo(PROBLEM, field, samples=samples, seed=seed, pilot=False, **QUIET)
    return np.sort(found.critical_stress.values)


def design(random, seed):
    """Return the stress for 1 %, Pa."""
    options = QUIET | {"target_cv": 0.25, "seed": seed}
    return st.design_stress(PROBLEM, random, probability=TARGET, **options).stress


def by_tests(tests, seed):
    """Return true probabilities at both stresses, by some tests."""
    rng = np.random.default_rng([seed, 9])
    marginal = beta(*(rng.uniform(*PRIOR[key]) for key in ("marginal.low", "marginal.high")))
    truth = strength(marginal, np.exp(rng.uniform(np.log(2e-3), np.log(1.2e-2))))
    known = onsets(truth, 20_000, 2000 + seed)
    peaks = rng.permutation(onsets(truth, max(TESTS), 1000 + seed))[:tests]
    options = {"prior": PRIOR, "method": LOCAL, "samples": 500, "seed": seed, "progress": False}
    posterior = st.infer(PROBLEM, truth, peaks, unit="Pa", **options)
    *ends, length = map(posterior.mean, PRIOR)
    alone = strength(beta(*ends), length)
    stresses = [design(one, seed) for one in (alone, posterior.interfaces(INTERFACES, seed))]
    return np.searchsorted(known, stresses) / known.size


def main(campaigns=20):
    """Print mean true probabilities."""
    warnings.simplefilter("ignore")
    for tests in TESTS:
        chances = np.array([by_tests(tests, seed) for seed in range(campaigns)])
        errors = chances.std(axis=0, ddof=1) / campaigns**0.5
        for place, name in enumerate(("plug-in", "predictive")):
            print(
                f"{tests} tests, {name}: true P of a design for 1 %"
                f" {100 * chances[:, place].mean():.2f} +- {100 * errors[place]:.2f} %",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
