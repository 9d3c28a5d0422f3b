"""
Four marginals
==============

The same draws with marginals of equal mean and coefficient of variation.
"""

import matplotlib.pyplot as plt

import stiction as st

problem = st.paper.problem(nodes=1024)
spectrum = st.PowerLawSpectrum(4e-3)
families = (st.Lognormal, st.Weibull, st.Gamma, st.TruncatedNormal)
figure, panels = plt.subplots(4, 1, figsize=(6.75, 7), sharex=True, sharey=True, layout="constrained")
for axes, family in zip(panels, families, strict=True):
    tau_p = st.RandomField(family(mean=1e6, cv=0.35), spectrum).sample(
        problem.interface, seed=1
    )
    st.plot.field(problem, tau_p, ax=axes)
    axes.set_title(family.__name__)
