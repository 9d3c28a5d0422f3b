"""The family of the marginal: how often it is found, and what a design makes of those left.

First, records of 30 and 300 correlation lengths of four truths: how often `st.fit_field` chooses
the true family, and how often its score is within two units of the best. The bound of the
Weibull truth is given to the fit.

Second, campaigns of five profiles of the same truths, fitted without `marginal=`: the stress for a
failure probability of 1 % by the fitted field alone, and over equally likely interfaces. The true
probability at each is known; its mean over campaigns should be 1 %. A row has this for the two, and
the stress over the right one. A campaign takes five seconds of a core, less if the fit is given the
true family, the last argument.

Run: ``python validation/families.py [RECORDS [CAMPAIGNS [FIRST [FAMILY]]]]``
"""

import sys
import warnings
from itertools import repeat

import numpy as np
from decisions import LOCAL, PROBLEM, TARGET, strength

import stiction as st
from stiction.inference import bootstrap
from stiction.inference.estimate import FitSetting, ranking, windowed
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
BOUNDED = {"weibull": {"type": "weibull", "low": 0.5e6}}
PROFILES, LISTED = 5, 100
SAMPLES, ALONE, KNOWN = 100, 4_000, 30_000  # onsets of a member, a fitted field, a truth
bootstrap.at_ends = lambda *_: []  # for intervals alone, which nothing here reads
solve = LOCAL.prepare(PROBLEM)


def score(name, lengths, seed):
    """Return the score of the true family, from one record."""
    nodes = lengths * POINTS
    whole = st.Interface(3 * lengths * LENGTH, 3 * nodes)
    values = strength(TRUTHS[name], LENGTH).sample(whole, seed=seed)[0, :nodes]
    interface = st.Interface(lengths * LENGTH, nodes)
    windows, rows = windowed(records_of(values, interface, "strength"), 0)
    families = dict.fromkeys(("lognormal", "weibull", "gamma", "beta")) | {
        name: BOUNDED.get(name)
    }
    ends = (interface.spacing, 2.0 * interface.length)
    settings = [
        FitSetting(
            windows, family_of(own or one), SpectrumFamily("power_law", {}, 1.0, 0.0, ends)
        )
        for one, own in families.items()
    ]
    found = ranking(settings, rows)[1].items()
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
    """Return the value that so large a share of those of members (members, samples) lies below."""
    order = np.argsort(found, axis=None)
    total = np.cumsum(np.repeat(shares / found.shape[1], found.shape[1])[order])
    return found.flat[order[min(np.searchsorted(total, TARGET), order.size - 1)]]


def campaign(name, seed, **given):
    """Return designs by the fitted field and by profiles, Pa, (2,)."""
    truth = strength(TRUTHS[name], 4e-3)
    records = truth.sample(PROBLEM.interface, samples=PROFILES, seed=1000 + seed)
    fit = st.fit_field(
        records,
        PROBLEM.interface,
        noise=False,
        bootstrap=LISTED,
        seed=seed,
        progress=False,
        **given,
    )
    likely = fit.interfaces(LISTED, seed)
    members = list(dict.fromkeys(one.strength for one in likely))
    # Draws of their own: shared ones would leave the quantile of a hundred.
    own = range(100_000 + 1_000 * seed, 101_000 + 1_000 * seed)
    found = np.stack([onsets(*one) for one in zip(members, repeat(SAMPLES), own, strict=False)])
    alone = np.quantile(onsets(fit.field, ALONE, 3), TARGET)
    return np.array([alone, quantile(found, shares_of(likely, members))])


def print_table(rows):
    """Print means over campaigns, of each truth and of all; those of one seed share draws."""
    everything = [
        tuple(np.mean(part, axis=0) for part in zip(*same, strict=True))
        for same in zip(*rows.values(), strict=True)
    ]
    for name, own in (rows | {"all": everything}).items():
        chances, ratios = (np.array(part) for part in zip(*own, strict=True))
        errors = chances.std(axis=0, ddof=1) / len(own) ** 0.5
        pairs = zip(chances.mean(axis=0), errors, strict=True)
        cells = [f"{100 * mean:.2f} +- {100 * error:.2f} %" for mean, error in pairs]
        pairs = zip(ratios.mean(axis=0), ratios.std(axis=0, ddof=1), strict=True)
        cells += [f"{mean:.3f} +- {spread:.3f}" for mean, spread in pairs]
        print(f"| {name} | {len(own)} | {' | '.join(cells)} |", flush=True)


def main(records=40, campaigns=40, first=0, family=None):
    """Print both tables."""
    warnings.simplefilter("ignore")
    given = {"marginal": BOUNDED.get(family, family)} if family else {}
    truths = [family] if family else TRUTHS
    for lengths in (30, 300) if records else ():
        for name in TRUTHS:
            own = np.array([score(name, lengths, seed) for seed in range(records)])
            print(
                f"{lengths} lengths, {name}: chosen {np.mean(own == 0.0):.2f}, within two units"
                f" {np.mean(own > -2.0):.2f} of {records}",
                flush=True,
            )
    known = {name: onsets(strength(TRUTHS[name], 4e-3), KNOWN, 7) for name in truths}
    rows = {name: [] for name in truths}
    for seed in range(first, first + campaigns):
        for name, own in known.items():
            stresses = campaign(name, seed, **given)
            chances = np.searchsorted(own, stresses) / own.size
            rows[name].append((chances, stresses / np.quantile(own, TARGET)))
        if (seed + 1 - first) % 3 == 0 or seed + 1 == first + campaigns:
            print_table(rows)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]), *sys.argv[4:])
