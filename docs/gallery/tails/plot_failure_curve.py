"""
Failure probability over decades
================================

The probability that the interface slides below a stress, by subset simulation.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=1.0)
curve = st.failure_curve(problem, strength, method=st.LocalCriterion(), smallest=1e-6)
st.plot.failure_curve(curve)
