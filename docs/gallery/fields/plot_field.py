"""
Strength along an interface
===========================

Profiles of a random field at two correlation lengths: the same draws with another
spectrum. If the problem has a normal pressure, a second axis shows friction coefficients.
"""

import matplotlib.pyplot as plt

import stiction as st

plain = st.paper.problem(nodes=1024)
problem = st.Problem(plain.solid, plain.interface, plain.friction, st.Load(normal_pressure=5e6))
figure, panels = plt.subplots(2, 1, figsize=(6.75, 4), sharex=True, layout="constrained")
for axes, ratio in zip(panels, (0.25, 2.0), strict=True):
    strength = st.paper.strength(problem, correlation_ratio=ratio)
    tau_p = strength.sample(problem.interface, seed=3)
    st.plot.field(problem, tau_p, ax=axes)
    axes.set_title(rf"$\xi_0/h_n$ = {ratio:g}")
