"""
A measured profile with gaps
============================

The onset of a record from a file. Straight lines cross its gaps.
"""

from pathlib import Path

import stiction as st

root = next(p for p in Path.cwd().resolve().parents if (p / "examples/data").exists())
problem = st.Problem(
    solid=st.Solid(youngs_modulus=2.66e9, poisson_ratio=0.33, density=1170.0),
    interface=st.Interface(length=0.12, nodes=1024),
    friction=st.LinearWeakening(weakening_rate=4e11, residual_strength=0.25e6),
    load=st.Load(normal_pressure=2e6),
)
profile = st.read_profile(root / "examples/data/strength_profile.csv")
tau_p = profile.dropna("x").interp(x=problem.interface.x)
st.plot.onset(st.onset(problem, tau_p, method=st.Equilibrium()), tau_p)
