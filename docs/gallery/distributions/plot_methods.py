"""
Two methods
===========

The same samples by the local criterion and by exact equilibrium.
"""

import stiction as st

problem = st.paper.problem(nodes=1024)
strength = st.paper.strength(problem, correlation_ratio=0.25)
results = [
    st.monte_carlo(problem, strength, method=method, samples=1500, seed=0, progress=False)
    for method in (st.LocalCriterion(), st.Equilibrium())
]
st.plot.monte_carlo(results)
