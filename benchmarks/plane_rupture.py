"""Cost of a rupture on a plane: a step beside its floor and beside a convolution, an onset, memory.

The floor of an explicit step is its transforms (two forward, two back) and one pass over the
memory variables. The direct convolution keeps every past slip rate in Fourier space and sums over
the last 500 of them, in one matrix product a wave vector.

Times are processor times of one core; an onset is from rest to sliding of the whole plane.

Run: python benchmarks/plane_rupture.py
"""

from __future__ import annotations

import statistics
import time
import tracemalloc

import numpy as np

import stiction as st
from stiction.dynamics import monitor
from stiction.dynamics.integrator import Run, State
from stiction.dynamics.loading import uniform_rate
from stiction.dynamics.memory_layout import advance_memory
from stiction.dynamics.method import first_slip, make_run
from stiction.elasticity.compiled_transform import backward, forward

TARGETS = {128: 1.0, 256: 6.0, 512: 28.0}  # ms
HISTORY = 500
REPEATS = 7
RATE = 0.5e12


def problem_and_strength(nodes: int) -> tuple[st.Problem, np.ndarray]:
    """A square plane with 12 nodes in h_n and the paper's strength, xi_0/h_n = 0.5."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    h_n = 2.0 * 0.57888694 * 1e9 / 0.67 / RATE
    length = nodes / 12.0 * h_n
    plane = st.Interface(length=(length, length), nodes=(nodes, nodes))
    field = st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        st.PowerLawSpectrum(correlation_length=0.5 * h_n),
    )
    problem = st.Problem(solid, plane, st.LinearWeakening(weakening_rate=RATE))
    return problem, field.sample(plane, samples=1, seed=1)


def prepared(nodes: int, *, implicit: bool) -> tuple[Run, State]:
    """A run from the first slip on that never ends."""
    problem, tau_p = problem_and_strength(nodes)
    method = st.Rupture(loading_rate=2e7, implicit=implicit)
    sample, history = problem.sample(tau_p), uniform_rate(method.loading_rate)
    run = make_run(method, problem.friction, method.medium(problem), sample, 0, history)
    run.control[monitor.SLID_STOP] = np.inf
    return run, run.start(first_slip(run))


def clocked(function, count: int) -> float:
    """Median processor time of a call, ms."""
    function()
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        for _ in range(count):
            function()
        times.append((time.process_time() - start) / count)
    return 1e3 * statistics.median(times)


def step_and_floor(nodes: int) -> tuple[float, float, float]:
    """A step, its four transforms and its pass over the memory, ms."""
    run, state = prepared(nodes, implicit=False)
    count = max(3, 10**6 // nodes**2)
    run.advance(state, 1)
    tables, grid = run.tables, run.medium.grid
    step = clocked(lambda: run.advance(state, count), 1) / count

    def transforms() -> None:
        for _ in range(2):
            forward(grid.transform, tables.guess, tables.shared)
            backward(grid.transform, tables.shared, tables.moved)

    def one_pass() -> None:
        advance_memory(
            state.memory, tables.table, tables.packed, state.carried, grid.poles.size, grid.copies
        )

    return step, clocked(transforms, count), clocked(one_pass, count)


def convolution(nodes: int) -> float:
    """One step of the same scheme with a sum over 500 past steps, ms, from a part of the modes."""
    modes = nodes * (nodes // 2 + 1)
    part = min(modes, 4096)
    rng = np.random.default_rng(0)
    weights = rng.random((part, 1, HISTORY))
    past = rng.random((part, HISTORY, 2))  # real and imaginary part
    values = rng.random((nodes, nodes))
    summed = clocked(lambda: weights @ past, 1) * modes / part

    def transforms() -> None:
        for _ in range(2):
            np.fft.irfft2(np.fft.rfft2(values))

    return summed + clocked(transforms, 1)


def onset(nodes: int, rate: float) -> tuple[float, str]:
    """Seconds from rest to sliding, and the steps that took."""
    problem, tau_p = problem_and_strength(nodes)
    solve = st.Rupture(loading_rate=rate).prepare(problem)
    start = time.process_time()
    found = solve(problem.sample(tau_p))
    steps = f"{found['implicit_steps'][0]} + {found['explicit_steps'][0]} steps"
    return time.process_time() - start, steps


def memory(nodes: int) -> float:
    """Largest memory of a run, implicit steps, the switch and explicit steps, MB."""
    tracemalloc.start()
    run, state = prepared(nodes, implicit=True)
    run.advance(state, 3)
    run._to_explicit(state)
    run.advance(state, 3)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def main() -> None:
    """Print the tables."""
    for rate in (2e7, 1e3):
        onset(64, rate)  # compiles
    print(
        f"explicit step, ms\n{'nodes':>10} {'step':>7} {'goal':>6} {'4 FFTs':>7} {'pass':>6}"
        f" {'x floor':>8} {'conv. 500':>10} {'ratio':>6}"
    )
    for nodes, target in TARGETS.items():
        step, transforms, once = step_and_floor(nodes)
        direct = convolution(nodes)
        print(
            f"{nodes:4d} x {nodes:3d} {step:7.2f} {target:6.1f} {transforms:7.2f} {once:6.2f}"
            f" {step / (transforms + once):8.2f} {direct:10.1f} {direct / step:6.1f}"
        )
    for nodes in TARGETS:
        print(f"memory of a run at {nodes} x {nodes}: {memory(nodes):.1f} MB at most, constant")
    for rate in (1e9, 2e7, 1e3):
        seconds, steps = onset(128, rate)
        print(f"onset at 128 x 128, {rate:g} Pa/s: {seconds:.2f} s ({steps})")


if __name__ == "__main__":
    main()
