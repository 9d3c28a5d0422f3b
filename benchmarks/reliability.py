"""Failure probability to a given error, by every algorithm, beside OpenTURNS and plain sampling.

At xi_0/h_n = 0.5, n = 1024, one core: P near 1e-6 and 1e-9 to a coefficient of variation of 0.3.
Plain reference: what counting would need, 1/(P 0.09) samples at the method's own cost. OpenTURNS
runs its subset sampling on the same limit state with blocks of p_0 N samples or fewer; larger
blocks are faster and report an error far below the true one.

Run: ``python benchmarks/reliability.py``
"""

import time
import warnings
from functools import partial

import numpy as np
from timing import median_time

import stiction as st
from stiction.criterion.method import LocalCriterion
from stiction.equilibrium.method import Equilibrium
from stiction.reliability.design import design_stress
from stiction.reliability.estimate import failure_probability
from stiction.reliability.limit_state import make_limit_state

TARGET = 0.3
STRESSES = {1e-6: 661.6e3, 1e-9: 660.3e3}


def openturns(state, stress, samples, block):
    """Probability, reported c.o.v., evaluations and seconds of OpenTURNS' subset sampling."""
    import openturns as ot

    count = 0

    def sample(points):
        nonlocal count
        count += len(points)
        return state(np.asarray(points))[:, None]

    function = ot.PythonFunction(state.dimension, 1, func_sample=sample)
    vector = ot.CompositeRandomVector(function, ot.RandomVector(ot.Normal(state.dimension)))
    algorithm = ot.SubsetSampling(ot.ThresholdEvent(vector, ot.Less(), stress))
    algorithm.setMaximumOuterSampling(samples // block)
    algorithm.setBlockSize(block)
    algorithm.setConditionalProbability(0.1)
    start = time.perf_counter()
    algorithm.run()
    result = algorithm.getResult()
    seconds = time.perf_counter() - start
    chance = result.getProbabilityEstimate()
    return chance, result.getCoefficientOfVariation(), count, seconds


def main():
    warnings.simplefilter("ignore")
    problem = st.paper.problem(nodes=1024)
    field = st.paper.strength(problem, correlation_ratio=0.5)
    print(f"c.o.v. {TARGET}, n = 1024, xi_0/h_n = 0.5, one core; medians of five seeds")
    print(f"{'':38s}{'s':>8s} {'P':>9s} {'c.o.v.':>7s} {'evaluations':>12s} {'counting s':>11s}")
    algorithms = {
        LocalCriterion(): ("subset", "importance"),
        Equilibrium(): ("two_level", "subset", "importance"),
    }
    for chance, stress in STRESSES.items():
        for method, names in algorithms.items():
            state = make_limit_state(problem, field, method, 0, {}, "critical_stress", 1)
            draws = state.draws(0, 0, 500)
            each = median_time(partial(state, draws), 5) / 500
            for name in names:
                times, found = [], []
                for seed in range(5):
                    start = time.perf_counter()
                    found.append(
                        failure_probability(
                            problem,
                            field,
                            stress,
                            method=method,
                            algorithm=name,
                            target_cv=TARGET,
                            seed=seed,
                            workers=1,
                        )
                    )
                    times.append(time.perf_counter() - start)
                middle = found[int(np.argsort(times)[2])]
                mean = np.mean([one.probability for one in found])
                print(
                    f"{method.type + ' ' + name + f', P near {chance:g}':38s}"
                    f"{np.median(times):8.2f} {mean:9.2e} {middle.coefficient_of_variation:7.2f}"
                    f" {middle.evaluations:12,} {each / (chance * TARGET**2):11,.0f}",
                    flush=True,
                )
    start = time.perf_counter()
    answer = design_stress(
        problem, field, probability=1e-6, method=Equilibrium(), target_cv=TARGET, workers=1
    )
    print(f"design stress, P = 1e-6, equilibrium: {time.perf_counter() - start:.2f} s; {answer}")
    state = make_limit_state(problem, field, LocalCriterion(), 0, {}, "critical_stress", 1)
    for block in (100, 1000):
        runs = [openturns(state, STRESSES[1e-6], 2000, block) for _ in range(8)]
        chances, errors, counts, seconds = np.array(runs).T
        print(
            f"OpenTURNS, local, 2000 a level, block {block}: {np.median(seconds):.2f} s,"
            f" {np.mean(counts):,.0f} evaluations, mean P {chances.mean():.2e}, reported c.o.v."
            f" {np.mean(errors):.2f}, observed over 8 runs"
            f" {chances.std(ddof=1) / chances.mean():.2f}"
        )


if __name__ == "__main__":
    main()
