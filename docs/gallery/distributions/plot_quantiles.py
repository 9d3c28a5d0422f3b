"""
Quantiles along a sweep
=======================

Critical stress against the correlation length, from a study with a sweep.
"""

import dataclasses

import stiction as st

problem = st.paper.problem(nodes=1024)
study = st.Study(
    problem=problem,
    random=dataclasses.replace(st.paper.strength(problem), mean_mode=True),
    method=st.Equilibrium(),
    samples=500, seed=0,
    sweep=[{"random.strength.spectrum.correlation_length": [1e-3, 2e-3, 4e-3, 8e-3]}],
)
st.plot.quantiles(study.run(progress=False))
