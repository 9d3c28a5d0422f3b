"""The family of the marginal: how often it is found, and what a design makes of those left.

First, records of 30 and 300 correlation lengths of four truths: how often `st.fit_field` chooses
the true family, and how often its score is within two units of the best. The bound of the
Weibull truth is given to the fit.

Second, campaigns of five profiles of the same truths, fitted without `marginal=`, and the peaks of
twelve tests: the stress for a failure probability of 1 % by the fitted field alone, over equally
likely interfaces, and over these as the peaks weigh them. The true probability at each is known;
its mean over campaigns should be 1 %. A campaign takes six seconds of one core.

Run: ``python validation/families.py [RECORDS [CAMPAIGNS [FIRST]]]``
"""

import sys
import warnings

import numpy as np

import stiction as st
from stiction.inference.estimate import FitSetting, compare, windowed
from stiction.inference.marginal_fit import family_of
from stiction.inference.records import records_of
from stiction.inference.whittle import SpectrumFamily

LENGTH, POINTS = 2e-3, 10  # correlation length (m), and points in it
TRUTHS = {
    "gamma": st.Gamma(mean=1e6, cv=0.3),
    "weibull": st.Weibull(mean=1e6, cv=0.2, low=0.5e6),
    "lognormal": st.Lognormal(mean=1e6, cv=0.3),
    "beta": st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
}
PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 128),
    st.LinearWeakening(weakening_rate=0.25e12),
)
TARGET, PROFILES, TESTS, LISTED = 1e-2, 5, 12, 100
SAMPLES, ALONE, KNOWN = 100, 4_000, 30_000  # onsets of a member, a fitted field, a truth
LOCAL = st.LocalCriterion()
solve = LOCAL.prepare(PROBLEM)


def strength(name, length):
    """Return the true field, with a mean mode: nothing fixes the mean of a sample."""
    return st.RandomField(TRUTHS[name], st.PowerLawSpectrum(length), mean_mode=True)


def score(name, lengths, seed):
    """Return the score of the true family, from one record."""
    nodes = lengths * POINTS
    whole = st.Interface(3 * lengths * LENGTH, 3 * nodes)
    values = strength(name, LENGTH).sample(whole, seed=seed)[0, :nodes]
    interface = st.Interface(lengths * LENGTH, nodes)
    windows, rows = windowed(records_of(values, interface, "strength"), 0)
    bounded = {"type": "weibull", "low": 0.5e6} if name == "weibull" else "weibull"
    ends = (interface.spacing, 2.0 * interface.length)
    settings = [
        FitSetting(windows, family_of(one), SpectrumFamily("power_law", {}, 1.0, 0.0, ends))
        for one in ("lognormal", bounded, "gamma", "beta")
    ]
    found = compare(settings, rows)[1].items()
    return max((own.score for label, own in found if label.startswith(name)), default=-np.inf)


def onsets(field, samples, seed):
    """Return sorted onsets, Pa."""
    profiles = field.sample(PROBLEM.interface, samples=samples, seed=seed)
    return np.sort(solve(PROBLEM.sample(profiles))["critical_stress"])


def shares_of(likely, members):
    """Return the share of each of the different members in a list."""
    number = {field: place for place, field in enumerate(members)}
    counts = np.bincount([number[one.strength] for one in likely], minlength=len(members))
    return counts / counts.sum()


def quantile(found, shares):
    """Return the stress that `TARGET` of the onsets (members, samples) lie below."""
    order = np.argsort(found, axis=None)
    total = np.cumsum(np.repeat(shares / found.shape[1], found.shape[1])[order])
    return found.flat[order[np.searchsorted(total, TARGET)]]


def designs(name, seed):
    """Return the stresses by the fitted field, by profiles, and by profiles and tests, Pa."""
    truth = strength(name, 4e-3)
    records = truth.sample(PROBLEM.interface, samples=PROFILES, seed=1000 + seed)
    fit = st.fit_field(
        records, PROBLEM.interface, noise=False, bootstrap=40, seed=seed, progress=False
    )
    likely = fit.interfaces(LISTED, seed)
    members = list(dict.fromkeys(one.strength for one in likely))
    found = np.stack([onsets(field, SAMPLES, 3) for field in members])
    peaks = onsets(truth, TESTS, 3000 + seed)
    both = st.infer(
        PROBLEM, likely, peaks, method=LOCAL, samples=200, seed=seed, progress=False
    )
    alone = np.quantile(onsets(fit.field, ALONE, 3), TARGET)
    lists = likely, both.interfaces(10 * LISTED, seed)
    return alone, *(quantile(found, shares_of(one, members)) for one in lists)


def main(records=40, campaigns=40, first=0):
    """Print both tables."""
    warnings.simplefilter("ignore")
    for lengths in (30, 300) if records else ():
        for name in TRUTHS:
            own = np.array([score(name, lengths, seed) for seed in range(records)])
            print(
                f"{lengths} lengths, {name}: chosen {np.mean(own == 0.0):.2f}, within two units"
                f" {np.mean(own > -2.0):.2f} of {records}",
                flush=True,
            )
    known = {name: onsets(strength(name, 4e-3), KNOWN, 7) for name in TRUTHS}
    rows = {name: [] for name in TRUTHS}
    for seed in range(first, first + campaigns):
        for name, own in known.items():
            stresses = np.array(designs(name, seed))
            chances = np.searchsorted(own, stresses) / own.size
            rows[name].append([*chances, *stresses / np.quantile(own, TARGET)])
        if (seed + 1 - first) % 5 and seed + 1 - first < campaigns:
            continue
        means = {name: np.array(one) for name, one in rows.items()}
        for name, one in (means | {"all": np.concatenate(list(means.values()))}).items():
            error = one.std(axis=0, ddof=1) / len(one) ** 0.5
            cells = [
                f"{100 * one[:, k].mean():.2f} +- {100 * error[k]:.2f} %" for k in range(3)
            ]
            right = [
                f"{one[:, k].mean():.3f} +- {one[:, k].std(ddof=1):.3f}" for k in (3, 4, 5)
            ]
            print(f"| {name} | {len(one)} | {' | '.join(cells + right)} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
