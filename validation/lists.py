"""Lists of equally likely interfaces: does the interval of a design hold the error of the list?

    python validation/lists.py [seeds]

Five records of a lognormal strength are fitted; the design stress for 1e-3 by the local criterion
is asked of the fit's interfaces: of a list of 5,000 (the reference), of lists of 30 and of 300, and
of the fit itself, with one seed after the other. The share of intervals that hold the reference
should be 85 to 95 % or more. Before that the same where the answer is known: the strength at one
place, of a lognormal field whose median is uncertain.
"""

import sys
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

import stiction as st

PROBABILITY, MEAN, WITHIN, UNKNOWN = 1e-3, 1.1e6, 30e3, 30e3


@dataclass(frozen=True)
class AtOnePlace:
    """The strength at one node."""

    type: str = "at_one_place"
    label = "strength at a node"
    variables = staticmethod(st.LocalCriterion().variables)

    def supports(self, problem):
        return []

    def seconds_per_sample(self, problem):
        return 1e-5

    def prepare(self, problem):
        return lambda rows: dict.fromkeys(self.variables(problem), rows.strength[:, 37])


@dataclass(frozen=True)
class UnknownMean:
    """Lognormal strengths of one deviation of the logarithm, whose median is uncertain."""

    spectrum: st.PowerLawSpectrum

    def interfaces(self, count, seed=0):
        medians = MEAN * np.exp(
            UNKNOWN / MEAN * np.random.default_rng([seed, 8]).normal(size=count)
        )
        cv = np.sqrt(np.expm1((WITHIN / MEAN) ** 2))
        marginals = (st.Lognormal(mean=one * np.sqrt(1.0 + cv * cv), cv=cv) for one in medians)
        return [
            st.RandomInterface(strength=st.RandomField(m, self.spectrum)) for m in marginals
        ]


def table(name, problem, source, reference, method, seeds):
    """Print how often intervals hold the reference, for lists of several lengths."""
    print(f"{name}: reference {reference / 1e6:.5f} MPa")
    print("| list | inside | scatter % | c.o.v. of P, by the list | evaluations |")
    for count in (30, 300, None):
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
    problem = st.paper.problem(nodes=136)
    spectrum = st.paper.strength(problem, 0.5).spectrum
    width = np.hypot(WITHIN, UNKNOWN) / MEAN
    exact = MEAN * np.exp(norm.ppf(PROBABILITY) * width)
    table("known", problem, UnknownMean(spectrum), exact, AtOnePlace(), seeds)
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
