"""
Seismograms
===========

Slip rate at three stations of a rupture through random strength.
"""

import matplotlib.pyplot as plt

import stiction as st

problem = st.paper.problem(nodes=512)
tau_p = st.paper.strength(problem, correlation_ratio=1.0).sample(problem.interface, seed=1)[0]
save = st.Save(stations={"10 mm": 0.01, "50 mm": 0.05, "90 mm": 0.09})
run = st.simulate_rupture(problem, tau_p, method=st.Rupture(loading_rate=2e7), save=save)
time = 1e6 * (run.step_time - run.step_time[-1])
figure, axes = plt.subplots(figsize=(6.75, 3.5), layout="constrained")
for name in save.stations:
    axes.plot(time, run.station_slip_rate.sel(station=name), label=name)
axes.set(xlim=(-60, 0), xlabel="time before global sliding (µs)", ylabel="slip rate (m/s)")
axes.legend()
