"""My load is not uniform: where does sliding begin, and which mean stress is held?

The shear stress is tau_i(x) + tau_0 p(x): here twice as high at the ends, as under a loaded block,
on top of a residual stress from assembly; tau_0 rises.
"""

import numpy as np

import stiction as st

plain = st.paper.problem(nodes=512)
x = plain.interface.x / plain.interface.length
loads = {
    "uniform": st.Load(),
    "high at the ends": st.Load(profile=1.0 + np.cos(np.pi * x) ** 8),
    "uniform, with initial stress": st.Load(initial_stress=0.2e6 * np.sin(2.0 * np.pi * x)),
}
strength = st.paper.strength(plain, correlation_ratio=0.5)
onsets = {}
for name, load in loads.items():
    problem = st.Problem(plain.solid, plain.interface, plain.friction, load)
    onsets[name] = st.monte_carlo(
        problem, strength, method=st.Equilibrium(), samples=300, seed=0, progress=False
    )
    place = onsets[name].critical_position / plain.interface.length
    middle = 100.0 * float(((place > 0.25) & (place < 0.75)).mean())
    mean = float(onsets[name].critical_stress.mean())
    print(f"{name}: {mean / 1e6:.3f} MPa on average, {middle:.0f} % begin in the middle half")
st.plot.monte_carlo(onsets, quantity="critical_position")
