"""
Sizes of events
===============

Events of each size on random faults that end: how often they occur, by two methods.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

solid = st.Solid(shear_modulus=2.43e10, poisson_ratio=0.25, density=2700.0)
problem = st.Problem(
    solid,
    st.Interface(length=4e3, nodes=256, extent=(1e3, 3e3)),
    st.LinearWeakening(critical_slip=0.1, residual_strength=30e6),
    st.Load(initial_stress=27e6),
    mode="III",
)
strength = st.RandomField(
    st.Beta(alpha=1.5, beta=2.0, low=30.2e6, high=42e6),
    st.PowerLawSpectrum(correlation_length=300.0),
    mean_mode=True,
)
methods = st.Equilibrium(events=40), st.Rupture(loading_rate=1e5, events=20)
results = {
    method.label: st.monte_carlo(problem, strength, method=method, samples=60, seed=1)
    for method in methods
}
figure, (left, right) = plt.subplots(1, 2, figsize=(6.75, 2.8), layout="constrained")
for name, result in results.items():
    moments = np.sort(result.event_moment.values[np.isfinite(result.event_moment)])[::-1]
    number = np.arange(1, moments.size + 1) / result.sizes["sample"]
    left.loglog(moments, number, label=name)
    right.loglog(result.event_length.values.ravel(), result.event_moment.values.ravel(), ".")
left.set(xlabel="moment (N)", ylabel="events per sample, at least as large")
right.set(xlabel="length (m)", ylabel="moment (N)")
left.legend()
