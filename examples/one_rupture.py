"""What does one rupture look like in space and time, how fast is it, and what does it radiate?

Implicit steps follow the interface while it creeps, explicit ones its rupture; frames are dense
where much happens. The result is a dataset of slip, slip rate and stress over time and place.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(problem.interface, seed=1)[0]

method = st.Rupture(loading_rate=20e6)
run = st.simulate_rupture(problem, tau_p, method=method, save=st.Save(every=8))
print(f"{run.sizes['time']} frames, {run.sizes['step']} steps")
print(f"critical stress {float(run.critical_stress) / 1e6:.4f} MPa")
print(f"stress drop {float(run.stress_drop) / 1e6:.4f} MPa")
print(f"median speed of the front {float(run.median_rupture_speed):.0f} m/s")
print(f"radiated energy {float(run.radiated_energy[-1]):.2f} J/m")

peak = run.slip_rate.max("time")
first = float(run.x[run.arrival_time.values.argmin()])
print(f"it begins at {first * 1e3:.1f} mm; peak slip rate {float(peak.max()):.2f} m/s")
last = run.isel(time=-1)
print(f"slip at the end, {float(last['time']):.4f} s: {float(last.slip.mean()) * 1e6:.1f} um")
st.plot.rupture(run)
