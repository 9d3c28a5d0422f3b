"""
Where sliding begins
====================

Critical positions under a load that decreases along the interface.
"""

import dataclasses

import stiction as st

problem = st.paper.problem(nodes=512)
gradient = st.Load(profile=st.GradientLoad(amplitude=0.2, centre=0.5))
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
