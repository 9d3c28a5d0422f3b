"""Profiles and peaks joined, in closed form: do intervals hold, by the repetitions of the fit?

Twenty-five independent normal values stand for the profiles. Their mean and deviation, less the
errors of repetitions, are the members of a list, as of `FieldFit.interfaces`. Twelve peaks, normal
with a mean and a deviation in proportion, weigh them. The likelihood is exact, so that what is
left is the number of repetitions.

Run: ``python validation/joined.py [CAMPAIGNS]``
"""

import sys

import numpy as np

VALUES, PEAKS = 25, 12
DEPTH, SPREAD = 1.0, 0.35  # of a peak: deviations below the mean, and deviation over that


def ends(values, weights):
    """Return the 90 % interval of weighted values."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return values[order[np.searchsorted(total, np.array([0.05, 0.95]) * total[-1])]]


def campaign(repetitions, rng):
    """Return whether the mean is held by profiles and by both, and how many members are left."""
    values = rng.standard_normal(VALUES)
    mean, deviation = values.mean(), values.std(ddof=1)
    again = mean + deviation * rng.standard_normal((repetitions, VALUES))
    other = again.std(axis=1, ddof=1)
    means = mean - deviation * (again.mean(axis=1) - mean) / other
    deviations = deviation**2 / other
    peaks = -DEPTH + SPREAD * rng.standard_normal(PEAKS)
    z = (peaks[:, None] - means + DEPTH * deviations) / (SPREAD * deviations)
    likely = np.sum(-0.5 * z**2 - np.log(deviations), axis=0)
    weights = np.exp(likely - likely.max())
    weights /= weights.sum()
    each = [ends(means, own) for own in (np.full(repetitions, 1.0 / repetitions), weights)]
    return *(low < 0.0 < high for low, high in each), 1.0 / np.sum(weights**2)


def main(campaigns=2000):
    """Print a row for each number of repetitions."""
    rng = np.random.default_rng(1)
    for count in (40, 100, 200, 1000):
        rows = np.array([campaign(count, rng) for _ in range(campaigns)])
        profiles, both, _ = rows.mean(axis=0)
        print(f"| {count} | {np.median(rows[:, 2]):.0f} | {profiles:.1%} | {both:.1%} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
