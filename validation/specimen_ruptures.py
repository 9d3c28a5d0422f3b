"""Ruptures with inertia on specimens beside overdamped ones: events, static friction, trends.

    python validation/specimen_ruptures.py [drives | friction | vary] [--samples 30] [--nodes 128]

`drives`: for each drive, random strengths as in the example of docs/guide/specimens.md. Every
instability of the path with inertia is also let come to rest overdamped, from the same state.
Printed are the events, how many of them are shorter with inertia, how many run through all of the
interface though overdamped ones rest, static friction, front speeds, and the ends of first events.
`friction`: the same below dead load, where the strength is correlated over half of the nucleation
length. `vary`: in a machine of finite stiffness, with half and twice the attenuation and further,
and with heavier platens.
"""

import argparse
import time

import numpy as np

import stiction as st
from stiction.methods.dynamics.specimens import RuptureSearch
from stiction.methods.dynamics.summary import front_speeds
from stiction.methods.equilibrium.solver import follow_to_sliding, make_search, sample_of
from stiction.methods.equilibrium.state import Outcome, PathStatus

MACHINE = 2e7
DRIVES = {
    "platen, dead load": st.Platen(),
    "platen, machine": st.Platen(stiffness=MACHINE),
    "pusher at H/2, machine": st.Pusher(height=0.025, width=0.005, stiffness=MACHINE),
    "pusher at H/5, machine": st.Pusher(height=0.01, width=0.004, stiffness=MACHINE),
    "pusher at H/10, machine": st.Pusher(height=0.005, width=0.002, stiffness=MACHINE),
}
DEAD = {
    "platen, dead load": st.Platen(),
    "pusher at H/2, dead load": st.Pusher(height=0.025, width=0.005),
    "pusher at H/5, dead load": st.Pusher(height=0.01, width=0.004),
}
QUALITIES = (6.25, 12.5, 25.0, 50.0, float("inf"))
MASSES = (0.035, 0.1, 0.5)
"""Of a platen, kg; the block has 0.035."""


def strength_of(length: float) -> st.RandomField:
    """Return the strength with a correlation length, m."""
    beta = st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
    return st.RandomField(beta, st.PowerLawSpectrum(correlation_length=length))


STRENGTH = strength_of(1.75e-3)


def problem_with(drive: st.Platen | st.Pusher, nodes: int, quality: float) -> st.Problem:
    """Return the specimen with a drive."""
    return st.Problem(
        solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        interface=st.Interface(length=0.1, nodes=nodes),
        friction=st.LinearWeakening(weakening_rate=0.2e12, residual_strength=0.5e6),
        specimen=st.Blocks(height=0.05, thickness=0.006, drive=drive, quality_factor=quality),
    )


def compared(
    problem: st.Problem, samples: int, strengths: st.RandomField
) -> dict[str, list[float]]:
    """Return what is compared, a number for each event or each sample."""
    search, overdamped = RuptureSearch(problem, st.Rupture()), make_search(problem)
    names = ["shorter", "through", "drop", "seconds", "speed", "stress", "end", "count"]
    found: dict[str, list[float]] = {name: [] for name in names}
    for strength in strengths.sample(problem.interface, samples=samples, seed=1):
        rows = problem.sample(strength)
        sample = sample_of(rows, search.pieces, 0)
        began = time.process_time()
        path = follow_to_sliding(search, sample)
        found["seconds"].append(time.process_time() - began)
        found["count"].append(len(path.events))
        found["drop"].append(path.peak / follow_to_sliding(overdamped, sample).peak - 1.0)
        states = [(event.before, event.after) for event in path.events]
        for before, after in [*states, (path.last, None)]:
            if before.status != PathStatus.UNSTABLE:
                continue
            least = overdamped.jump(sample, before)
            arrested = least.outcome == Outcome.ARRESTED
            event = search.event(sample, before)
            event.run(search.max_steps)
            found["through"].append(float(arrested and after is None))
            if after is not None:  # as the waves leave it, before the rest comes to rest
                short = least.state.slip - event.waves.slip
                added = (event.waves.slip - before.slip).max()
                found["shorter"].append(float(short.max() > 1e-3 * added or not arrested))
            length = problem.nucleation_lengths(rows.steepest_weakening_rate)[0]
            speeds = front_speeds(problem.interface, 0, event.waves.arrival, length)
            speed = speeds["median_rupture_speed"]
            if np.isfinite(speed):
                found["speed"].append(speed / problem.solid.rayleigh_wave_speed)
                found["stress"].append(float(event.start.mean()))
        if path.events:
            slid = path.events[0].after.slip > 0.0
            found["end"].append(float(np.flatnonzero(slid)[-1] + 1) / problem.interface.size)
    return found


def report(
    name: str, problem: st.Problem, samples: int, strengths: st.RandomField = STRENGTH
) -> None:
    """Print a line of the table."""
    result = compared(problem, samples, strengths)
    found = {key: np.array(values) for key, values in result.items()}
    speed, drop = found["speed"], 100.0 * found["drop"]
    low, high = np.quantile(speed, [0.1, 0.9]) if speed.size else (np.nan, np.nan)
    trend = np.corrcoef(speed, found["stress"])[0, 1] if speed.size > 4 else np.nan
    end = 100.0 * found["end"].mean() if found["end"].size else np.nan
    print(
        f"{name}: {found['through'].size} events, {int(found['shorter'].sum())} shorter with"
        f" inertia, {int(found['through'].sum())} run through though overdamped ones rest;"
        f" static friction {drop.mean():+.2f} % ({drop.min():+.2f} to {drop.max():+.2f});"
        f" {found['count'].mean():.1f} precursors a sample, the first ends at {end:.0f} %;"
        f" {speed.size} front speeds {low:.2f} to {high:.2f} c_R, correlation with the stress"
        f" {trend:.2f}; {found['seconds'].mean():.2f} s a sample",
        flush=True,
    )


def main() -> None:
    """Print the asked table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("table", nargs="?", choices=("drives", "friction", "vary"))
    parser.add_argument("--samples", type=int, default=30)
    parser.add_argument("--nodes", type=int, default=128)
    given = parser.parse_args()
    nodes, samples = given.nodes, given.samples
    if given.table in (None, "drives"):
        for name, drive in DRIVES.items():
            report(name, problem_with(drive, nodes, 25.0), samples)
    if given.table in (None, "friction"):
        for name, drive in DEAD.items():
            report(name, problem_with(drive, nodes, 25.0), samples, strength_of(4.35e-3))
    if given.table in (None, "vary"):
        for name in ("platen, machine", "pusher at H/5, machine"):
            for quality in QUALITIES:
                problem = problem_with(DRIVES[name], nodes, quality)
                report(f"Q = {quality:g}, {name}", problem, samples)
        for mass in MASSES:
            heavy = st.Platen(stiffness=MACHINE, mass=mass)
            report(f"platen of {mass:g} kg", problem_with(heavy, nodes, 25.0), samples)


if __name__ == "__main__":
    main()
