"""Equilibrium of 32,768 nodes, a thousand critical patches long, beside one dense factor.

Floor: some fifty products with K by FFT. The dense factor is the one of the slipping nodes at
onset alone: what any method that stores it must compute and hold at least.
Run: ``python benchmarks/equilibrium_large.py``
"""

import resource
import time

import numpy as np
import scipy.linalg
from timing import row

import stiction as st
from stiction.elasticity.line_stiffness import stiffness_column
from stiction.equilibrium.method import Equilibrium

NODES, SAMPLES = 32_768, 5
ALLOWED = 0.2


def factor_time(problem, slip):
    """Seconds and MB of a dense Cholesky factor on the slipping nodes."""
    nodes = np.flatnonzero(slip > 0.0)
    column = stiffness_column(NODES, problem.interface.length, problem.effective_modulus)
    start = time.perf_counter()
    matrix = column[np.abs(nodes[:, None] - nodes)]
    matrix[np.diag_indices(nodes.size)] -= problem.friction.weakening_rate
    scipy.linalg.cholesky(matrix, overwrite_a=True, check_finite=False)
    return time.perf_counter() - start, matrix.nbytes / 1e6, nodes.size


def main():
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="strain")
    problem = st.Problem(
        solid, st.Interface(3.456, NODES), st.LinearWeakening(weakening_rate=0.5e12)
    )
    solver = Equilibrium(slip=True).prepare(problem)
    patches = problem.interface.length / problem.nucleation_length
    print(f"equilibrium, n = {NODES}, L/h_n = {patches:.0f}, one core; us a sample")
    dense = []
    for ratio in (2.0, 1.0, 0.5, 0.25, 0.15):
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        tau_p = strength.sample(problem.interface, samples=SAMPLES + 1, seed=0)
        solver(problem.sample(tau_p[:1]))
        times, gaps = [], []
        for profile in tau_p[1:]:
            rows = problem.sample(profile)
            start = time.perf_counter()
            values = solver(rows)
            times.append(time.perf_counter() - start)
            gaps.append(values["certificate_gap"][0] / values["critical_load"][0])
        ours = float(np.median(times))
        dense.append((ratio, ours, values["slip"][0]))
        row(f"xi_0/h_n = {ratio}", ours, {})
        print(
            f"  {ours / ALLOWED:.2f} of the {ALLOWED} s allowed, slowest {max(times):.3f} s;"
            f" largest gap {max(gaps):.1e}"
        )
    print(f"most memory so far {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")
    for ratio, ours, slip in dense:
        seconds, megabytes, count = factor_time(problem, slip)
        row(f"xi_0/h_n = {ratio}, m = {count}", ours, {"dense factor": seconds})
        print(f"  dense factor {megabytes:.0f} MB")


if __name__ == "__main__":
    main()
