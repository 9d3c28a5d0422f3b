"""Cost of an onset by elastodynamics, from rest to global sliding, at any loading rate.

Reference: the same solver with explicit steps only, at the one rate where that is affordable.

Run: python benchmarks/rupture_onset.py
"""

from __future__ import annotations

import statistics
import time

import stiction as st
from stiction.dynamics.method import Rupture

RATES = (1e3, 1e5, 2e7, 1e9)
TARGET = 0.3  # s a sample


def main() -> None:
    """Print the table."""
    problem = st.paper.problem(nodes=1024, plane="stress")
    print("onset from rest at 1024 nodes, one core, median of 10 samples")
    print(
        f"{'xi_0/h_n':>8} {'Pa/s':>8} {'s a sample':>11} {'target':>7} {'implicit':>9} "
        f"{'explicit':>9}"
    )
    for ratio in (0.25, 0.5, 2.0):
        tau_p = st.paper.strength(problem, correlation_ratio=ratio).sample(
            problem.interface, samples=11, seed=1
        )
        for rate in RATES:
            solver = Rupture(loading_rate=rate).prepare(problem)
            solver(problem.sample(tau_p[:1]))
            times, implicit, explicit = [], [], []
            for profile in tau_p[1:]:
                start = time.perf_counter()
                found = solver(problem.sample(profile))
                times.append(time.perf_counter() - start)
                implicit.append(int(found["implicit_steps"][0]))
                explicit.append(int(found["explicit_steps"][0]))
            print(
                f"{ratio:8.2f} {rate:8.0e} {statistics.median(times):11.4f} {TARGET:7.1f} "
                f"{statistics.median(implicit):9.0f} {statistics.median(explicit):9.0f}"
            )
    profile = problem.sample(tau_p[1])
    both = []
    for implicit_too in (True, False):
        solver = Rupture(loading_rate=2e7, implicit=implicit_too).prepare(problem)
        start = time.perf_counter()
        found = solver(profile)
        both.append((time.perf_counter() - start, float(found["critical_stress"][0])))
    print(
        f"explicit only at 2e7 Pa/s: {both[1][0]:.2f} s, {both[1][0] / both[0][0]:.0f} times "
        f"as long; critical stress differs by {both[0][1] / both[1][1] - 1:.1e}"
    )


if __name__ == "__main__":
    main()
