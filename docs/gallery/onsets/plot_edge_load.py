"""
Precursors under an edge load
=============================

Slip at six loads. Events arrest where the load is concentrated, before the interface slides.
"""

import dataclasses

import numpy as np

import stiction as st

plain = st.paper.problem(nodes=512)
x = plain.interface.x
profile = 1.0 + 4.0 * np.exp(-np.abs(x - 0.05) / 0.01)
problem = dataclasses.replace(
    plain,
    friction=st.LinearWeakening(weakening_rate=0.5e12, residual_ratio=0.3),
    load=st.Load(profile=profile / profile.mean()),
)
tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(problem.interface, seed=1)[0]
onset = st.onset(problem, tau_p, method=st.Equilibrium())
loads = float(onset.critical_load[0]) * np.array([0.5, 0.6, 0.7, 0.8, 0.9, 0.99])
path = st.equilibrium_path(problem, tau_p, loads)
path.slip.assign_coords(load=loads.round(-3)).plot.line(x="x")
