"""
A field measured in part
========================

Median and 90 % band of the strength of a specimen. A third of the specimen was scanned.
"""

import xarray as xr

import stiction as st

problem = st.paper.problem(nodes=1024)
strength = st.paper.strength(problem, correlation_ratio=1.0)
x = problem.interface.x
tau_p = strength.sample(problem.interface, seed=5)[0]
scan = xr.DataArray(tau_p[200:540:4], {"x": x[200:540:4]}, "x", attrs={"units": "Pa"})
st.plot.field(problem, strength.given(scan, noise=20e3))
