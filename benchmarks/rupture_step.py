"""Cost of one explicit step, beside the same scheme with direct convolution over the history.

Both take the same predictor-corrector steps; the reference keeps every past slip rate in Fourier
space and sums over it, so its cost and its memory grow with time. It is truncated at the step
shown, which makes it cheaper than the full sum it would need for the same accuracy.

Times are processor times, so that other work on the machine counts less.

Run: python benchmarks/rupture_step.py
"""

from __future__ import annotations

import statistics
import time

import numpy as np

import stiction as st
from stiction.dynamics import monitor
from stiction.dynamics.courant_limit import phi
from stiction.dynamics.loading import uniform_rate
from stiction.dynamics.method import Rupture, first_slip, make_run
from stiction.elasticity.memory_kernels import arc_quadrature

TARGETS = {512: 16.0, 1024: 32.0, 2048: 65.0, 4096: 130.0}  # microseconds
REPEATS = 7


def prepared(nodes: int, tolerance: float = 1e-6):
    """A run of the paper's interface that steps explicitly from the first slip."""
    problem = st.paper.problem(nodes=nodes, plane="stress")
    tau_p = st.paper.strength(problem, correlation_ratio=0.5).sample(
        problem.interface, samples=1, seed=1
    )
    method = Rupture(loading_rate=2e7, implicit=False, kernel_tolerance=tolerance)
    run = make_run(
        method,
        problem.friction,
        method.medium(problem),
        problem.sample(tau_p),
        0,
        uniform_rate(method.loading_rate),
    )
    return run, run.start(first_slip(run))


def step_time(nodes: int, before: int = 100, count: int = 1000) -> float:
    """Median time of a step, us, after some steps were taken."""
    run, state = prepared(nodes)
    run.control[monitor.SLID_STOP] = np.inf
    run.advance(state, before)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        run.advance(state, count)
        times.append((time.process_time() - start) / count)
    return 1e6 * statistics.median(times)


def fft_time(nodes: int) -> float:
    """Four real transforms, us: the floor together with one pass over the memory."""
    from stiction.jit import jit

    @jit
    def transforms(values, count):
        total = 0.0
        for _ in range(count):
            total += np.fft.irfft(np.fft.rfft(values), values.size)[0]
        return total

    values = np.random.default_rng(0).random(nodes)
    transforms(values, 1)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        transforms(values, 1000)
        times.append((time.process_time() - start) / 1000)
    return 2e6 * statistics.median(times)


def pass_time(nodes: int) -> float:
    """One pass over the memory variables, us."""
    from stiction.dynamics.memory_layout import advance_memory

    run, state = prepared(nodes)
    pairs = run.medium.grid.poles.size
    run.advance(state, 1)
    rate = np.zeros_like(state.carried)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        for _ in range(500):
            advance_memory(state.memory, run.tables.table, rate, state.carried, pairs, 1)
        times.append((time.process_time() - start) / 500)
    return 1e6 * statistics.median(times)


def convolution_time(nodes: int, history: int) -> float:
    """One step with a direct sum over so many past steps (numpy, vectorised), us."""
    run, _ = prepared(nodes)
    medium = run.medium
    arcs = arc_quadrature("II", np.sqrt(2.0 / (1.0 - 0.33)))
    z = np.multiply.outer(arcs[0], medium.grid.pace * medium.step)
    first = arcs[1][:, None] * medium.step * phi(z)
    decay = np.exp(z)
    weights = np.empty((history, medium.grid.pace.size))
    for m in range(history):
        weights[m] = first.sum(axis=0).real
        first *= decay
    past = np.zeros((history, medium.grid.pace.size), dtype=complex)
    values = np.zeros(nodes)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        np.einsum("mk,mk->k", weights, past)
        for _ in range(2):
            np.fft.irfft(np.fft.rfft(values))
        times.append(time.process_time() - start)
    return 1e6 * statistics.median(times)


def main() -> None:
    """Print the table."""
    print("explicit step at a kernel error of 1e-6, one core, median; CPU times in us")
    print(
        f"{'nodes':>6} {'step':>7} {'target':>7} {'4 FFTs':>7} {'pass':>6} {'x floor':>8}"
        f" {'conv. 1000':>11} {'ratio':>7}"
    )
    for nodes, target in TARGETS.items():
        step, floor = step_time(nodes), (fft_time(nodes), pass_time(nodes))
        direct = convolution_time(nodes, 1000)
        print(
            f"{nodes:6d} {step:7.1f} {target:7.0f} {floor[0]:7.1f} {floor[1]:6.1f} "
            f"{step / sum(floor):8.2f} {direct:11.0f} {direct / step:7.1f}"
        )
    early, late = step_time(1024, before=100), step_time(1024, before=1_000_000)
    print(f"1024 nodes: {early:.1f} us after 100 steps, {late:.1f} us after 1,000,000")
    run, state = prepared(1024)
    run.advance(state, 1)
    arrays = [
        state.slip,
        state.rate,
        state.stress,
        state.slip_hat,
        state.memory,
        state.carried,
        state.arrival,
        run.medium.grid.stiffness,
        *run.setting.nodes,
        *run.tables[1:],
    ]
    print(f"memory of a run at 1024 nodes: {sum(a.nbytes for a in arrays) / 1e6:.2f} MB, constant")


if __name__ == "__main__":
    main()
