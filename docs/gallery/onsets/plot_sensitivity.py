"""
Which part controls the onset
=============================

The derivative of the onset with respect to the strength of each place.
"""

import matplotlib.pyplot as plt

import stiction as st

problem = st.paper.problem(nodes=512)
tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(problem.interface, seed=3)
exact = st.onset(problem, tau_p, method=st.Equilibrium(sensitivity=True))
figure, (above, below) = plt.subplots(2, 1, figsize=(6.75, 4.5), sharex=True, layout="constrained")
st.plot.onset(exact, tau_p, ax=above)
above.legend(loc="upper right", ncols=3)
below.fill_between(1e3 * problem.interface.x, exact.sensitivity[0])
below.set(xlabel="position $x$ (mm)", ylabel="sensitivity")
