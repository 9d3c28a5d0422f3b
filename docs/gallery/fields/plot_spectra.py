"""
Three spectra
=============

The same draws with three spectra of equal 1/e length: smooth, moderately rough, rough.
"""

import matplotlib.pyplot as plt

import stiction as st

problem = st.paper.problem(nodes=1024)
marginal = st.Lognormal(mean=1e6, cv=0.2)
spectra = {
    "squared exponential": st.SquaredExponentialSpectrum(2e-3),
    "power law, exponent 2": st.PowerLawSpectrum(2e-3, exponent=2.0).with_efolding_length(2e-3),
    "exponential": st.ExponentialSpectrum(2e-3),
}
figure, panels = plt.subplots(3, 1, figsize=(6.75, 6), sharex=True, layout="constrained")
for axes, (name, spectrum) in zip(panels, spectra.items(), strict=True):
    tau_p = st.RandomField(marginal, spectrum).sample(problem.interface, seed=1)
    st.plot.field(problem, tau_p, ax=axes)
    axes.set_title(name)
