"""
Where sliding begins
====================

Critical positions under a load that decreases along the interface.
"""

import dataclasses

import numpy as np

import stiction as st

problem = st.paper.problem(nodes=512)
x = problem.interface.x / problem.interface.length
gradient = st.Load(profile=1.0 + 0.2 * (1.0 - 4.0 * np.abs(x - 0.5)))
onsets = {
    name: st.monte_carlo(
        dataclasses.replace(problem, load=load),
        st.paper.strength(problem),
        method=st.LocalCriterion(),
        samples=4000,
        seed=0,
        progress=False,
    )
    for name, load in {"uniform load": st.Load(), "gradient": gradient}.items()
}
st.plot.monte_carlo(onsets, quantity="critical_position")
