"""
A rupture
=========

Slip rate in space and time, and a film as a file.
"""

import tempfile
from pathlib import Path

import stiction as st

problem = st.paper.problem(nodes=512)
tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(problem.interface, seed=1)[0]
method = st.Rupture(loading_rate=2e7)
run = st.simulate_rupture(problem, tau_p, method=method, save=st.Save(every=4))
st.plot.rupture(run)

# %%

film = st.plot.film(run, Path(tempfile.mkdtemp()) / "rupture.gif", frames=10)
print(film.stat().st_size // 1000, "kB")
