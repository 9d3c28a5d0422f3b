"""Ruptures on lines: their speed, their onset beside exact equilibrium, and the error of a grid.

Prints the tables of docs/evidence/accuracy.md. Run:
``python validation/ruptures.py {speed,onset,grid}``

`speed`: uniform strength, a weak patch that breaks at once, against the driving S = (tau_p - tau_0)
/ (tau_0 - tau_r). For weak driving it tends to the Rayleigh speed from below; for strong driving it
is supershear (Burridge 1973, Andrews 1976: in an unbounded medium below S of about 1.77).
`onset`: the first instability at several loading rates over that of equilibrium, less one; the
difference vanishes with the rate. `grid`: the same continuous strength on ever more nodes, against
the finest grid: slip when the mean stress has fallen by 5 % of the mean of tau_p - tau_r after its
peak, and critical stress.
"""

import sys
import warnings

import numpy as np

import stiction as st
from stiction.methods.dynamics.summary import rupture_speed

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0, plane="strain")
RATE, STRENGTH = 1e12, 1e6
DRIVINGS = (0.5, 0.8, 1.2, 1.6, 2.0, 3.5)
RATIOS = (0.25, 0.5, 2.0)  # xi_0/h_n
LOADING_RATES = (1e3, 1e4, 1e5, 1e6, 2e7, 1e8, 1e9)  # Pa/s
FALL, GRIDS = 0.05, (256, 512, 1024, 2048, 4096)


def strengths(problem, ratio, samples, seed, first=0):
    """Return strengths of the paper, Pa, (samples, nodes)."""
    field = st.paper.strength(problem, correlation_ratio=ratio)
    return field.sample(problem.interface, samples=samples, seed=seed, first=first)


def final_speed(driving, nodes=4096):
    """Return the speed, in c_R, at 0.85 of the half period."""
    modulus = SOLID.effective_modulus("II")
    spacing = 1.158 * modulus / RATE / 20.0
    interface = st.Interface(length=nodes * spacing, nodes=nodes)
    problem = st.Problem(SOLID, interface, st.LinearWeakening(weakening_rate=RATE))
    load = STRENGTH / (1.0 + driving)
    # Griffith length of a crack with fracture energy tau_p^2/(2 W) under the drop tau_0.
    griffith = 2.0 * modulus * STRENGTH**2 / (np.pi * RATE * load**2)
    away = np.abs(interface.x - 0.5 * interface.length)
    run = st.simulate_rupture(
        problem,
        np.where(away < 0.75 * griffith, 0.98 * load, STRENGTH),
        method=st.Rupture(load_history=([0.0, 1.0], [load, load]), implicit=False),
        save=st.Save([], every=500),
    )
    found, _ = rupture_speed(run["arrival_time"].values, spacing, problem.nucleation_length)
    found = found[nodes // 2 : nodes // 2 + int(0.425 * nodes)]
    return found[np.isfinite(found)][-20:].mean() / SOLID.rayleigh_wave_speed


def speed():
    """Print final speeds."""
    for driving in DRIVINGS:
        print(f"S = {driving:3.1f}: final speed {final_speed(driving):.4f} c_R", flush=True)


def onset(nodes=512, samples=5):
    """Print relative differences of the first instability."""
    problem = st.paper.problem(nodes=nodes, plane="stress")

    def first(tau_p, method):
        return st.onset(problem, tau_p, method=method)["first_instability"].values

    for ratio in RATIOS:
        tau_p = strengths(problem, ratio, samples, seed=3)
        exact = first(tau_p, st.Equilibrium())
        for loading_rate in LOADING_RATES:
            away = first(tau_p, st.Rupture(loading_rate=loading_rate)) / exact - 1.0
            print(
                f"xi_0/h_n = {ratio:4.2f}, {loading_rate:7.0e} Pa/s: mean {away.mean():+.2e},"
                f" largest {np.abs(away).max():.2e}",
                flush=True,
            )


def after_onset(nodes, ratio, sample):
    """Return slip, m, at the fall of the mean stress, and critical stress, Pa."""
    problem = st.paper.problem(nodes=nodes)
    [tau_p] = strengths(problem, ratio, 1, seed=5, first=sample)
    method, save = st.Rupture(loading_rate=2e7), st.Save(["slip"], every=1)
    run = st.simulate_rupture(problem, tau_p, method=method, save=save)
    drop = FALL * np.mean(tau_p - problem.friction.residual_strength)
    stress, slip = run["mean_stress"].values, run["slip"].values
    peak = int(np.argmax(stress))
    limit = stress[peak] - drop
    last = peak + int(np.argmax(stress[peak:] < limit))
    share = (stress[last - 1] - limit) / (stress[last - 1] - stress[last])
    return slip[last - 1] + share * (slip[last] - slip[last - 1]), float(run["critical_stress"])


def grid(samples=6):
    """Print errors of slip and critical stress."""
    for ratio in RATIOS:
        references = [after_onset(GRIDS[-1], ratio, i) for i in range(samples)]
        for nodes in GRIDS[:-1]:
            errors = []
            for i, (fine, critical) in enumerate(references):
                slip, stress = after_onset(nodes, ratio, i)
                change = np.abs(slip - fine[:: GRIDS[-1] // nodes]).max() / fine.max()
                errors.append((change, abs(stress / critical - 1)))
            (slip, stress), problem = np.array(errors).T, st.paper.problem(nodes=nodes)
            resolution = problem.nucleation_length / problem.interface.spacing
            print(
                f"xi_0/h_n = {ratio:4.2f}, {resolution:4.1f} nodes to h_n: slip median"
                f" {np.median(slip):.4f}, largest {slip.max():.4f}; critical stress, largest"
                f" {stress.max():.1e}",
                flush=True,
            )


if __name__ == "__main__":
    warnings.simplefilter("ignore", st.AccuracyWarning)
    tables = {table.__name__: table for table in (speed, onset, grid)}
    if len(sys.argv) != 2 or sys.argv[1] not in tables:
        sys.exit(__doc__)
    tables[sys.argv[1]]()
