"""Shear and pressure between a slider and a base, and the forces of their loads.

Problem
-------
A slider S lies on a base B. Slip is d = u_S - u_B at the middles of n
cells, and opening is w = v_S - v_B at their n + 1 edges. Let j = (d,
w), F be the push and N the normal force per unit depth (N/m). Forces on
cells and edges, also per unit depth, are

    f = T F + T_p N - K j,    K = S_B A^-1 S_S,    T = S_B A^-1 g,    A = S_S + S_B  (1)
    U = F/C + T'j,            1/C = g' A^-1 g - S_gg                 (2)
    elastic energy = F^2/(2 C) + j' K j/2                            (3)

with shear forces f[:n], pressing forces -f[n:], and the travel U of the
push without a constant part from N (Betti's theorem). S_S and S_B are
the stiffness matrices of the bodies on their interface displacements.
With a unit load, the held interface of the slider carries g, and the
load travels by -S_gg.

Algorithm
---------
1. Compute the bodies by columns (`columns.block`). The depth of both
   counts from the interface, so that v changes its sign in the base.
2. Reduce the top of the slider to coordinates: all its points if it is
   free, or a single v if a rigid, frictionless plate lies on it.
3. Eliminate the top: S_S, and g and S_gg for the push and for the
   normal force.
4. Evaluate (1) and (2) with a Cholesky factor of A, and S_B = A - S_S.
   Rigid motions of the slider, for which S_S is zero, then cause no
   force up to round-off.
5. If the push acts along -x, mirror the rig. Slip and shear are
   positive along the push.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from stiction.base.arrays import Array, one_blas_thread
from stiction.elasticity.columns import Body, Far, Interval, block, eliminated


class Rig(NamedTuple):
    """Stiffness and loads of a slider on a base with n cells, per unit depth.

    The unknowns are slip at n cells and opening at n + 1 edges. Forces
    are f = T F + T_p N - K j. Shear forces along the push are f[:n],
    and pressing forces are -f[n:].
    """

    K: Array  # (2n+1, 2n+1), Pa, symmetric
    T: Array  # (2n+1,), forces of a unit push (1)
    T_p: Array  # (2n+1,), forces of a unit normal force (1)
    C: float  # stiffness of the bodies at the push, without slip and opening, Pa


def on_cells(edges: Array) -> Array:
    """Return normal forces on cells (n, ...) from forces on edges (n + 1, ...).

    A cell carries half the forces on its edges, and the whole of the
    force on an edge at an end. Sums are equal.

    >>> on_cells(np.array([1.0, 2.0, 4.0, 3.0])).tolist()  # halves, and whole ends
    [2.0, 3.0, 5.0]
    """
    cells = 0.5 * (edges[:-1] + edges[1:])
    cells[0] += 0.5 * edges[0]
    cells[-1] += 0.5 * edges[-1]
    return np.asarray(cells)


@lru_cache(maxsize=8)
def contact_rig(
    length: float, nodes: int, slider: Body, base: Body, *, push: Interval | None,
    pressing: Literal["soft", "plate"] = "soft", tilt: float = 0.0, behind: float = 0.0,
    ahead: float = 0.0, bottom: Far = "fixed", towards: Literal[-1, 1] = 1,
) -> Rig:  # fmt: skip
    """Return the stiffness and the loads of a slider on a base.

    Lengths are in m. `push` holds the lowest and the highest point of
    the pusher. Without a push, a uniform shear acts on the top. A soft
    pressing is N/L (1 + tilt (2 x/L - 1)), with x from the trailing
    end, and a plate does not rotate. The base is longer than the slider
    by `behind` at the trailing end and by `ahead` at the leading end.
    If its bottom lies on rollers, a frictionless stop holds its leading
    end. The push acts along +x or -x (`towards`).

    A symmetric rig without a push. The push acts as a mean shear on its top. The
    forces have the resultants 1, and reversing the direction mirrors the rig.

    >>> slider, base = Body(0.5, 5.0, 2.0), Body(1.0, 5.0, 2.0)
    >>> right = contact_rig(1.2, 3, slider, base, push=(0.1, 0.3), behind=0.4, ahead=0.2)
    >>> left = contact_rig(
    ...     1.2, 3, slider, base, push=(0.1, 0.3), behind=0.4, ahead=0.2, towards=-1
    ... )
    >>> right.K.shape, np.allclose(right.K, right.K.T), right.C > 0.0
    ((7, 7), True, True)
    >>> [round(float(part.sum()), 6) + 0.0 for part in (right.T[:3], right.T[3:])]
    [1.0, 0.0]
    >>> [round(float(part.sum()), 6) + 0.0 for part in (right.T_p[:3], right.T_p[3:])]
    [0.0, -1.0]
    >>> np.allclose(left.T[:3], right.T[:3][::-1]), np.allclose(left.T[3:], right.T[3:][::-1])
    (True, True)
    >>> np.allclose(left.K[:3, 3:], right.K[:3, 3:][::-1, ::-1]), left.C == right.C
    (True, True)
    >>> bool(right.T[0] > right.T[2])  # more shear at the trailing end, which is pushed
    True

    Equations (1) and (2):

    >>> S, g, S_gg = loaded(block(slider, 0.4, 3, push=(0.1, 0.3)), 3, "soft", 0.0)
    >>> signs = np.r_[1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0]
    >>> below = block(base, 0.4, 3, far="fixed", behind=0.4, ahead=0.2)
    >>> S_B = np.diag(signs) @ below @ np.diag(signs)
    >>> reduced = np.linalg.solve(S + S_B, np.column_stack([S, g]))
    >>> np.allclose(right.K, S_B @ reduced[:, :7])
    True
    >>> np.allclose(np.column_stack([right.T, right.T_p]), S_B @ reduced[:, 7:])
    True
    >>> round(float(1.0 / right.C - (g[:, 0] @ reduced[:, 7] - S_gg)), 9) + 0.0
    0.0

    Rigid motions of the slider cause no force on the interface.

    >>> turn = np.r_[0.0, 0.0, 0.0, 0.0, 0.4, 0.8, 1.2]
    >>> motions = np.array([np.r_[1, 1, 1, 0, 0, 0, 0], np.r_[0, 0, 0, 1, 1, 1, 1], turn])
    >>> np.allclose(right.K @ motions.T, 0.0, atol=1e-9)
    True
    """
    cell, order = length / nodes, np.arange(2 * nodes + 1)
    signs = np.repeat([1.0, -1.0], [nodes, nodes + 1])
    with one_blas_thread():
        # 1.
        whole = block(slider, cell, nodes, push=push)
        below = block(base, cell, nodes, far=bottom, behind=behind, ahead=ahead)
        S_B = np.outer(signs, signs) * below
        # 2. and 3.
        S, g, S_gg = loaded(whole, nodes, pressing, tilt)
        # 4.
        factor = cholesky(S + S_B, lower=True)
        half, loads = (solve_triangular(factor, part, lower=True) for part in (S, g))
        K, T = S - half.T @ half, g - half.T @ loads
        C = 1.0 / (loads[:, 0] @ loads[:, 0] - S_gg)
    # 5.
    if towards < 0:
        order = np.concatenate([order[:nodes][::-1], order[nodes:][::-1]])
    K, T = K[np.ix_(order, order)], T[order]
    for array in (K, T):
        array.flags.writeable = False
    return Rig(K, T[:, 0], T[:, 1], float(C))


def loaded(block: Array, n: int, pressing: str, tilt: float) -> tuple[Array, Array, float]:
    """Steps 2 and 3: return S_S, g for the push and for the normal force, and S_gg of the push.

    Forces on the held interface balance the loads: the shear forces of a push have
    the sum 1 and no normal force, and a normal force presses with the sum 1.

    >>> body = Body(height=1.0, modulus=5.0, kappa=2.0)
    >>> pushed, plain = block(body, 0.4, 3, push=(0.25, 0.5)), block(body, 0.4, 3)
    >>> for whole, pressing, tilt in (pushed, "soft", 0.3), (plain, "soft", 0), (plain, "plate", 0):
    ...     S, g, S_gg = loaded(whole, 3, pressing, tilt)
    ...     sums = np.array([g[:3].sum(axis=0), -g[3:].sum(axis=0)]).round(9) + 0.0
    ...     print(S.shape, sums.tolist(), np.allclose(S, S.T), S_gg < 0.0)
    (7, 7) [[1.0, 0.0], [0.0, 1.0]] True True
    (7, 7) [[1.0, 0.0], [0.0, 1.0]] True True
    (7, 7) [[1.0, 0.0], [0.0, 1.0]] True True

    Moments about the middle: of a push at the height 0.375, and of a tilted pressure, which
    is tilt L/6.

    >>> _, g, _ = loaded(pushed, 3, "soft", 0.3)
    >>> ((np.arange(4) - 1.5) * 0.4 @ -g[3:]).round(6).tolist()
    [0.375, 0.06]

    A plate resists a rotation of the interface:

    >>> turn = np.r_[0.0, 0.0, 0.0, 0.0, 0.4, 0.8, 1.2]
    >>> bool(turn @ loaded(plain, 3, "plate", 0.0)[0] @ turn > 0.1)
    True
    """
    size = 2 * n + 1
    whole = np.zeros((2 * size + 2, 2 * size + 2))
    whole[: len(block), : len(block)] = block
    if len(block) == 2 * size:  # no pusher
        whole[-2, size : size + n] = -1.0 / n
    # The pressure is linear in each cell, so that forces on linear functions are exact.
    places, weights = np.linspace(-1.0, 1.0, n + 1), np.full(n + 1, 1.0 / n)
    weights[[0, -1]] *= 0.5
    ends = np.ones(n + 1)
    ends[[0, -1]] -= 2.0 / (3.0 * n)
    whole[-1, size + n : -2] = weights * (1.0 + tilt * places * ends)
    whole[:-2, -2:] = whole[-2:, :-2].T
    # 2.
    basis, top = np.eye(2 * size + 2), np.arange(size + n, 2 * size)
    if pressing == "plate":
        basis[top, top[0]] = 1.0
        basis = np.delete(basis, top[1:], axis=1)
    # 3.
    matrix = basis.T @ whole @ basis
    kept = np.ones(len(matrix), dtype=bool)
    kept[size:-2] = False
    matrix = eliminated(matrix, kept)
    S, g, S_gg = matrix[:size, :size], -matrix[:size, size:], matrix[size, size]
    # Translation, lift and (without a plate) rotation cause no force. The sums of merging leave
    # up to 1e-13 of the diagonal, which A^-1 would amplify.
    motions = np.zeros((size, 3 - (pressing == "plate")))
    motions[:n, 0] = motions[n:, 1] = 1.0
    motions[n:, 2:] = places[:, None]
    motions = np.linalg.qr(motions)[0]
    S = S - motions @ (motions.T @ S)
    S -= (S @ motions) @ motions.T
    return 0.5 * (S + S.T), g, float(S_gg)
