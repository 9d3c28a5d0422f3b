"""The elastodynamic memory kernel of a half-space, as a quadrature over arcs.

With T = |k| c_s t, the stress that a Fourier mode of slip D and slip rate V transfers along
the interface between two identical half-spaces is (velocity form, Breitenfeld and Geubelle
1998)

    F(k, t) = -(G*|k|/2) D(k, t) + (G|k|/2) int_0^t C(|k| c_s t') V(k, t - t') dt'.

Everything follows from the Laplace symbol D(s) of the traction per slip, in units of G|k|/2
with s in units of |k| c_s (Geubelle and Rice 1995): in mode III sqrt(1 + s^2), in mode II

    [(2 + s^2)^2 - 4 sqrt(1 + s^2) sqrt(1 + s^2/eta^2)] / (s^2 sqrt(1 + s^2)), eta = c_d/c_s.

Its inverse transform is taken along arcs in Re s < 0 that join the branch points, where the
integrand is smooth and decays, so that one set of nodes is accurate for every T. The closed
forms by Bessel functions cancel badly beyond T of 7.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

_STEP = 0.025  # of the tanh-sinh rule; at 0.05 the kernel is off by 6e-11 at T = 1e5
_RANGE = (
    4.4  # the outermost node lies 1e-55 from the branch point: its weight underflows any sum
)
_CHUNK = 2048


def static_stiffness(mode: str, eta: float) -> float:
    """D(0) = G*/G (1): 2 (1 - 1/eta^2) in mode II, 1 in mode III."""
    return 1.0 if mode == "III" else 2.0 * (1.0 - 1.0 / eta**2)


def _half_arc() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles from the upper branch point and weights, tanh-sinh, of the upper half of an arc."""
    t = np.arange(0.0, _RANGE, _STEP)
    angle = np.pi / (1.0 + np.exp(np.pi * np.sinh(t)))
    weight = (np.pi**2 / 4.0) * _STEP * np.cosh(t) / np.cosh(0.5 * np.pi * np.sinh(t)) ** 2
    weight[0] *= 0.5
    return angle, weight


def arc_quadrature(
    mode: str, eta: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Nodes s, Re s < 0, and weights w, some 140 an arc, with C(T) = Re sum w exp(s T), T >= 0.

    The transform of C is (D(0) + s - D(s))/s; only its parts that are odd across the arc
    |s| = 1 (the shear root) and |s| = eta (the dilatational root) contribute.
    """
    angle, weight = _half_arc()
    turn = np.exp(1j * angle)
    # sqrt(1 + s^2) at s = i turn, without cancellation beside the branch point.
    root = np.sqrt(2.0 * np.sin(angle)) * np.exp(1j * (0.5 * angle - 0.25 * np.pi))
    factor = turn * weight * (2.0 / (np.pi * 1j))
    s = 1j * turn
    if mode == "III":
        nodes, weights = s, -root / s * factor
    else:
        fast = eta * s
        nodes = np.concatenate([s, fast])
        weights = np.concatenate(
            [
                -((2.0 + s * s) ** 2) / (s**3 * root) * factor,
                4.0 * root / fast**3 * eta * factor,
            ]
        )
    kept = np.abs(weights) > 1e-18
    return nodes[kept], weights[kept]


def exponential_sum(
    time: ArrayLike, nodes: NDArray[np.complex128], weights: NDArray[np.complex128]
) -> NDArray[np.float64]:
    """Re sum_p w_p exp(s_p T) at the dimensionless times T (any shape)."""
    t = np.asarray(time, dtype=np.float64)
    flat, result = t.ravel(), np.empty(t.size)
    for start in range(0, t.size, _CHUNK):  # bounded memory for long lists of times
        part = slice(start, start + _CHUNK)
        result[part] = (np.exp(np.multiply.outer(flat[part], nodes)) @ weights).real
    return result.reshape(t.shape)


def memory_kernel(time: ArrayLike, mode: str, eta: float) -> NDArray[np.float64]:
    """The kernel C(T) of the velocity form at times T, any shape, to about 2e-15 for all T >= 0.

    C(0) = G*/G; it falls like T^-1/2 (mode II) or T^-3/2 (mode III), so never truncate it.
    """
    return exponential_sum(time, *arc_quadrature(mode, eta))
