"""The local criterion, alone and with its fields, beside quadrature of the definition.

Floor: two real transforms of n points (field: one more), n look-ups and 2J normal draws a sample.
Run: ``python benchmarks/criterion.py``
"""

import numpy as np
from timing import median_time, row

import stiction as st
from stiction.criterion.eigenproblem import exact_weight

NODES, BATCH = 1024, 1024


def by_quadrature(problem, tau_p, points=64):
    """tau_n at every node as the weighted integral of the linear interpolant of tau_p."""
    t = (np.arange(points) + 0.5) * np.pi / points
    s, measure = np.cos(t), np.sin(t) * np.pi / points
    weight = exact_weight().at(s) * measure
    x, length = problem.interface.x, problem.interface.length
    total = np.zeros_like(x)
    for point, value in zip(s, weight, strict=True):
        where = x + 0.5 * problem.nucleation_length * point
        total += value * np.interp(where, x, tau_p, period=length)
    return total.min()


def main():
    problem = st.paper.problem(nodes=NODES)
    method = st.LocalCriterion()
    spectrum = np.fft.rfft(np.ones(NODES))
    floor = median_time(lambda: [np.fft.irfft(spectrum, NODES) for _ in range(100)]) / 100
    print(f"local criterion, n = {NODES}, one core; us a sample; one transform: {floor * 1e6:.1f}")
    for ratio in (0.25, 0.5, 1.0, 2.0):
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        tau_p = strength.sample(problem.interface, samples=BATCH, seed=0)
        alone = median_time(lambda t=tau_p: st.onset(problem, t, method=method)) / BATCH
        plain = median_time(lambda t=tau_p: by_quadrature(problem, t[0]), 5)
        row(f"xi_0/h_n = {ratio}, alone", alone, {"quadrature": plain})

        def ensemble(s=strength):
            return st.monte_carlo(problem, s, method=method, samples=8 * BATCH, workers=1)

        print(f"{'  with its field':24s} {median_time(ensemble) / (8 * BATCH) * 1e6:9.2f}")


if __name__ == "__main__":
    main()
