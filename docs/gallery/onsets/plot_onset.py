"""
Onset on a line
===============

Strength, nucleation stress and the onsets by the local criterion and by exact equilibrium.
"""

import stiction as st

problem = st.paper.problem(nodes=1024)
tau_p = st.paper.strength(problem, correlation_ratio=0.25).sample(problem.interface, seed=3)
onsets = [st.onset(problem, tau_p, method=m) for m in (st.LocalCriterion(), st.Equilibrium())]
st.plot.onset(onsets, tau_p)
