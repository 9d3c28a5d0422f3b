"""Which patches become unstable and are arrested before the interface slides as a whole?

Wide strength makes strong places that stop a patch. `Equilibrium(events=...)` keeps the first
events of each sample; `equilibrium_path` gives slip and stress at any load on the way.
"""

import numpy as np

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.RandomField(
    marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=3.66e6),  # Pa
    spectrum=st.PowerLawSpectrum(correlation_length=1.5e-3),
)
tau_p = strength.sample(problem.interface, samples=20, seed=0)
onsets = st.onset(problem, tau_p, method=st.Equilibrium(events=2))
print(f"{int(onsets.arrested_events.sum())} arrested events in 20 samples")
for sample in np.flatnonzero(onsets.arrested_events)[:5]:
    first = onsets.isel(sample=sample, event=0)
    stress, length = float(first.event_stress) / 1e6, float(first.event_length) * 1e3
    print(f"sample {sample}: at {stress:.3f} MPa, {length:.1f} mm long")

busiest = int(onsets.arrested_events.values.argmax())
onset = onsets.isel(sample=busiest)
loads = np.linspace(0.9 * float(onset.first_instability), float(onset.critical_load), 20)[:-1]
path = st.equilibrium_path(problem, tau_p[busiest], loads)
slipping = 100.0 * float((path.slip[-1] > 0.0).mean())
print(
    f"sample {busiest}: {int(path.arrested_events[-1])} events before {loads[-1] / 1e6:.3f} MPa;"
)
print(f"{slipping:.0f} % of the interface has slipped by then; it slides at", end=" ")
print(f"{float(onset.critical_stress) / 1e6:.3f} MPa")
path.slip.assign_coords(load=loads.round(-3))[::4].plot.line(x="x")
