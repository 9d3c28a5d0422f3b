"""How likely does my joint slide below a stress, and which stress may it be given?

Probabilities far below what counting reaches, with intervals; then the stress with a failure
probability of one in a million.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=0.5)

found = st.failure_probability(
    problem, strength, 0.664e6, method=st.Equilibrium(), target_cv=0.3
)
print(found)
again = st.failure_probability(
    problem, strength, 0.664e6, method=st.LocalCriterion(), target_cv=0.3
)
print(again)
design = st.design_stress(
    problem, strength, probability=1e-6, method=st.LocalCriterion(), target_cv=0.3
)
print(design)

# What weak interfaces have in common: one stretch near the lower bound of the strength.
weak = found.failing_profiles
lowest = float(weak.strength.rolling(x=16).mean().min("x").mean())
print(f"weakest 1.6 mm of failing interfaces: {lowest / 1e6:.3f} MPa on average")
