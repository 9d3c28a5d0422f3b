"""One implicit step: slip increments u >= 0 with the stress nowhere above the strength.

(M - W) u = g - strength on the slipping set, u = 0 and stress below strength elsewhere; M is a
circulant with positive symbol, W the rate at which each node weakens. A semismooth Newton
iteration finds the slipping set and the straight line that the strength of each node follows;
conjugate gradients, preconditioned with the inverse circulant, solve each linear problem.
"""

from typing import Any

from stiction.base.arrays import Array
from stiction.base.jit import jit_inside
from stiction.elasticity.operator import Transform, convolve
from stiction.methods.dynamics.state import ImplicitTables, Setting
from stiction.problem.friction.kernels import line_at, strength_at


@jit_inside
def _solve(transform: Transform, tables: ImplicitTables, accuracy: float) -> Any:
    """Conjugate gradients on the slipping set, from u in place; False at negative curvature."""
    u, slipping, driving = tables.increment, tables.slipping, tables.driving
    falling, product, residual = tables.falling, tables.product, tables.residual
    z, direction, work = tables.other, tables.direction, tables.work
    n = u.size
    convolve(transform, tables.symbol, u, work, product)
    worst = 0.0
    for i in range(n):
        residual[i] = direction[i] = 0.0
        if slipping[i] > 0:
            residual[i] = driving[i] - product[i] + falling[i] * u[i]
            worst = max(worst, abs(residual[i]))
    if not worst > accuracy:
        return worst <= accuracy
    gain_before = 1.0
    for iteration in range(400):
        convolve(transform, tables.inverse, residual, work, z)
        gain = 0.0
        for i in range(n):
            if slipping[i] > 0:
                gain += z[i] * residual[i]
        beta = gain / gain_before if iteration > 0 else 0.0
        for i in range(n):
            direction[i] = z[i] + beta * direction[i] if slipping[i] > 0 else 0.0
        convolve(transform, tables.symbol, direction, work, product)
        curvature, stiff = 0.0, 0.0
        for i in range(n):
            if slipping[i] > 0:
                stiff += direction[i] * product[i]
                product[i] -= falling[i] * direction[i]
                curvature += direction[i] * product[i]
        if not curvature > 1e-10 * stiff:
            return False
        alpha = gain / curvature
        worst = 0.0
        for i in range(n):
            if slipping[i] > 0:
                u[i] += alpha * direction[i]
                residual[i] -= alpha * product[i]
                worst = max(worst, abs(residual[i]))
        if worst <= accuracy:
            return True
        gain_before = gain
    return False


@jit_inside
def solve_increment(
    transform: Transform,
    setting: Setting,
    slip: Array,
    tables: ImplicitTables,
    accuracy: float,
    near: float,
) -> Any:
    """Find the slip increments of one implicit step; return whether they were found.

    `tables.increment` and `tables.slipping` hold the first guess, and then the solution. The
    stress is met to `accuracy` (Pa); the strength may be as far as `near` (Pa) from the straight
    line that stands for it.
    """
    law, nodes = setting.law, setting.nodes
    strength, floor, weakening = nodes.strength, nodes.residual, nodes.weakening
    u, slipping, trial = tables.increment, tables.slipping, tables.trial_stress
    driving, falling, product = tables.driving, tables.falling, tables.product
    n = u.size
    for i in range(n):
        limit = strength_at(law, strength[i], floor[i], weakening[i], slip[i])
        if slipping[i] == 0 and trial[i] > limit:
            slipping[i] = 1
        if slipping[i] == 0:
            u[i] = 0.0
        start, falling[i] = line_at(law, strength[i], floor[i], weakening[i], slip[i], u[i])
        driving[i] = trial[i] - start
    for _ in range(60):
        if not _solve(transform, tables, accuracy):
            return False
        convolve(transform, tables.symbol, u, tables.work, product)
        changed = 0
        for i in range(n):
            if slipping[i] == 0:
                limit = strength_at(law, strength[i], floor[i], weakening[i], slip[i])
                if trial[i] - product[i] > limit + 10.0 * accuracy:
                    slipping[i] = 1
                    changed += 1
            elif u[i] < 0.0:
                slipping[i] = 0
                u[i] = 0.0
                changed += 1
            start, slope = line_at(law, strength[i], floor[i], weakening[i], slip[i], u[i])
            old = driving[i] + falling[i] * u[i]
            driving[i] = trial[i] - start
            if slipping[i] > 0 and abs(driving[i] + slope * u[i] - old) > near:
                changed += 1
            falling[i] = slope
        if changed == 0:
            return True
    return False
