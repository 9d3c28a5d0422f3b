"""
Length of the interface
=======================

A longer interface has weaker spots, and less scatter.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
study = st.Study(
    problem=problem,
    random=st.paper.strength(problem),
    method=st.LocalCriterion(),
    samples=2000, seed=0,
    sweep=[
        {
            "problem.interface.length": [0.05, 0.1, 0.2, 0.4],
            "problem.interface.nodes": [512, 1024, 2048, 4096],
        }
    ],
)
st.plot.monte_carlo(study.run(progress=False))
