"""Design force from few specimens, in closed form: promised and true failure probability.

Problem. Specimen k has a factor b_k of mean 1 and coefficient of variation s. Measured are levels
of profiles, L_j = m b_j (1 + e_j), and peaks, P_k = m b_k R. Here the logarithms of 1 + e, which
has mean 1, and of R are normal with known deviations, so that nothing is simulated. Unknown are m,
s and the family of b. The design is the stress that a further peak falls below with the promised
probability, under the posterior.

Steps, as in `stiction.inference.specimens`, but for arrays of its own:

1. Take a grid of log m, and a grid of s at equal shares of the half-Cauchy prior.
2. The density of log b convolved with the normal density of log(1 + e), or of log R, is the density
   of log L - log m, or of log P - log m. The first is a product of characteristic functions here.
3. The likelihood at (m, s) is the product over levels and peaks.
4. The predictive distribution function of a further peak is the mean over the posterior.

Truths of b have s = 0.08: log-normal, Weibull, gamma, normal, two batches of 25 and 75 %, and an
exponential lower tail. A rare batch of 5 % is weaker by a quarter. Right designs are quantiles.

Run: ``python validation/design_force_closed.py [CAMPAIGNS [SEED]]``
"""

import sys

import numpy as np
import scipy.stats
from scipy.optimize import brentq
from scipy.special import gammaln

LEVELS, PEAKS, SCATTER = 5, 8, 0.08
OF_LEVEL, OF_PEAK = 0.03, 0.05  # deviations of log(1 + e) and of log R
PROMISED = (1e-2, 1e-3)
PRIOR_SCALE, WIDEST = 0.1, 0.9
STEP = 0.004
X = STEP * np.arange(-1024, 1024)  # of log b and of what is convolved with it


def above_zero(cv):
    """Return a normal distribution above zero, of mean 1 and deviation cv after truncation."""
    if cv < 0.15:  # what is cut off is below 1e-10
        return scipy.stats.truncnorm(-1.0 / cv, np.inf, 1.0, cv)

    def parent(low):  # scaled to mean 1
        mean = scipy.stats.truncnorm.mean(low, np.inf, -low)
        return scipy.stats.truncnorm(low, np.inf, -low / mean, 1.0 / mean)

    return parent(brentq(lambda low: parent(low).std() - cv, -8.0, 8.0))


def law(family, cv):
    """Return the distribution of a factor of mean 1."""
    if family == "lognormal":
        sigma = np.sqrt(np.log1p(cv**2))
        return scipy.stats.lognorm(sigma, scale=np.exp(-0.5 * sigma**2))
    if family == "gamma":
        return scipy.stats.gamma(cv**-2, scale=cv**2)
    if family == "normal":
        return above_zero(cv)
    shape = np.exp(
        brentq(
            lambda k: (
                gammaln(1 + 2 * np.exp(-k)) - 2 * gammaln(1 + np.exp(-k)) - np.log1p(cv**2)
            ),
            -2.0,
            8.0,
        )
    )
    return scipy.stats.weibull_min(shape, scale=np.exp(-gammaln(1.0 + 1.0 / shape)))


def factors(truth, count, rng):
    """Draw factors of a truth."""
    if truth == "two batches":  # two narrow ones: 25 % are weak
        apart = SCATTER / np.sqrt(0.25 * 0.75)
        means = np.where(rng.random(count) < 0.25, 1.0 - 0.75 * apart, 1.0 + 0.25 * apart)
        return means * (1.0 + 0.02 * rng.standard_normal(count))
    if truth == "lower tail":
        return 1.0 + SCATTER * (1.0 - rng.standard_exponential(count))
    if truth == "rare batch":  # beside a normal scatter of 5.8 %
        means = np.where(rng.random(count) < 0.05, 0.75, 1.0) / 0.9875
        return means * (1.0 + 0.058 * rng.standard_normal(count))
    return law(truth, SCATTER).rvs(count, random_state=rng)


def smoothed(family, cvs, deviation):
    """Return log densities of log b + a normal number of this deviation at X, (cvs, X)."""
    ends = np.append(X - 0.5 * STEP, X[-1] + 0.5 * STEP)
    with np.errstate(over="ignore"):  # powers of values far above the mean
        mass = np.array([np.diff(law(family, cv).cdf(np.exp(ends))) for cv in cvs])
    away = np.fft.fftfreq(X.size, STEP)
    kernel = np.exp(-2.0 * (np.pi * deviation * away) ** 2)
    found = np.fft.ifft(np.fft.fft(mass, axis=1) * kernel, axis=1).real
    return np.log(np.maximum(found, 1e-12) / STEP)


CVS = PRIOR_SCALE * np.tan((np.arange(64) + 0.5) / 64 * np.arctan(WIDEST / PRIOR_SCALE))
FAMILIES = ("lognormal", "normal", "weibull")
DENSITIES = {
    family: [smoothed(family, CVS, deviation) for deviation in (OF_LEVEL, OF_PEAK)]
    for family in FAMILIES
}
BELOW = {f: np.cumsum(np.exp(own[1]), axis=1) * STEP for f, own in DENSITIES.items()}


