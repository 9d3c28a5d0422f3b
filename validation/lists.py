"""Lists of equally likely interfaces: does the interval of a design hold the error of the list?

First, the strength at one place is normal about a mean that is as uncertain as it scatters, so that
the design stress for 1e-3 is known (tests/exact/test_reliability_linear.py). Intervals are of lists
of 30 and 300, and of the source itself, with one seed after the other: 85 to 95 % or more of them
should hold that stress.

Second, the source is a fit of five profiles of as many specimens. The right stress is the mean of
lists of 5,000; members have a closed probability of failure at one place, so that the interval
holds the error of the list alone.

Run: ``python validation/lists.py [SEEDS]``
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.stats import norm

import stiction as st
from stiction.reliability.uncertainty import log_width

TESTS = Path(__file__).parents[1] / "tests"
sys.path += [str(TESTS), str(TESTS / "exact")]
from crooked import LINE  # noqa: E402
from test_reliability_linear import AtOnePlace, UnknownMean  # noqa: E402

PROBABILITY, UNKNOWN = 1e-3, 30e3
LONG, LISTS = 1_000, (30, 100, 300, 1_000)
LOGS = np.linspace(np.log(0.1e6), np.log(0.9e6), 60)  # of stresses, Pa
SHARES = (np.arange(41) + 0.5) / 41  # of factors between specimens


def of_unknown_mean(seeds):
    """Print a row for each list."""
    source = UnknownMean(UNKNOWN)
    exact = 1.1e6 + np.hypot(30e3, UNKNOWN) * norm.ppf(PROBABILITY)
    options = {"probability": PROBABILITY, "target_cv": 0.2, "progress": False}
    print("| list | inside | scatter % |")
    for count in (30, 300, None):
        inside, found = 0, []
        for seed in range(seeds):
            random = source if count is None else source.interfaces(count, seed=seed)
            answer = st.design_stress(LINE, random, method=AtOnePlace(), seed=seed, **options)
            inside += answer.interval[0] <= exact <= answer.interval[1]
            found.append(answer.stress / exact)
        scatter = 100.0 * np.std(found)
        print(f"| {count or 'source'} | {inside} of {seeds} | {scatter:.2f} |", flush=True)


def fit_of_five():
    """Return the fit of profiles that scatter by 6 % between specimens."""
    field = st.RandomField(
        st.Gamma(mean=1e6, cv=0.2), st.PowerLawSpectrum(LINE.interface.length / 12), True
    )
    records = field.sample(LINE.interface, samples=5, seed=100)
    factors = np.exp(0.06 * np.random.default_rng(50).standard_normal(5))
    families = ["lognormal", "gamma"]
    return st.fit_field(
        records * factors[:, None], LINE.interface, marginal=families, between=True, noise=False
    )


def chances(members):
    """Return the probability of each member at all stresses, (members, stresses)."""
    found = []
    for one in members:
        factors = one.between["strength"].distribution.ppf(SHARES)
        places = np.exp(LOGS)[:, None] / factors
        found.append(one.strength.marginal.distribution.cdf(places).mean(axis=1))
    return np.array(found)


def quantile(mean, probability):
    """Return the logarithm of the stress at which a mean over members has a probability."""
    return np.interp(np.log(probability), np.log(mean), LOGS)


def of_fit(seeds):
    """Print a row for each length of the list."""
    fit = fit_of_five()
    long = [chances(fit.interfaces(5_000, 1_000 + k)).mean(axis=0) for k in range(2)]
    right = np.mean([quantile(own, PROBABILITY) for own in long])
    rows = {count: [] for count in LISTS}
    for seed in range(seeds):
        whole = chances(fit.interfaces(LONG, seed))
        for count, row in rows.items():
            own = whole[:count]
            mean = own.mean(axis=0)
            stress = quantile(mean, PROBABILITY)
            shares = np.array([np.interp(stress, LOGS, one) for one in own])
            shares /= shares.sum()
            width = log_width(np.sqrt(np.sum(shares**2) - 1.0 / count))
            ends = [quantile(mean, PROBABILITY * np.exp(s * width)) for s in (-1.0, 1.0)]
            row.append((ends[0] <= right <= ends[1], stress - right))
    print("| list of a fit | inside | scatter % |")
    for count, row in rows.items():
        inside, away = np.transpose(row)
        print(f"| {count} | {inside.sum():.0f} of {seeds} | {100.0 * away.std():.1f} |")


def main(seeds=20):
    """Print both tables."""
    warnings.simplefilter("ignore")
    of_fit(seeds)
    of_unknown_mean(seeds)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
