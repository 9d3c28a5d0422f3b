"""
Strength on a plane
===================

An anisotropic field: the correlation length across the load is three times as long as along it.
"""

import stiction as st

problem = st.Problem(
    solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    interface=st.Interface(length=(0.03, 0.02), nodes=(192, 128)),
    friction=st.LinearWeakening(weakening_rate=0.5e12),
)
strength = st.RandomField(
    st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(3e-3), mean_mode=True, anisotropy=3.0
)
st.plot.field(problem, strength.sample(problem.interface, seed=2))