def posterior(levels, peaks):
    """Return a grid of log m, and the posterior of s and m for each family, {name: (cvs, m)}."""
    centre = np.mean(np.log(np.concatenate([levels, peaks])))
    mean = centre + np.arange(-1.2, 1.2, 0.01)
    parts = {}
    for family, (of_level, of_peak) in DENSITIES.items():
        total = np.zeros((CVS.size, mean.size))
        own = (np.log(levels) + 0.5 * OF_LEVEL**2, of_level), (np.log(peaks), of_peak)
        for values, table in own:
            for value in values:
                place = value - mean
                total += np.array([np.interp(place, X, row) for row in table])
        parts[family] = total
    top = max(part.max() for part in parts.values())
    weights = {family: np.exp(part - top) for family, part in parts.items()}
    total = sum(own.sum() for own in weights.values())
    return mean, {family: own / total for family, own in weights.items()}


def designs(levels, peaks, promised=PROMISED):
    """Return designs by each family and by their average, {name: (promised,)}, and intervals.

    Intervals are of 90 %, of mean and scatter by the average, (2, 2).
    """
    mean, weights = posterior(levels, peaks)
    centre = mean.mean()
    at = centre + np.linspace(-2.5, 0.5, 3001)
    curves = {}
    for family in FAMILIES:
        w = weights[family]
        found = np.zeros(at.size)
        for place, own in zip(mean, w.T, strict=True):
            if own.sum() > 1e-9:
                found += np.interp(at - place, X, own @ BELOW[family])
        curves[family] = found / w.sum(), w.sum()
    curves["average"] = sum(c * e for c, e in curves.values()), 1.0
    total = sum(weights.values())
    of_mean, of_scatter = np.cumsum(total.sum(axis=0)), np.cumsum(total.sum(axis=1))
    ends = [
        np.exp(np.interp([0.05, 0.95], of_mean, mean + 0.005)),
        np.interp([0.05, 0.95], of_scatter - 0.5 * np.diff(of_scatter, prepend=0.0), CVS),
    ]
    return {n: np.exp(np.interp(promised, c, at)) for n, (c, _) in curves.items()}, ends


def student(values):
    """Return the designs by Student's t on the logarithms of some numbers."""
    logs = np.log(values)
    t = scipy.stats.t.ppf(PROMISED, logs.size - 1) * np.sqrt(1.0 + 1.0 / logs.size)
    return np.exp(logs.mean() + t * logs.std(ddof=1))


def main(campaigns=150, seed=1):
    """Print true over promised probabilities, designs over the right ones, intervals that hold."""
    rng = np.random.default_rng(seed)
    names = "lognormal", "weibull", "gamma", "normal", "two batches", "lower tail", "rare batch"
    for truth in names:
        spread = np.exp(OF_PEAK * rng.standard_normal(2_000_000))
        known = np.sort(factors(truth, 2_000_000, rng) * spread)
        right = np.quantile(known, PROMISED)
        rows = {}
        for _ in range(campaigns):
            errors = OF_LEVEL * rng.standard_normal(LEVELS) - 0.5 * OF_LEVEL**2
            levels = factors(truth, LEVELS, rng) * np.exp(errors)
            peaks = factors(truth, PEAKS, rng) * np.exp(OF_PEAK * rng.standard_normal(PEAKS))
            for name, data in (
                ("profiles", (levels, peaks[:0])), ("both", (levels, peaks)),
                ("tests", (levels[:0], peaks)),
            ):  # fmt: skip
                found, ends = designs(*data)
                inside = [
                    low < value < high
                    for (low, high), value in zip(ends, (1.0, SCATTER), strict=True)
                ]
                rows.setdefault(f"{name}, average", []).append([found["average"], inside])
                if name == "both":
                    own = [found["lognormal"], [False, False]]
                    rows.setdefault("both, log-normal", []).append(own)
            every = np.concatenate([levels, peaks])
            rows.setdefault("both, Student's t", []).append([student(every), [False, False]])
            rows.setdefault("tests, Student's t", []).append([student(peaks), [False, False]])
        for name, own in rows.items():
            stresses = np.array([row[0] for row in own])
            chance = np.searchsorted(known, stresses) / known.size / PROMISED
            error = chance.std(axis=0, ddof=1) / np.sqrt(campaigns)
            means, ratio = chance.mean(axis=0), (stresses / right).mean(axis=0)
            cells = [f"{means[k]:.2f} ± {error[k]:.2f} ({ratio[k]:.2f})" for k in (0, 1)]
            held = np.mean([row[1] for row in own], axis=0)
            cells += [f"{share:.0%}" if "average" in name else "" for share in held]
            print(f"| {truth} | {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
