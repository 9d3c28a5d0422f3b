"""The critical slip, or the fracture energy, varies along my interface: what does that do?

Each is a random property beside the strength, and is left out of the friction law. With both the
weakening rate W varies, and there is no single nucleation length, so the local criterion does
not apply.
"""

import scipy.stats

import stiction as st

paper = st.paper.problem(nodes=2048)
strength = st.paper.strength(paper, correlation_ratio=1.0)
critical_slip, energy = 2e-6, 1.0  # m, J/m2


def varying(mean: float) -> st.RandomField:
    """A log-normal field of this mean, with a coefficient of variation of about 0.2."""
    return st.RandomField(scipy.stats.lognorm(0.2, scale=mean), strength.spectrum)


cases = {
    "d_c uniform": (
        st.LinearWeakening(critical_slip=critical_slip),
        st.RandomInterface(strength=strength),
    ),
    "d_c random": (
        st.LinearWeakening(),
        st.RandomInterface(strength=strength, critical_slip=varying(critical_slip)),
    ),
    "Gamma random": (
        st.LinearWeakening(),
        st.RandomInterface(strength=strength, fracture_energy=varying(energy)),
    ),
}
onsets = {}
for name, (law, random) in cases.items():
    problem = st.Problem(paper.solid, paper.interface, law)
    onsets[name] = st.monte_carlo(problem, random, method=st.Equilibrium(), samples=60, seed=0)
    mean = float(onsets[name].critical_stress.mean())
    patch = float(onsets[name].critical_patch_length.median())
    print(f"{name}: critical stress {mean / 1e6:.3f} MPa, critical patch {patch * 1e3:.1f} mm")
st.plot.monte_carlo(onsets)
