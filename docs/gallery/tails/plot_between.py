"""
Scatter between specimens
=========================

The failure probability with a scatter of 10 % from lot to lot, and without.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=1.0)
lots = st.RandomInterface(
    strength=strength, between={"strength": st.Lognormal(mean=1.0, cv=0.1)}
)
ax = None
for random in (strength, lots):
    curve = st.failure_curve(
        problem, random, method=st.LocalCriterion(), smallest=1e-4, progress=False
    )
    ax = st.plot.failure_curve(curve, ax=ax)
ax.text(0.545, 1e-2, "10 % from lot to lot ", ha="right")
ax.text(0.672, 1e-3, "equal specimens")
ax.get_legend().remove()
