"""
Onset of a joint
================

A steel joint in friction coefficients, with the onset by two methods.
"""

import stiction as st

problem = st.Problem(
    solid=st.Solid(youngs_modulus=210e9, poisson_ratio=0.3, density=7850.0),
    interface=st.Interface(length=0.2, nodes=512),
    friction=st.LinearWeakening(weakening_rate=5e12, residual_ratio=0.7),
    load=st.Load(normal_pressure=80e6),
)
mu = st.RandomField(
    st.Lognormal(mean=0.2, cv=0.12), st.PowerLawSpectrum(5e-3), quantity="friction_coefficient"
)
tau_p = 80e6 * mu.sample(problem.interface, seed=0)
onsets = [st.onset(problem, tau_p, method=m) for m in (st.LocalCriterion(), st.Equilibrium())]
st.plot.onset(onsets, tau_p)
