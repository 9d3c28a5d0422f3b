"""Lists of equally likely interfaces: does the interval of a design hold the error of the list?

The strength at one place is normal about a mean that is as uncertain as it scatters, so that the
design stress for 1e-3 is known (tests/exact/test_reliability_linear.py). Intervals are of lists of
30 and 300, and of the source itself, with one seed after the other: 85 to 95 % or more of them
should hold that stress.

Run: ``python validation/lists.py [SEEDS]``
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


def main(seeds=20):
    """Print a row for each list."""
    warnings.simplefilter("ignore")
    source = UnknownMean(UNKNOWN)
    exact = 1.1e6 + np.hypot(30e3, UNKNOWN) * norm.ppf(PROBABILITY)
    options = {"probability": PROBABILITY, "target_cv": 0.2, "progress": False}
    print("| list | inside | scatter % |")
    for count in (30, 300, None):
        inside, found = 0, []
        for seed in range(seeds):
            random = source if count is None else source.interfaces(count, seed=seed)
            answer = st.design_stress(LINE, random, method=AtOnePlace(), seed=seed, **options)
            inside += (
                answer.interval["probability"][0] <= exact <= answer.interval["probability"][1]
            )
            found.append(answer.stress / exact)
        scatter = 100.0 * np.std(found)
        print(f"| {count or 'source'} | {inside} of {seeds} | {scatter:.2f} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
