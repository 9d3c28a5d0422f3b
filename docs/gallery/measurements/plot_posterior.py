"""
A posterior from peak stresses
==============================

The lower bound of the strength from 25 synthetic tests, and the peaks that it predicts.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem)
method = st.LocalCriterion()
peaks = st.monte_carlo(problem, strength, method=method, samples=25, seed=7).critical_stress
prior = {"marginal.low": (0.4e6, 0.8e6), "marginal.high": (1.2e6, 2.2e6)}
found = st.infer(
    problem, strength, peaks.values, prior=prior, method=method, load_cell_error=4e3
)
figure = st.plot.posterior(found)
