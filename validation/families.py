"""The family of the marginal: how often it is found, and what a design makes of those left.

First, records of 30 and 300 correlation lengths of four truths: how often `st.fit_field` chooses
the true family, and how often its score is within two units of the best. The bound of the
Weibull truth is given to the fit. Second, campaigns of five profiles of the same truths, fitted
without `marginal=`: the stress for a failure probability of 1e-3 over equally likely interfaces,
and its true probability, whose mean should be 1e-3.

Run: ``python validation/families.py [RECORDS [CAMPAIGNS [FIRST]]]``
"""

import sys
import time
import warnings

import numpy as np

import stiction as st

LENGTH, POINTS = 2e-3, 10  # correlation length (m), and points in it
TRUTHS = {
    "weibull": st.Weibull(mean=1e6, cv=0.2, low=0.5e6),
    "gamma": st.Gamma(mean=1e6, cv=0.3),
    "lognormal": st.Lognormal(mean=1e6, cv=0.3),
    "beta": st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
}
PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 128),
    st.LinearWeakening(weakening_rate=0.25e12),
)
TARGET, PROFILES, INTERFACES, KNOWN = 1e-3, 5, 100, 100_000
QUIET = {"method": st.LocalCriterion(), "progress": False}


def strength(name, length):
    """Return the true field, with a mean mode: nothing fixes the mean of a sample."""
    return st.RandomField(TRUTHS[name], st.PowerLawSpectrum(length), mean_mode=True)


def scores(name, lengths, seed):
    """Return the score of the true family, from one record."""
    nodes = lengths * POINTS
    whole = st.Interface(3 * lengths * LENGTH, 3 * nodes)
    values = strength(name, LENGTH).sample(whole, seed=seed)[0, :nodes]
    bounded = {"type": "weibull", "low": 0.5e6} if name == "weibull" else "weibull"
    fit = st.fit_field(
        values, st.Interface(lengths * LENGTH, nodes), noise=False, bootstrap=20, seed=seed,
        marginal=["lognormal", bounded, "gamma", "beta"], progress=False,
    )  # fmt: skip
    return max(
        (s.score for n, s in fit.families.items() if n.startswith(name)), default=-np.inf
    )


def design(name, known, seed):
    """Return the true probability of the stress for `TARGET` after some profiles, and its ratio."""
    records = strength(name, 4e-3).sample(PROBLEM.interface, samples=PROFILES, seed=1000 + seed)
    fit = st.fit_field(
        records, PROBLEM.interface, noise=False, bootstrap=40, seed=seed, progress=False
    )
    found = st.design_stress(
        PROBLEM, fit.interfaces(INTERFACES, seed), probability=TARGET, target_cv=0.2, seed=seed,
        **QUIET,
    )  # fmt: skip
    return np.searchsorted(known, found.stress) / known.size, found.stress


def main(records=40, campaigns=40, first=0):
    """Print both tables."""
    warnings.simplefilter("ignore")
    for lengths in (30, 300) if records else ():
        for name in TRUTHS:
            own = np.array([scores(name, lengths, seed) for seed in range(records)])
            print(
                f"{lengths} lengths, {name}: chosen {np.mean(own == 0.0):.2f}, within two units"
                f" {np.mean(own > -2.0):.2f}",
                flush=True,
            )
    for name in TRUTHS if campaigns else ():
        start = time.perf_counter()
        onsets = st.monte_carlo(
            PROBLEM, strength(name, 4e-3), samples=KNOWN, seed=7, pilot=False, **QUIET
        )
        known = np.sort(onsets.critical_stress.values)
        rows = [design(name, known, seed) for seed in range(first, first + campaigns)]
        chances, stresses = np.transpose(rows) / [[TARGET], [np.quantile(known, TARGET)]]
        print(
            f"{name}: true probability over {TARGET:g} {chances.mean():.2f} +-"
            f" {chances.std(ddof=1) / campaigns**0.5:.2f} (median {np.median(chances):.2f}), stress"
            f" over the right one {stresses.mean():.3f} +- {stresses.std(ddof=1):.3f},"
            f" {campaigns} campaigns, {time.perf_counter() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
