"""Cost of an onset by elastodynamics that begins at an equilibrium, and where the time goes.

Reference: the same run from the first slip, in the same process, to the same end.

Run: python benchmarks/rupture_start.py [samples]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import stiction as st
from stiction.dynamics import method as method_module
from stiction.dynamics.integrator import Run

RATE = 2e7
RATIOS = (0.25, 0.5, 1.0, 2.0)
TARGET = 30.0  # ms a sample, averaged over the ratios
PARTS = {
    "slow_start": (method_module, "find the start"),
    "_implicit": (Run, "implicit steps"),
    "_explicit": (Run, "explicit steps"),
    "_to_explicit": (Run, "change of steps"),
    "summary": (method_module, "scalars"),
}


def watched(spent: dict[str, float]) -> None:
    """Let each of the parts add the processor time it takes."""

    def around(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            before = time.process_time()
            result = function(*arguments)
            spent[name] += time.process_time() - before
            return result

        return timed

    for name, (owner, _) in PARTS.items():
        setattr(owner, name, around(name, getattr(owner, name)))


def main(samples: int) -> None:
    """Print the table: a row a correlation length, for two ends of a run."""
    problem = st.paper.problem(nodes=1024, plane="stress")
    spent = dict.fromkeys(PARTS, 0.0)
    watched(spent)
    words = [word for _, word in PARTS.values()]
    print(f"{samples} samples of 1024 nodes at {RATE:.0e} Pa/s, ms of processor time a sample")
    print(
        f"{'stop':>8} {'xi_0/h_n':>8} {'rest':>6} {'start':>6} {'ratio':>5}  of it: "
        + ", ".join(words)
    )
    for stop in ("runaway", "sliding"):
        totals = []
        for ratio in RATIOS:
            tau_p = st.paper.strength(problem, correlation_ratio=ratio).sample(
                problem.interface, samples=samples, seed=0
            )
            rows, times, found = problem.sample(tau_p), [], []
            for start in ("rest", "equilibrium"):
                solver = st.Rupture(loading_rate=RATE, start=start, stop=stop).prepare(problem)
                solver(rows.part(slice(0, 1)))
                spent.update(dict.fromkeys(PARTS, 0.0))
                before = time.process_time()
                found.append(solver(rows))
                times.append((time.process_time() - before) / samples * 1e3)
            rest, near = (one["critical_stress"] for one in found)
            apart = np.abs(near / rest - 1.0)
            shares = ", ".join(f"{value / samples * 1e3:.1f}" for value in spent.values())
            print(
                f"{stop:>8} {ratio:8.2f} {times[0]:6.1f} {times[1]:6.1f}"
                f" {times[0] / times[1]:5.1f}  {shares};"
                f" critical stress apart {np.median(apart):.0e} (worst {apart.max():.0e})",
                flush=True,
            )
            totals.append(times)
        rest, near = np.mean(totals, axis=0)
        print(f"{stop:>8}     mean {rest:6.1f} {near:6.1f} {rest / near:5.1f}  target {TARGET:.0f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
