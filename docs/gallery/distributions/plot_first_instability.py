"""
First instability and sliding
=============================

In a wide strength the first unstable patch is often arrested, and the interface slides later.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.RandomField(st.Lognormal(mean=1e6, cv=0.6), st.PowerLawSpectrum(4e-3))
result = st.monte_carlo(
    problem, strength, method=st.Equilibrium(), samples=500, seed=0, progress=False
)
first = result.assign(critical_stress=result.first_instability)
st.plot.monte_carlo({"sliding": result, "first instability": first})
