"""Memory of a batch of ruptures of 1024 nodes: bytes of each part, and what a thousand take.

Run: python benchmarks/rupture_memory.py [interfaces]
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

import stiction as st
from stiction.dynamics.loading import uniform_rate
from stiction.dynamics.memory_layout import explicit_tables
from stiction.dynamics.method import Rupture, make_run

RATE = 2e7


def size(arrays: Iterable[Any]) -> float:
    """KiB of some arrays."""
    return sum(np.asarray(array).nbytes for array in arrays) / 1024


def resident() -> float:
    """MiB of this process now (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def main(interfaces: int) -> None:
    """Print the bytes."""
    problem = st.paper.problem(nodes=1024)
    method = Rupture(loading_rate=RATE)
    medium = method.medium(problem)
    tau_p = st.paper.strength(problem).sample(problem.interface, samples=interfaces, seed=0)
    rows = problem.sample(tau_p)

    def start(number: int) -> tuple[Any, Any]:
        run = make_run(method, problem.friction, medium, rows, number, uniform_rate(RATE))
        return run, run.start(0.04)

    run, state = start(0)
    table = medium.step_table()
    room = explicit_tables(medium.grid, medium.step, *table)
    print(f"{medium.grid.poles.size} pairs, {medium.grid.pace.size} modes; KiB of one interface:")
    print(f"  memory variables {size([state.memory]):.0f}")
    print(f"  other fields {size(state.fields) - size([state.memory]):.0f}")
    profiles = size(run.setting.nodes) + size([run.setting.scale_loads, run.setting.scales])
    print(f"  profiles and stress scale {profiles:.0f}")
    print(f"  room of explicit steps {size(room) - size(table):.0f}")
    print(f"  tables and room of implicit steps {size(run._implicit_tables()):.0f}")
    print(f"shared table of the explicit step {size(table):.0f}")
    before = resident()
    several = [start(number) for number in range(interfaces)]
    for _, state in several:
        state.memory[:] = 1e-300  # pages that are never written take no memory
    at_rest = resident()
    for run, state in several:
        state.memory[:] = 0.0
        state.explicit = True
        run.advance(state, 2)
    print(
        f"{interfaces} interfaces: {at_rest - before:.0f} MiB, after explicit steps of all"
        f" {resident() - before:.0f} MiB; peak of the process"
        f" {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
