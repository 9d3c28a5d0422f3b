"""I can afford eight ruptures on a plane: what is the mean static strength, and how sure am I?

Sample i is the same whatever the method. Equilibrium, which takes a tenth of the time, is computed
for many samples, and ruptures only for the first of them: what inertia adds is nearly the same in
all, so eight differences are worth hundreds of ruptures.
"""

import stiction as st

solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
plane = st.Interface(length=(0.0138, 0.0138), nodes=(48, 48))
problem = st.Problem(solid, plane, st.LinearWeakening(weakening_rate=0.5e12))
strength = st.RandomField(
    marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    spectrum=st.PowerLawSpectrum(correlation_length=2e-3),
)
random = {"seed": 1, "progress": False}
rupture = st.Rupture(loading_rate=2e7, stop="onset")
ruptures = st.monte_carlo(problem, strength, method=rupture, samples=8, **random)
onsets = st.monte_carlo(problem, strength, method=st.Equilibrium(), samples=60, **random)
local = st.monte_carlo(problem, strength, method=st.LocalCriterion(), samples=2000, **random)
mean = st.statistics.combined_mean(
    *(found.first_instability.values for found in (ruptures, onsets, local))
)
print(f"ruptures alone: +- {mean.plain_error / 1e6:.4f} MPa")
print(f"with equilibrium and the local criterion: {mean.estimate.value / 1e6:.4f} MPa", end=" ")
print(f"+- {mean.estimate.error / 1e6:.4f} MPa, as {8 * mean.saving:.0f} ruptures would give")
