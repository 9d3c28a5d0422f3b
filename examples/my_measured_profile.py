"""I have measured the strength along my interface: at which load does it begin to slide, and where?

The file states its units and has a point each half millimetre; `read_profile` converts, and
interpolates between the points on request.
"""

from pathlib import Path

import numpy as np

import stiction as st

# Stands in for a measurement: x in mm, strength in MPa, in any order.
x = np.arange(0.0, 100.0, 0.5)
tau_p = 0.9 + 0.1 * np.cos(0.3 * x) + 0.05 * np.sin(1.1 * x)
rows = np.random.default_rng(0).permutation(np.column_stack([x, tau_p]))
np.savetxt("strength.csv", rows, delimiter=";", header="x (mm); strength (MPa)", comments="")

problem = st.Problem(
    solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    interface=st.Interface(length=0.1, nodes=1024),
    friction=st.LinearWeakening(weakening_rate=0.5e12),
)
profile = st.read_profile(Path("strength.csv"), interface=problem.interface, interpolate=True)
for method in (st.LocalCriterion(), st.Equilibrium()):
    onset = st.onset(problem, profile, method=method).isel(sample=0)
    stress, place = float(onset.critical_stress), float(onset.critical_position)
    print(
        f"{method.label}: slides at {stress / 1e6:.4f} MPa, beginning at {place * 1e3:.1f} mm"
    )
st.plot.onset(st.onset(problem, profile, method=st.Equilibrium()), profile)
