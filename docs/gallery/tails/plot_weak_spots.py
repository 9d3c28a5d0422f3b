"""
Weak spots
==========

Interfaces that fail early, each moved so that it begins to slide in the middle.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=1.0)
found = st.failure_probability(problem, strength, stress=0.67e6, method=st.LocalCriterion())
st.plot.weak_spots(found)
