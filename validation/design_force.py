"""Design force from five profiles and eight tests: promised and true failure probability.

A campaign draws specimens of a truth with a factor between them (coefficient of variation 0.08)
and a gamma field within: the profiles of five, and the peaks of eight others. The field within is
fitted, the posterior is `st.infer`'s, and the design is the quantile of its predictive
distribution. The true failure probability at the design is the mean of the law of the factor over
20,000 onsets of the field within.

Rows are by profiles alone, by both, by tests alone (the field within is known), and by Student's t
on the logarithms of the eight tests. A row has the mean of the true over the promised probability
with its error, and the mean of the design over the right one, for 1e-2 and 1e-3; and how many of
the 90 % intervals hold the true mean and scatter. Seeds are independent; nothing is tuned.

Run: ``python validation/design_force.py OUT.csv [CAMPAIGNS [FIRST [equilibrium]]]``; results are
appended to the file. ``python validation/design_force.py OUT.csv`` prints the table.
"""

import csv
import sys
import warnings
from pathlib import Path

import numpy as np
import scipy.stats
from design_force_closed import SCATTER, factors, law, student

import stiction as st
from stiction.inference import bootstrap
from stiction.inference.specimens import Prediction

PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 128),
    st.LinearWeakening(weakening_rate=0.25e12),
)
WITHIN = st.RandomField(st.Gamma(mean=1e6, cv=0.25), st.PowerLawSpectrum(4e-3), mean_mode=True)
PROFILES, TESTS = 5, 8
PROMISED = np.array([1e-2, 1e-3])
TRUTHS = ("lognormal", "weibull", "gamma", "normal", "two batches")
METHODS = ("profiles", "both", "tests", "student")
bootstrap.at_ends = lambda *_: []  # for intervals alone of the fit, which nothing here reads


def onsets(method, samples, seed):
    """Return onsets of the field within, without a factor."""
    found = st.monte_carlo(
        PROBLEM, WITHIN, method=method, samples=samples, seed=seed, pilot=False, progress=False
    )
    return found.critical_stress.values


def below(truth, stresses, ratios):
    """Return the true probability of an onset below each stress."""
    if truth != "two batches":
        laws = {law(truth, SCATTER): 1.0}
    else:
        apart = SCATTER / np.sqrt(0.25 * 0.75)
        means = {1.0 - 0.75 * apart: 0.25, 1.0 + 0.25 * apart: 0.75}
        laws = {scipy.stats.norm(mean, 0.02 * mean): share for mean, share in means.items()}
    return np.array(
        [
            sum(share * own.cdf(stress / ratios) for own, share in laws.items()).mean()
            for stress in stresses
        ]
    )


def right_designs(truth, ratios):
    """Return the stresses of the promised probabilities, by linear interpolation of logarithms."""
    levels = np.linspace(0.3, 1.2, 1801) * 1e6
    logs = np.log(below(truth, levels, ratios) + 1e-300)
    return np.exp(np.interp(np.log(PROMISED), logs, np.log(levels)))


def campaign(truth, seed, method):
    """Return designs by method, (methods, promised), and whether intervals hold, (methods, 2)."""
    rng = np.random.default_rng([seed, TRUTHS.index(truth), 63])
    own = factors(truth, PROFILES + TESTS, rng)
    first = int(rng.integers(2**31))
    records = WITHIN.sample(PROBLEM.interface, samples=PROFILES, seed=first)
    records = records * own[:PROFILES, None]
    peaks = onsets(method, TESTS, first + 1) * own[PROFILES:]
    fit = st.fit_field(
        records, PROBLEM.interface, marginal="gamma", noise=False, between=True, bootstrap=20,
        seed=seed, progress=False,
    )  # fmt: skip
    options = {"method": method, "seed": seed, "progress": False}
    both = st.infer(PROBLEM, fit, peaks, **options)
    tests = st.infer(PROBLEM, WITHIN, peaks, samples=1000, **options)
    designs, held = [], []
    for grid, tables in (
        (both.by_profiles, both.likelihood),
        (both.grid, both.likelihood),
        (tests.grid, tests.likelihood),
    ):
        designs.append(
            [Prediction(tables, grid).quantile(probability) for probability in PROMISED]
        )
        draws = grid.described(grid.draws(4000, np.random.default_rng(0)))
        for name, right in (("mean", 1e6), ("between", SCATTER)):
            low, high = np.quantile(draws[name], [0.05, 0.95])
            held.append(low < right < high)
    designs.append(student(peaks))
    p = min(both.agreement.p_values.values())
    return np.array(designs), [*held, False, False], p


def run(path, campaigns, first, method):
    """Append a row of numbers for each campaign."""
    ratios = onsets(method, 20_000 if method.type == "local_criterion" else 4_000, 1)
    right = {truth: right_designs(truth, ratios) for truth in TRUTHS}
    for seed in range(first, first + campaigns):
        for truth in TRUTHS:
            designs, held, p = campaign(truth, seed, method)
            with path.open("a", newline="") as file:
                for number, name in enumerate(METHODS):
                    chance = below(truth, designs[number], ratios) / PROMISED
                    row = [*chance, *(designs[number] / right[truth])]
                    inside = map(int, held[2 * number : 2 * number + 2])
                    csv.writer(file).writerow(
                        [truth, name, seed, *(f"{v:.6g}" for v in row), *inside, f"{p:.3g}"]
                    )


def print_table(path):
    """Print means over campaigns."""
    rows = list(csv.reader(path.open()))
    for truth in TRUTHS:
        for name in METHODS:
            own = np.array([row[3:] for row in rows if row[:2] == [truth, name]], dtype=float)
            if not own.size:
                continue
            error = own.std(axis=0, ddof=1) / np.sqrt(len(own))
            cells = [
                f"{own[:, k].mean():.2f} +- {error[k]:.2f} ({own[:, 2 + k].mean():.3f})"
                for k in (0, 1)
            ]
            if name != "student":
                cells += [f"{own[:, k].mean():.0%}" for k in (4, 5)]
            print(f"| {truth} | {name} | {len(own)} | {' | '.join(cells)} |")


def main(path, campaigns=0, first=0, method="local"):
    """Run campaigns, and print the table of all that are in the file."""
    warnings.simplefilter("ignore")
    if int(campaigns):
        solver = st.Equilibrium() if method == "equilibrium" else st.LocalCriterion()
        run(Path(path), int(campaigns), int(first), solver)
    print_table(Path(path))


if __name__ == "__main__":
    main(*sys.argv[1:])
