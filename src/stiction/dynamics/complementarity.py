"""One implicit step: slip increments u >= 0 with the stress nowhere above the strength.

(M - W) u = g - strength on the slipping set, u = 0 and stress below strength elsewhere; M is a
circulant with positive symbol, W how fast the strength of each node falls where it goes. The
slipping set, and the straight line that the strength of each node follows, are found by a
semismooth Newton iteration, each linear problem by conjugate gradients preconditioned with the
inverse circulant.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction._jit import jit
from stiction._typing import Array
from stiction.friction.kernels import line_at, strength_at


@jit
def _apply(symbol: Array, vector: Array) -> Any:
    spectrum = np.fft.rfft(vector)
    for j in range(spectrum.size):
        spectrum[j] *= symbol[j]
    return np.fft.irfft(spectrum, vector.size)


@jit
def _solve(
    symbol: Array,
    inverse: Array,
    falling: Array,
    state: Any,
    driving: Array,
    u: Array,
    accuracy: float,
) -> Any:
    """Conjugate gradients on the slipping set, from u in place; False at negative curvature."""
    n = u.size
    product = _apply(symbol, u)
    residual = np.empty(n)
    worst = 0.0
    for i in range(n):
        residual[i] = 0.0
        if state[i] > 0:
            residual[i] = driving[i] - product[i] + falling[i] * u[i]
            worst = max(worst, abs(residual[i]))
    if not worst > accuracy:
        return worst <= accuracy
    direction = np.zeros(n)
    gain_before = 1.0
    for iteration in range(400):
        z = _apply(inverse, residual)
        gain = 0.0
        for i in range(n):
            if state[i] > 0:
                gain += z[i] * residual[i]
        beta = gain / gain_before if iteration > 0 else 0.0
        for i in range(n):
            direction[i] = z[i] + beta * direction[i] if state[i] > 0 else 0.0
        product = _apply(symbol, direction)
        curvature, stiff = 0.0, 0.0
        for i in range(n):
            if state[i] > 0:
                stiff += direction[i] * product[i]
                product[i] -= falling[i] * direction[i]
                curvature += direction[i] * product[i]
        if not curvature > 1e-10 * stiff:
            return False
        alpha = gain / curvature
        worst = 0.0
        for i in range(n):
            if state[i] > 0:
                u[i] += alpha * direction[i]
                residual[i] -= alpha * product[i]
                worst = max(worst, abs(residual[i]))
        if worst <= accuracy:
            return True
        gain_before = gain
    return False


@jit
def solve_increment(
    symbol: Array,
    inverse: Array,
    law: Any,
    rows: Array,
    slip: Array,
    pushed: Array,
    u: Array,
    state: Any,
    accuracy: float,
    near: float,
) -> Any:
    """Slip increments of one implicit step; returns whether they were found.

    Parameters
    ----------
    symbol, inverse : (nodes//2 + 1,) arrays
        Eigenvalues of M, Pa/m, and their inverses.
    law : NamedTuple
        ``friction.parameters``.
    rows : (6, nodes) array
        As in `Run`.
    slip : (nodes,) array
        Slip before the step, m.
    pushed : (nodes,) array
        Stress g after the step if nothing slipped in it, Pa.
    u : (nodes,) array
        First guess, and the increments found, m.
    state : (nodes,) int array
        0 stuck, 1 slipping; first guess, and as found.
    accuracy : float
        Pa.
    near : float
        Distance (Pa) of the strength from the straight line it is taken for at which that will do.
    """
    n = u.size
    driving, falling = np.empty(n), np.empty(n)
    strength, floor, weakening = rows[0], rows[1], rows[2]
    for i in range(n):
        limit = strength_at(law, strength[i], floor[i], weakening[i], slip[i])
        if state[i] == 0 and pushed[i] > limit:
            state[i] = 1
        if state[i] == 0:
            u[i] = 0.0
        start, falling[i] = line_at(law, strength[i], floor[i], weakening[i], slip[i], u[i])
        driving[i] = pushed[i] - start
    for _ in range(60):
        if not _solve(symbol, inverse, falling, state, driving, u, accuracy):
            return False
        product = _apply(symbol, u)
        changed = 0
        for i in range(n):
            if state[i] == 0:
                limit = strength_at(law, strength[i], floor[i], weakening[i], slip[i])
                if pushed[i] - product[i] > limit + 10.0 * accuracy:
                    state[i] = 1
                    changed += 1
            elif u[i] < 0.0:
                state[i] = 0
                u[i] = 0.0
                changed += 1
            start, slope = line_at(law, strength[i], floor[i], weakening[i], slip[i], u[i])
            old = driving[i] + falling[i] * u[i]
            driving[i] = pushed[i] - start
            if state[i] > 0 and abs(driving[i] + slope * u[i] - old) > near:
                changed += 1
            falling[i] = slope
        if changed == 0:
            return True
    return False
