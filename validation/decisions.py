"""Decisions under uncertain parameters: total probability over simulated campaigns.

A campaign draws a truth from the prior that `infer` is given, measures the peaks of 5, 12 or 50
tests of it, estimates its parameters, and designs for a failure probability of 1 %: once for the
estimate alone (plug-in), once for the mean over 30 equally likely interfaces (predictive). The true
failure probability at these stresses is then known. Its mean over the campaigns should be 1 %.
Campaigns of profiles, and of profiles and tests, are in families.py.

Run: ``python validation/decisions.py [CAMPAIGNS [FIGURE.png]]``
"""

import sys
import time
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
    """Return the same after some tests of a truth that is drawn from the prior."""
    rng = np.random.default_rng([seed, 9])
    marginal = beta(*(rng.uniform(*PRIOR[key]) for key in ("marginal.low", "marginal.high")))
    truth = strength(marginal, np.exp(rng.uniform(np.log(2e-3), np.log(1.2e-2))))
    known = onsets(truth, 20_000, 2000 + seed)
    peaks = rng.permutation(onsets(truth, max(TESTS), 1000 + seed))[:tests]
    posterior = st.infer(
        PROBLEM, truth, peaks, prior=PRIOR, method=LOCAL, samples=500, seed=seed, progress=False
    )
    *ends, length = map(posterior.mean, PRIOR)
    alone = strength(beta(*ends), length)
    stresses = [design(one, seed) for one in (alone, posterior.interfaces(INTERFACES, seed))]
    return np.searchsorted(known, stresses) / known.size, stresses, np.quantile(known, TARGET)


def table(name, campaigns, run):
    """Run the campaigns, print the mean true probabilities, and return stresses over the right."""
    start = time.perf_counter()
    rows = [run(seed) for seed in range(campaigns)]
    chances = np.array([row[0] for row in rows])
    errors = chances.std(axis=0, ddof=1) / campaigns**0.5
    shares = np.array([np.array(row[1]) / row[2] for row in rows])
    pairs = zip(chances.mean(axis=0), errors, strict=True)
    texts = [f"{100 * mean:5.2f} +- {100 * error:.2f} %" for mean, error in pairs]
    spread = " and ".join(f"{one.mean():.3f} +- {one.std(ddof=1):.3f}" for one in shares.T)
    print(
        f"{name:15s} true P of a design for 1 %: plug-in {texts[0]}, predictive {texts[1]};"
        f" stress over the right one {spread} ({time.perf_counter() - start:.0f} s)",
        flush=True,
    )
    return shares


def figure(path, shares):
    """Draw design stresses over the right one, plug-in and predictive, by number of tests."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(4.6, 3.0), layout="constrained")
    axes = drawn.subplots()
    axes.axhline(1.0, color="0.4", linewidth=0.7, linestyle=":")
    kinds = (("plug-in", "#b5322a", "^", -0.15), ("predictive", "#14213d", "o", 0.15))
    for column, (kind, colour, marker, shift) in enumerate(kinds):
        for place, tests in enumerate(TESTS):
            own = shares[tests][:, column]
            x = place + shift + np.linspace(-0.08, 0.08, own.size)
            axes.plot(x, own, marker, color=colour, markersize=2.5, alpha=0.7,
                      label=kind if place == 0 else None)  # fmt: skip
            axes.plot(place + shift + np.array([-0.12, 0.12]), [own.mean()] * 2, color=colour)
    axes.set_xticks(range(len(TESTS)), [f"{tests} tests" for tests in TESTS])
    axes.set_ylabel("design stress / right one")
    axes.legend(frameon=False)
    drawn.savefig(path, dpi=130)


def main(campaigns=20, path=None):
    """Print the table, and draw the figure if it has a path."""
    warnings.simplefilter("ignore")
    shares = {}
    for tests in TESTS:
        shares[tests] = table(
            f"{tests} tests", campaigns, lambda seed, n=tests: by_tests(n, seed)
        )
    if path:
        figure(path, shares)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]), *sys.argv[2:3])
