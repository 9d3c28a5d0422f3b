"""I can afford eight ruptures on a plane: what is the mean static strength, and how sure am I?

Sample i is the same whatever the method. Equilibrium, which takes a tenth of the time, is computed
for many samples, and ruptures only for the first of them: what inertia adds is nearly the same in
all, so eight differences are worth hundreds of ruptures.
"""

import numpy as np

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
expensive, exact, quick = (
    found.first_instability.values / 1e6 for found in (ruptures, onsets, local)
)


def combined(few, many, mean_of_many, variance):
    """Mean of few results, with the same samples of another method as a control variate."""
    own = many[: few.size]
    weight = np.cov(few, own)[0, 1] / own.var(ddof=1)
    rest = few - weight * own
    return rest.mean() + weight * mean_of_many, rest.var(
        ddof=2
    ) / few.size + weight**2 * variance


alone = expensive.var(ddof=1) / expensive.size
controlled = combined(exact, quick, quick.mean(), quick.var(ddof=1) / quick.size)
value, variance = combined(expensive, exact, *controlled)
print(f"ruptures alone: {expensive.mean():.4f} +- {alone**0.5:.4f} MPa")
print(
    f"with equilibrium and the local criterion: {value:.4f} +- {variance**0.5:.4f} MPa,",
    end=" ",
)
print(f"as {8 * alone / variance:.0f} ruptures would give")
