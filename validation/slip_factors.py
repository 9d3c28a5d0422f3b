"""Slip factors from five specimens with two slip loads each: promised and true probability.

Problem. Specimen k has the slip factor m b_k, and its two slip loads scatter by 2 % about it. The
factor b has mean 1 and a coefficient of variation of 6 % between specimens. A joint is a new
specimen. How often does a design fail, and what do the values of the standards promise?

Steps, for each truth of b and each campaign:

1. Draw b of five specimens, and two slip loads of each.
2. Take the mean of each specimen, and its error from the pooled scatter of repeated slip loads.
3. Compute the design by the average over families, as in `stiction.inference.specimens`, in closed
   form: the likelihood of a mean is the density of log b smoothed by its error.
4. Compute the true probability below this design, and below the values of the standards.

Run: ``python validation/slip_factors.py [CAMPAIGNS [SEED]]``
"""

import sys

import numpy as np
from design_force_closed import X, law, smoothed

from stiction.inference.standards import fractile_factor

SPECIMENS, LOADS, BETWEEN, WITHIN = 5, 2, 0.06, 0.02
PROMISED = np.array([1e-2, 1e-3])
PRIOR_SCALE, WIDEST, CELLS = 0.1, 0.9, 40
CVS = PRIOR_SCALE * np.tan((np.arange(CELLS) + 0.5) / CELLS * np.arctan(WIDEST / PRIOR_SCALE))
FAMILIES = "lognormal", "normal", "weibull"
TRUTHS = "lognormal", "normal", "gamma", "weibull", "two batches"
ERRORS = 0.004 * 1.35 ** np.arange(9)  # of a mean; the nearest in the logarithm is taken
MEANS = np.arange(-0.3, 0.3, 0.01)
AT = np.linspace(-1.2, 0.3, 601)  # logarithm of a design over the mean of the specimens


def tables():
    """Return log densities (errors, families, cvs, X), and chances (families, cvs, means, AT)."""
    of_b = np.array([[smoothed(name, CVS, error) for name in FAMILIES] for error in ERRORS])
    with np.errstate(over="ignore"):
        below = np.array(
            [
                [law(name, cv).cdf(np.exp(AT - MEANS[:, None])) for cv in CVS]
                for name in FAMILIES
            ]
        )
    return of_b, below


def factors(truth, count, rng):
    """Draw factors of a truth, with mean 1."""
    if truth == "two batches":
        apart = np.sqrt((BETWEEN**2 - 0.02**2) / (0.25 * 0.75))
        means = np.where(rng.random(count) < 0.25, 1.0 - 0.75 * apart, 1.0 + 0.25 * apart)
        return means * (1.0 + 0.02 * rng.standard_normal(count))
    return law(truth, BETWEEN).rvs(count, random_state=rng)


def designs(loads, of_b, below):
    """Return designs at PROMISED by each family and by the average, {name: (2,)} (2, 3)."""
    means = loads.mean(axis=1)
    error = np.sqrt(np.sum((loads / means[:, None] - 1.0) ** 2) / SPECIMENS / LOADS)
    table = of_b[np.argmin(np.abs(np.log(ERRORS / max(error, 1e-9))))]
    centre = np.log(means).mean()
    place = (np.log(means) - centre - MEANS[:, None] - X[0]) / (X[1] - X[0])
    number = place.astype(int)
    share = place - number
    logs = (1.0 - share) * table[..., number] + share * table[..., number + 1]
    total = logs.sum(axis=-1)  # (families, cvs, means)
    weight = np.exp(total - total.max())
    curves = np.einsum("fcm,fcma->fa", weight, below)
    mass = weight.sum(axis=(1, 2))
    shares = dict(zip(FAMILIES, curves / mass[:, None], strict=True))
    shares["average"] = curves.sum(axis=0) / mass.sum()
    return {name: np.exp(centre + np.interp(PROMISED, c, AT)) for name, c in shares.items()}


def by_standards(loads):
    """Return values of the standards with the probability that they promise."""
    values, means = loads.ravel(), loads.mean(axis=1)

    def value(of, factor):
        return of.mean() - factor * of.std(ddof=1)

    return {
        "EN 1990 characteristic, ten loads": (value(values, fractile_factor(10)), 0.05),
        "EN 1990 characteristic, five means": (value(means, fractile_factor(5)), 0.05),
        "EN 1090-2, mean less 2.05 s": (value(values, 2.05), 0.05),
        "EN 1990 design, ten loads": (value(values, fractile_factor(10, 1e-3)), 1e-3),
        "EN 1990 design, five means": (value(means, fractile_factor(5, 1e-3)), 1e-3),
    }


def main(campaigns=400, seed=1):
    """Print true over promised probabilities, and designs over those that know the family."""
    of_b, below = tables()
    for truth in TRUTHS:
        rng = np.random.default_rng([seed, TRUTHS.index(truth)])
        known = np.sort(factors(truth, 2_000_000, rng))
        rows, ratios = {}, []
        for _ in range(campaigns):
            scatter = 1.0 + WITHIN * rng.standard_normal((SPECIMENS, LOADS))
            loads = factors(truth, SPECIMENS, rng)[:, None] * scatter
            found = designs(loads, of_b, below)
            named = {
                f"families averaged, {p:g}": (found["average"][k], p)
                for k, p in enumerate(PROMISED)
            }
            for name, (stress, chance) in (named | by_standards(loads)).items():
                true = np.searchsorted(known, stress) / known.size
                rows.setdefault(name, []).append((true / chance, stress))
            if truth in FAMILIES:
                ratios.append(found["average"][1] / found[truth][1])
        for name, pairs in rows.items():
            ratio, stress = np.array(pairs).T
            error = ratio.std(ddof=1) / np.sqrt(campaigns)
            shown = f"{ratio.mean():.2f} ± {error:.2f} | {np.median(stress):.3f}"
            print(f"| {truth} | {name} | {shown} |", flush=True)
        if ratios:
            print(
                f"| {truth} | median force over a known family, 1e-3 | {np.median(ratios):.3f} | |"
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
