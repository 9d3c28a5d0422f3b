"""
An earthquake
=============

A fault of 30 km that ends, broken from an overstressed patch.
"""

import numpy as np

import stiction as st

solid = st.Solid(shear_modulus=2670.0 * 3464.0**2, poisson_ratio=0.25, density=2670.0)
line = st.Interface(length=60e3, nodes=1200, extent=(15e3, 45e3))
x = line.x - 30e3
problem = st.Problem(
    solid,
    line,
    st.LinearWeakening(critical_slip=0.4, residual_strength=63e6),
    st.Load(initial_stress=np.where(np.abs(x) <= 1.5e3, 81.6e6, 70e6)),
)
method = st.Rupture(load_history=([0, 20], [0, 0]), stop="time", end_time=8.0)
tau_p = np.full(1200, 81.24e6)
stations = {"6 km": 36e3, "12 km": 42e3}
run = st.simulate_rupture(
    problem, tau_p, method=method, save=st.Save(every=4, stations=stations)
)
st.plot.rupture(run)
