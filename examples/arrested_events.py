"""Which patches become unstable and are arrested before the interface slides as a whole?

Wide strength makes strong places that stop a patch. `equilibrium_events` lists the events,
`equilibrium_path` gives slip and stress at any load on the way.
"""

import numpy as np

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.RandomField(
    marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=3.66e6),  # Pa
    spectrum=st.PowerLawSpectrum(correlation_length=1.5e-3),
)
tau_p = strength.sample(problem.interface, samples=20, seed=0)
events = st.equilibrium_events(problem, tau_p)
print(f"{events.sizes['event']} arrested events in 20 samples")
for sample, stress, length in zip(
    events["sample"].values[:5], events.stress.values, events.length.values, strict=False
):
    print(f"sample {sample}: at {stress / 1e6:.3f} MPa, {length * 1e3:.1f} mm long")

busiest = int(np.bincount(events["sample"].values).argmax())
onset = st.onset(problem, tau_p[busiest], method=st.Equilibrium()).isel(sample=0)
loads = np.linspace(0.9 * float(onset.first_instability), float(onset.critical_load), 20)[:-1]
path = st.equilibrium_path(problem, tau_p[busiest], loads)
slipping = 100.0 * float((path.slip[-1] > 0.0).mean())
print(f"sample {busiest}: {int(path.arrested_events[-1])} events before {loads[-1] / 1e6:.3f} MPa;")
print(f"{slipping:.0f} % of the interface has slipped by then; it slides at", end=" ")
print(f"{float(onset.critical_stress) / 1e6:.3f} MPa")
st.plot.equilibrium_path(path.isel(load=slice(None, None, 4)))
