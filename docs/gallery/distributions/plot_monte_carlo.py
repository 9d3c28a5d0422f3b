"""
Distribution of the onset
=========================

Densities of the critical stress at four correlation lengths.
"""

import stiction as st

problem = st.paper.problem(nodes=1024)
results = {
    rf"$\xi_0/h_n$ = {ratio:g}": st.monte_carlo(
        problem,
        st.paper.strength(problem, correlation_ratio=ratio),
        method=st.LocalCriterion(),
        samples=5000,
        seed=0,
    )
    for ratio in (0.25, 0.5, 1.0, 2.0)
}
st.plot.monte_carlo(results)
