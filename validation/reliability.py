"""Long checks of failure probability: repetition, a million plain samples, four times the length.

Prints, for each algorithm, the mean over repeated runs against a precise reference, the observed
coefficient of variation beside the reported one, and how often the 95 % interval held the
reference. Takes about ten minutes on one core.

Run: ``python validation/reliability.py``
"""

import dataclasses
import math
import time
import warnings

import numpy as np

import stiction as st

MILLION = 1_000_000
REPEATS = 50


def longer(problem, times):
    """The same problem on a line that is so many times longer."""
    interface = st.Interface(times * problem.interface.measure, times * problem.interface.size)
    return dataclasses.replace(problem, interface=interface)


def repetition(problem, field, stress, reference, method, algorithm, target):
    """Mean ratio, observed and reported error, coverage and time of repeated runs."""
    start = time.perf_counter()
    options = {"method": method, "algorithm": algorithm, "target_cv": target, "workers": 1}
    found = [
        st.failure_probability(problem, field, stress, seed=seed, **options)
        for seed in range(1, REPEATS + 1)
    ]
    ratio = np.array([one.probability for one in found]) / reference
    error = math.sqrt(np.mean([one.cv**2 for one in found]))
    held = np.mean(
        [
            one.interval["probability"][0] <= reference <= one.interval["probability"][1]
            for one in found
        ]
    )
    print(
        f"  {method.type:16s} {algorithm:11s} mean {ratio.mean():.3f}"
        f" +- {ratio.std(ddof=1) / math.sqrt(REPEATS):.3f}, cv observed"
        f" {ratio.std(ddof=1) / ratio.mean():.3f}, reported {error:.3f}, held {held:.0%},"
        f" {np.mean([one.evaluations for one in found]):,.0f} evaluations,"
        f" {(time.perf_counter() - start) / REPEATS:.2f} s a run",
        flush=True,
    )


def main():
    warnings.simplefilter("ignore")
    local, exact = st.LocalCriterion(), st.Equilibrium()
    problem = st.paper.problem(nodes=512)
    field = st.paper.strength(problem, correlation_ratio=0.5)
    state = st.external.limit_state(problem, field, local)
    start = time.perf_counter()
    parts = [state(state.draws(12345, first, 1000)) for first in range(0, MILLION, 1000)]
    onset = np.sort(np.concatenate(parts))
    print(f"{MILLION:,} plain samples, n = 512: {time.perf_counter() - start:.0f} s")
    for chance in (1e-3, 1e-4):
        stress = float(onset[int(chance * MILLION)])
        print(f"P = {chance:g} +- {1.0 / math.sqrt(chance * MILLION):.1%} by counting")
        repetition(problem, field, stress, chance, local, "subset", 0.1)
    stress = 661.6e3
    for method in (local, exact):
        precise = st.failure_probability(
            problem, field, stress, method=method, algorithm="subset", target_cv=0.03, seed=99
        )
        print(f"{method.type}: {precise}")
        for name in ("subset", "two_level")[: 1 if method is local else 2]:
            repetition(problem, field, stress, precise.probability, method, name, 0.3)
    long = longer(problem, 4)
    states = [st.external.limit_state(one, field, local) for one in (problem, long)]
    counts = [
        np.concatenate([s(s.draws(7, i, 1000)) for i in range(0, 40_000, 1000)]) for s in states
    ]
    print("four times the length: P(L) and P(4L) by 40,000 samples each, weakest link, subset")
    for chance in (0.1, 0.01):
        stress = float(np.quantile(counts[0], chance))
        counted = float(np.mean(counts[1] < stress))
        rule = -math.expm1(4.0 * math.log1p(-chance))
        found = st.failure_probability(
            long, field, stress, method=local, algorithm="subset", target_cv=0.05, workers=1
        )
        share = math.log1p(-rule) / math.log1p(-counted)
        print(
            f"  {chance:g}: {counted:.4f}, {rule:.4f} (log survival {share:.2f} of it),"
            f" {found.probability:.4f} +- {found.cv:.0%}"
        )


if __name__ == "__main__":
    main()
