"""A part of my interface was scanned: how likely does this one slide below a stress?

`RandomField.given` keeps the field at the measured values, each with an error; elsewhere it is
random.
"""

import numpy as np
import xarray as xr

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=1.0)

# Stands in for a scan of the first third, with an error of 20 kPa: a specimen with a weak spot.
x = problem.interface.x
specimen = strength.sample(problem.interface, seed=18)[0]
rng = np.random.default_rng(0)
scan = xr.DataArray(specimen + 20e3 * rng.standard_normal(x.size), {"x": x}, "x")[: x.size // 3]

given = strength.given(scan, noise=20e3)
for name, field in {"any such interface": strength, "this one": given}.items():
    onsets = st.monte_carlo(
        problem, field, method=st.LocalCriterion(), samples=2000, seed=0, progress=False
    )
    low, high = onsets.critical_stress.quantile([0.05, 0.95]).values / 1e6
    found = st.failure_probability(problem, field, stress=0.68e6, method=st.LocalCriterion())
    print(f"{name}: slides at {low:.3f} to {high:.3f} MPa, below 0.68 MPa with P =", end=" ")
    print(f"{found.probability:.2g}")
st.plot.field(problem, given)
