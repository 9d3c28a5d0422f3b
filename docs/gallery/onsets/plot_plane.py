"""
Onset on a plane
================

Strength on a plane, and the place of its onset by the local criterion and by exact equilibrium.
"""

import stiction as st

problem = st.Problem(
    solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    interface=st.Interface(length=(0.02, 0.01), nodes=(128, 64)),
    friction=st.LinearWeakening(weakening_rate=0.5e12),
)
strength = st.RandomField(
    marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    spectrum=st.PowerLawSpectrum(correlation_length=3e-3),
    mean_mode=True,
)
tau_p = strength.sample(problem.interface, seed=0)
local = st.onset(problem, tau_p, method=st.LocalCriterion())
exact = st.onset(problem, tau_p, method=st.Equilibrium())
st.plot.onset([local, exact], tau_p)
