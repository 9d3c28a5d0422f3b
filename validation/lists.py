"""Lists of equally likely interfaces: does the interval of a design hold the error of the list?

    python validation/lists.py [seeds]

First where the answer is known (tests/exact/test_reliability_linear.py): the strength at one place,
normal about a mean that is as uncertain as it scatters. Then five records of a lognormal strength
are fitted, and the design stress for 1e-3 by the local criterion is asked of the fit's interfaces.
The reference is a list of 5,000; intervals are of lists of 30, 300 and 1000, and of the fit itself,
with one seed after the other. The share that holds the reference should be 85 to 95 % or more.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.stats import norm

import stiction as st

TESTS = Path(__file__).parents[1] / "tests"
sys.path += [str(TESTS), str(TESTS / "exact")]
from crooked import LINE  # noqa: E402
from test_reliability_linear import AtOnePlace, UnknownMean  # noqa: E402

PROBABILITY, UNKNOWN = 1e-3, 30e3


def table(name, problem, source, reference, method, seeds):
    """Print how often intervals hold the reference, for lists of several lengths."""
    print(f"{name}: reference {reference / 1e6:.5f} MPa")
    print("| list | inside | scatter % | c.o.v. of P, by the list | evaluations |")
    for count in (30, 300, 1000, None):
        inside, found = 0, []
        for seed in range(seeds):
            random = source if count is None else source.interfaces(count, seed=seed)
            answer = st.design_stress(
                problem, random, probability=PROBABILITY, method=method, seed=seed, progress=False,
                target_cv=0.2,
            )  # fmt: skip
            inside += answer.interval[0] <= reference <= answer.interval[1]
            found.append((answer.stress / reference, answer.members_cv, answer.evaluations))
        scatter, by_list, spent = np.array(found).T
        print(
            f"| {count or 'source'} | {inside} of {seeds} | {100 * np.std(scatter):.2f} |"
            f" {np.median(by_list):.2f} | {np.median(spent):.0f} |",
            flush=True,
        )


def main():
    """Both tables."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    warnings.simplefilter("ignore")
    exact = 1.1e6 + np.hypot(30e3, UNKNOWN) * norm.ppf(PROBABILITY)
    table("known", LINE, UnknownMean(UNKNOWN), exact, AtOnePlace(), seeds)
    problem = st.paper.problem(nodes=136)
    spectrum = st.paper.strength(problem, 0.5).spectrum
    method = st.LocalCriterion()
    truth = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum, True)
    records = truth.sample(problem.interface, samples=5, seed=11)
    fit = st.fit_field(
        records, problem.interface, marginal="lognormal", spectrum="power_law", noise=0.0,
        bootstrap=400,
    )  # fmt: skip
    reference = st.design_stress(
        problem, fit.interfaces(5000, seed=99), probability=PROBABILITY, method=method,
        progress=False, target_cv=0.05,
    )  # fmt: skip
    print(reference)
    table("fit", problem, fit, reference.stress, method, seeds)


if __name__ == "__main__":
    main()
