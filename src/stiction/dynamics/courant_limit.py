"""The largest stable explicit time step, from the amplification of a freely sliding mode."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from stiction.elasticity.exponential_sum import ExponentialSum
from stiction.elasticity.memory_kernels import static_stiffness

_GROWTH = 1e-5  # a step; a rupture takes thousands


def phi(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(exp(z) - 1)/z, also for small z."""
    small = np.abs(z) < 1e-3
    series = 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0)))
    safe = np.where(small, 1.0, z)
    return np.where(small, series, np.expm1(safe) / safe)


def amplification(kappa: float, kernel: ExponentialSum, stiffness: float) -> NDArray[np.float64]:
    """One predictor-corrector step of a frictionless mode as a matrix, kappa = |k| c_s dt."""
    pairs = kernel.poles.size
    z = kernel.poles * kappa
    decay, gain = np.exp(z), kappa * phi(z)
    fresh = float(np.sum(kernel.weights * gain).real)
    state = np.eye(2 + 2 * pairs)
    rate, slip = state[0], state[1]
    memory = state[2 : 2 + pairs] + 1j * state[2 + pairs :]
    carried = ((kernel.weights * decay) @ memory).real
    guess = -stiffness * (slip + kappa * rate) + carried + fresh * rate
    mean = 0.5 * (rate + guess)
    moved = slip + kappa * mean
    memory = decay[:, None] * memory + gain[:, None] * mean
    rate = -stiffness * moved + carried + fresh * mean
    return np.vstack([rate, moved, memory.real, memory.imag])


def _stable(kappa: float, kernel: ExponentialSum, stiffness: float) -> bool:
    matrix = amplification(kappa, kernel, stiffness)
    growth = np.abs(np.linalg.eigvals(matrix)).max() - 1.0
    return bool(growth < _GROWTH)


@functools.lru_cache(maxsize=64)
def _limit(mode: str, eta: float, poles: bytes, weights: bytes, error: float) -> float:
    kernel = ExponentialSum(
        np.frombuffer(poles, complex), np.frombuffer(weights, complex), error, 0.0
    )
    stiffness = static_stiffness(mode, eta)
    low, high = 0.0, 0.1
    while high < 6.0 and _stable(high, kernel, stiffness):
        low, high = high, high + 0.1
    if low == 0.0:  # long waves grow: that is the kernel, which no smaller step mends
        return 0.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stable(middle, kernel, stiffness) else (low, middle)
    return low / np.pi


def courant_limit(mode: str, eta: float, kernel: ExponentialSum) -> float:
    """Largest stable c_s dt / dx (1) of the explicit predictor-corrector.

    The criterion is the shortest wave of the grid (kappa = pi c_s dt/dx) on an interface that
    slides freely, which carries undamped Rayleigh waves: no eigenvalue of the step may grow. It is
    0 where the error of the kernel makes those waves grow whatever the step.
    """
    return _limit(mode, eta, kernel.poles.tobytes(), kernel.weights.tobytes(), kernel.error)
