"""The largest stable explicit time step, from the amplification of a freely sliding mode."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from stiction.elasticity.exponential_sum import ExponentialSum
from stiction.elasticity.kernel_cache import kernel_sum
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
    return _largest(kernel, static_stiffness(mode, eta)) / np.pi


def _largest(kernel: ExponentialSum, stiffness: float) -> float:
    """Largest |k| c_s dt up to which no wave grows."""
    low, high = 0.0, 0.1
    while high < 6.0 and _stable(high, kernel, stiffness):
        low, high = high, high + 0.1
    if low == 0.0:  # long waves grow: that is the kernel, which no smaller step mends
        return 0.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stable(middle, kernel, stiffness) else (low, middle)
    return low


def _mixed(in_plane: ExponentialSum, anti_plane: ExponentialSum, share: float) -> ExponentialSum:
    """The kernel of a wave vector on a plane, whose share of mode II is (kx/k)²."""
    return ExponentialSum(
        np.concatenate([in_plane.poles, anti_plane.poles]),
        np.concatenate([share * in_plane.weights, (1.0 - share) * anti_plane.weights]),
        max(in_plane.error, anti_plane.error),
        min(in_plane.t_max, anti_plane.t_max),
    )


@functools.lru_cache(maxsize=64)
def plane_limit(
    eta: float, tolerance: float, memory_range: float, spacings: tuple[float, float]
) -> float:
    """Largest stable c_s dt (m) of the explicit predictor-corrector on a plane.

    The shortest waves of a grid lie on the rim of the rectangle |kx| <= pi/dx, |ky| <= pi/dy, and
    differ in length and in their share of mode II. The limit is that of the two axes and of the
    corner, shortened until waves in between do not grow either. 0 as in `courant_limit`.
    """
    in_plane = kernel_sum("II", eta, tolerance, memory_range)
    anti_plane = kernel_sum("III", eta, tolerance, memory_range)
    dx, dy = spacings
    static = static_stiffness("II", eta)

    def waves(points: list[tuple[float, float]]) -> list[tuple[float, ExponentialSum, float]]:
        found = []
        for a, b in points:  # in units of the rim
            kx, ky = a * np.pi / dx, b * np.pi / dy
            share = float(kx**2 / (kx**2 + ky**2))
            kernel = _mixed(in_plane, anti_plane, share)
            found.append((float(np.hypot(kx, ky)), kernel, share * static + 1.0 - share))
        return found

    limit = min(
        _largest(kernel, stiffness) / k
        for k, kernel, stiffness in waves([(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    )
    between = waves([(1.0, 0.25), (1.0, 0.5), (1.0, 0.75), (0.75, 1.0), (0.5, 1.0), (0.25, 1.0)])
    while limit > 0.0 and not all(
        _stable(k * limit, kernel, stiffness) for k, kernel, stiffness in between
    ):
        limit *= 0.99
    return limit


def courant_limit(mode: str, eta: float, kernel: ExponentialSum) -> float:
    """Largest stable c_s dt / dx (1) of the explicit predictor-corrector.

    The criterion is the shortest wave of the grid (kappa = pi c_s dt/dx) on an interface that
    slides freely, which carries undamped Rayleigh waves: no eigenvalue of the step may grow. It is
    0 where the error of the kernel makes those waves grow whatever the step.
    """
    return _limit(mode, eta, kernel.poles.tobytes(), kernel.weights.tobytes(), kernel.error)
