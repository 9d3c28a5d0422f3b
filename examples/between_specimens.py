"""My specimens differ from lot to lot as well as along each interface: what of the tail?

`between` multiplies a property by a factor of its own for each specimen, constant along it.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
within = st.RandomField(
    st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(3e-3), mean_mode=True
)
cases = {
    "within only": st.RandomInterface(strength=within),
    "within and between": st.RandomInterface(
        strength=within, between={"strength": st.Lognormal(mean=1.0, cv=0.1)}
    ),
}
onsets = {}
for name, random in cases.items():
    onsets[name] = st.monte_carlo(
        problem, random, method=st.Equilibrium(), samples=500, seed=0, progress=False
    )
    stress = onsets[name].critical_stress
    design = st.design_stress(
        problem, random, probability=1e-4, method=st.Equilibrium(), target_cv=0.3
    )
    scatter = 100.0 * float(stress.std() / stress.mean())
    print(f"{name}: scatter {scatter:.1f} %, P = 1e-4 at {design.stress / 1e6:.3f} MPa")
st.plot.monte_carlo(onsets)
