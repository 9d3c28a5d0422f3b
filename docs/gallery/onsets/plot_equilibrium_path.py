"""
Patches on the way to the onset
===============================

Slip at six loads below the critical load.
"""

import numpy as np

import stiction as st

problem = st.paper.problem(nodes=1024)
tau_p = st.paper.strength(problem, correlation_ratio=0.25).sample(problem.interface, seed=3)[0]
onset = st.onset(problem, tau_p, method=st.Equilibrium())
loads = float(onset.critical_load[0]) * np.array([0.9, 0.93, 0.96, 0.98, 0.99, 0.999])
path = st.equilibrium_path(problem, tau_p, loads)
path.slip.assign_coords(load=loads.round(-3)).plot.line(x="x")
