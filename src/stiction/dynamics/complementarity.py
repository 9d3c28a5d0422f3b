"""One implicit step: slip increments u >= 0 with the stress nowhere above the strength.

(M - W on weakening nodes) u = g - strength on the slipping set, u = 0 and stress below strength
elsewhere; M is a circulant with positive symbol. The slipping set is found by a semismooth Newton
iteration (each node sticks, weakens or is at its residual strength), each linear problem by
conjugate gradients preconditioned with the inverse circulant.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction._jit import jit
from stiction._typing import Array


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
    weakening: Array,
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
            drop = weakening[i] if state[i] == 1 else 0.0
            residual[i] = driving[i] - product[i] + drop * u[i]
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
                if state[i] == 1:
                    product[i] -= weakening[i] * direction[i]
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
    rows: Array,
    slip: Array,
    pushed: Array,
    u: Array,
    state: Any,
    accuracy: float,
) -> Any:
    """Slip increments of one implicit step; returns whether they were found.

    Parameters
    ----------
    symbol, inverse : (nodes//2 + 1,) arrays
        Eigenvalues of M, Pa/m, and their inverses.
    rows : (6, nodes) array
        tau_p, tau_r, W, d_c, p, tau_i.
    slip : (nodes,) array
        Slip before the step, m.
    pushed : (nodes,) array
        Stress g after the step if nothing slipped in it, Pa.
    u : (nodes,) array
        First guess, and the increments found, m.
    state : (nodes,) int array
        0 stuck, 1 weakening, 2 residual; first guess, and as found.
    accuracy : float
        Pa.
    """
    n = u.size
    driving = np.empty(n)
    strength, floor, weakening, critical = rows[0], rows[1], rows[2], rows[3]
    for i in range(n):
        limit = max(strength[i] - weakening[i] * slip[i], floor[i])
        if state[i] == 0 and pushed[i] > limit:
            state[i] = 1
        if state[i] > 0:
            state[i] = 2 if slip[i] + u[i] >= critical[i] else 1
        else:
            u[i] = 0.0
    for _ in range(60):
        for i in range(n):
            if state[i] == 1:
                driving[i] = pushed[i] - (strength[i] - weakening[i] * slip[i])
            else:
                driving[i] = pushed[i] - floor[i]
        if not _solve(symbol, inverse, weakening, state, driving, u, accuracy):
            return False
        product = _apply(symbol, u)
        changed = 0
        for i in range(n):
            if state[i] == 0:
                limit = max(strength[i] - weakening[i] * slip[i], floor[i])
                if pushed[i] - product[i] > limit + 10.0 * accuracy:
                    state[i] = 2 if slip[i] >= critical[i] else 1
                    changed += 1
            elif u[i] < 0.0:
                state[i] = 0
                u[i] = 0.0
                changed += 1
            else:
                fresh = 2 if slip[i] + u[i] >= critical[i] else 1
                if fresh != state[i]:
                    state[i] = fresh
                    changed += 1
        if changed == 0:
            return True
    return False
