"""
Speed of the front
==================

Arrival times along the interface, with the wave speeds.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(problem.interface, seed=1)[0]
run = st.simulate_rupture(problem, tau_p, method=st.Rupture(loading_rate=2e7))
st.plot.front(run)
