"""Equilibrium, beside HiGHS on the same programme and a bisection over the load with dense solves.

Floor: the m^3/3 operations of one factor of the m slipping nodes.
Run: ``python benchmarks/equilibrium.py``
"""

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, circulant
from scipy.optimize import linprog
from timing import median_time, row

import stiction as st
from stiction.elasticity.line_stiffness import stiffness_column
from stiction.equilibrium.method import Equilibrium

NODES, BATCH = 1024, 512
TARGETS = {0.25: 2e-3, 0.5: 0.7e-3, 1.0: 0.35e-3, 2.0: 0.3e-3}


def matrix_of(problem):
    """K - W as a dense matrix, in units of W."""
    column = stiffness_column(NODES, problem.interface.length, problem.effective_modulus)
    return circulant(column) / problem.friction.weakening_rate - np.eye(NODES)


def by_highs(matrix, tau_p):
    """The programme by HiGHS, MPa."""
    result = linprog(
        np.r_[np.zeros(NODES), -1.0],
        A_ub=np.c_[-matrix, np.ones(NODES)],
        b_ub=tau_p / 1e6,
        bounds=[(0, None)] * NODES + [(None, None)],
        method="highs-ds",
    )
    return result.x[-1]


def by_bisection(matrix, tau_p, tolerance=1e-9):
    """Halve the interval of loads; at each, grow the slipping set with a new factor every time."""
    low, high = tau_p.min() / 1e6, tau_p.mean() / 1e6
    strength = tau_p / 1e6
    while high - low > tolerance * high:
        load = 0.5 * (low + high)
        slipping = strength < load
        stable = True
        while True:
            nodes = np.flatnonzero(slipping)
            try:
                factor = cho_factor(matrix[np.ix_(nodes, nodes)])
            except LinAlgError:
                stable = False
                break
            slip = np.zeros(NODES)
            slip[nodes] = cho_solve(factor, load - strength[nodes])
            more = (matrix @ slip + strength - load < -1e-12) & ~slipping
            if not more.any():
                break
            slipping |= more
        low, high = (load, high) if stable else (low, load)
    return low


def main():
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="strain")
    problem = st.Problem(solid, st.Interface(0.1, NODES), st.LinearWeakening(weakening_rate=0.5e12))
    matrix = matrix_of(problem)
    solver = Equilibrium().prepare(problem)
    print(f"equilibrium, n = {NODES}, one core; us a sample; events of arrest included")
    for ratio, target in TARGETS.items():
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        tau_p = strength.sample(problem.interface, samples=BATCH, seed=0)
        rows = problem.sample(tau_p)
        ours = median_time(lambda rows=rows: solver(rows), 5) / BATCH
        values = solver(rows)
        one = tau_p[0]
        references = {
            "HiGHS": median_time(lambda one=one: by_highs(matrix, one), 1),
            "bisection": median_time(lambda one=one: by_bisection(matrix, one), 1),
        }
        row(f"xi_0/h_n = {ratio}", ours, references)
        exact = values["first_instability"][0] / 1e6
        gap = np.max(values["certificate_gap"] / values["critical_load"])
        print(
            f"  {ours / target:.2f} of the {target * 1e6:.0f} us allowed; largest gap {gap:.1e};"
            f" HiGHS differs by {by_highs(matrix, one) / exact - 1:.1e},"
            f" bisection by {by_bisection(matrix, one) / exact - 1:.1e}"
        )


if __name__ == "__main__":
    main()
