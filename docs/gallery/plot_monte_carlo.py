"""
Distribution of the onset
=========================

Densities of the critical stress of four ensembles, and quantiles along a sweep.
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

# %%
# A study with a sweep over the correlation length:

study = st.Study(
    problem=problem,
    random=st.paper.strength(problem),
    method=st.LocalCriterion(),
    ensemble=st.Ensemble(samples=2000, seed=0),
    sweep=[{"random.strength.spectrum.correlation_length": [1e-3, 2e-3, 4e-3, 8e-3]}],
)
st.plot.quantiles(study.run(progress=False))
