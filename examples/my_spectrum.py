"""The roughness of my surfaces has a spectrum of its own: what does it do to the static strength?

Any function g(k) >= 0 of the wavenumber (rad/m) will do; here a machined surface, with a peak at a
groove distance of 2 mm, against a power law of the same correlation length.
"""

import numpy as np

import stiction as st

problem = st.paper.problem(nodes=1024)
marginal = st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)  # Pa

groove = 2.0 * np.pi / 2e-3  # rad/m


def machined(k: np.ndarray) -> np.ndarray:
    """A flat part and a peak, of a tenth of its wavenumber in width."""
    return np.exp(-(((k - groove) / (0.1 * groove)) ** 2)) + 0.3 * np.exp(-((k / groove) ** 2))


own = st.CustomSpectrum(function=machined, max_wavenumber=3.0 * groove)
power_law = st.PowerLawSpectrum(correlation_length=1e-3)
alike = power_law.with_efolding_length(own.efolding_length)
onsets = {}
for name, spectrum in {"machined": own, "power law": alike}.items():
    strength = st.RandomField(marginal, spectrum)
    found = st.monte_carlo(problem, strength, method=st.Equilibrium(), samples=300, seed=0)
    onsets[name] = found.critical_stress
    mean, spread = float(onsets[name].mean()) / 1e6, float(onsets[name].std()) / 1e3
    print(f"{name}: critical stress {mean:.3f} MPa, standard deviation {spread:.1f} kPa")
st.plot.monte_carlo({name: onset.to_dataset() for name, onset in onsets.items()})
