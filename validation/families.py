"""The family of the marginal: how often it is found, and what a design makes of those left.

First, records of 30 and 300 correlation lengths of four truths: how often `st.fit_field` chooses
the true family, and how often its score is within two units of the best. The bound of the
Weibull truth is given to the fit. Second, campaigns of five profiles of the same truths, fitted
without `marginal=`: the stress for a failure probability of 1 % by the fitted field alone and over
equally likely interfaces, and its true probability, whose mean should be 1 %.

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
TARGET, PROFILES, INTERFACES, SAMPLES, KNOWN = 1e-2, 5, 160, 8_000, 100_000
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


def onsets(random, samples, seed):
    """Return sorted onsets, Pa."""
    found = st.monte_carlo(PROBLEM, random, samples=samples, seed=seed, pilot=False, **QUIET)
    return np.sort(found.critical_stress.values)


def design(name, known, seed):
    """Return true probabilities of both stresses for `TARGET`, and these over the right one."""
    records = strength(name, 4e-3).sample(PROBLEM.interface, samples=PROFILES, seed=1000 + seed)
    fit = st.fit_field(
        records, PROBLEM.interface, noise=False, bootstrap=40, seed=seed, progress=False
    )
    both = fit.field, fit.interfaces(INTERFACES, seed)
    stresses = np.array([np.quantile(onsets(one, SAMPLES, 3), TARGET) for one in both])
    chances = np.searchsorted(known, stresses) / known.size
    return *chances, *stresses / np.quantile(known, TARGET)


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
        known = onsets(strength(name, 4e-3), KNOWN, 7)
        rows = np.array([design(name, known, seed) for seed in range(first, first + campaigns)])
        errors = rows.std(axis=0, ddof=1) / campaigns**0.5
        texts = [
            f"{kind} P {100 * rows[:, k].mean():.2f} +- {100 * errors[k]:.2f} %, stress"
            f" {rows[:, 2 + k].mean():.3f} +- {rows[:, 2 + k].std(ddof=1):.3f} of the right one"
            for k, kind in enumerate(("plug-in", "predictive"))
        ]
        print(
            f"{name}: {'; '.join(texts)}, {campaigns} campaigns,"
            f" {time.perf_counter() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
