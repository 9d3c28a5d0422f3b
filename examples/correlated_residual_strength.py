"""Where the strength is low, the residual strength is low too: does it matter?

`RandomInterface` says what is random and how it is correlated. The strength has the same draws
whatever the correlation, so that differences are those of the correlation alone.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=0.5)
residual = st.RandomField(
    marginal=st.Beta(alpha=2.0, beta=2.0, low=0.0, high=0.6e6),  # Pa
    spectrum=strength.spectrum,
)
onsets = {}
for rho in (0.0, 0.8):
    random = st.RandomInterface(
        strength=strength,
        residual_strength=residual,
        correlation={("strength", "residual_strength"): rho},
    )
    onsets[rho] = st.monte_carlo(problem, random, method=st.Equilibrium(), samples=150, seed=0)
    arrested = 100.0 * float((onsets[rho].arrested_events > 0).mean())
    mean = float(onsets[rho].critical_stress.mean())
    print(
        f"correlation {rho}: critical stress {mean / 1e6:.4f} MPa,"
        f" {arrested:.0f} % of samples with arrested events"
    )
st.plot.monte_carlo({f"correlation {rho}": onset for rho, onset in onsets.items()})
