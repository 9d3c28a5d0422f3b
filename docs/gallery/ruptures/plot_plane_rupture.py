"""
A rupture on a plane
====================

The front at equal intervals of time, on a map of the strength.
"""

import stiction as st

problem = st.Problem(
    solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    interface=st.Interface(length=(0.02, 0.02), nodes=(96, 96)),
    friction=st.LinearWeakening(weakening_rate=0.35e12),
)
strength = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    st.PowerLawSpectrum(3e-3),
    mean_mode=True,
)
tau_p = strength.sample(problem.interface, seed=0)[0]
run = st.simulate_rupture(
    problem, tau_p, method=st.Rupture(loading_rate=2e7), save=st.Save(every=4)
)
st.plot.rupture(run)
