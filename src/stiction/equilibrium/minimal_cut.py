"""An upper bound below a load that has no equilibrium, from the node that makes the set unstable.

The eigenvector of a whole unstable set bounds the onset closely only where the set has just become
unstable. Where many nodes join at once it has not. Here they join by overload, until one makes the
set S unstable: with A_SS v = -A_Sj, y = v on S and 1 at j has A y = 0 on S, <= 0 at j and, for a
Z-matrix, outside. As j is overloaded at that load, <s, y>/<p, y> lies below it.
"""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import SOLVED, Mask, residual_of, solve_inside
from stiction.elasticity.transform_operator import Operator, product

ITERATIONS = 1000
ROUNDS = 200


class Cutter:
    """Workspace for cuts of one programme.

    Parameters
    ----------
    operator : Operator
    accuracy : float
        Largest residual stress, Pa.
    """

    def __init__(self, operator: Operator, accuracy: float) -> None:
        shape = operator.rate.shape
        self.operator, self.accuracy = operator, accuracy
        self.workspace = np.empty((3, *shape))
        self.rest, self.none = np.empty(shape), np.zeros(shape)

    def solve(self, right: Array, inside: Mask, x: Array, tolerance: float) -> bool:
        """A x = right on a set, from a guess; false if the set is unstable."""
        x[~inside] = 0.0
        residual_of(self.operator, 0.0, self.none, right, x, self.rest)
        status, _ = solve_inside(
            self.operator,
            inside,
            0.0,
            self.none,
            x,
            self.rest,
            self.workspace,
            tolerance,
            ITERATIONS,
        )
        return bool(status == SOLVED)

    def cut(self, drive: Array, slip: Array) -> tuple[Array | None, Array]:
        """The y of a load with no equilibrium, or the slip of one that has one.

        Parameters
        ----------
        drive : (nx, ny) array
            tau_0 p - s, Pa.
        slip : (nx, ny) array
            Equilibrium at a lower load, m.

        Returns
        -------
        y : (nx, ny) array or None
            None if nodes stopped joining: the slip is an equilibrium then, up to the accuracy.
        slip : (nx, ny) array
            Its lower bound is to be checked, like that of any slip.
        """
        inside, x = slip > 0.0, slip.copy()
        if not inside.any():
            inside = drive == drive.max()
        if not self.solve(drive, inside, x, self.accuracy):
            return None, slip
        for _ in range(ROUNDS):
            residual_of(self.operator, 0.0, self.none, drive, x, self.rest)
            overload = np.where(inside, 0.0, self.rest)
            joining = np.flatnonzero(overload.reshape(-1) > self.accuracy)
            if joining.size == 0:
                return None, x
            joining = joining[np.argsort(-overload.reshape(-1)[joining], kind="stable")]
            wider, trial = inside.copy(), x.copy()
            wider.reshape(-1)[joining] = True
            if self.solve(drive, wider, trial, self.accuracy):
                inside, x = wider, trial
                continue
            return self._pivot(inside, joining), x
        return None, x

    def _pivot(self, inside: Mask, joining: Array) -> Array | None:
        """y for the first of the nodes, in this order, that makes the set unstable."""
        stable, unstable = 0, joining.size
        drive = np.zeros(inside.shape)
        best: Array | None = None
        while True:
            middle = (stable + unstable) // 2
            members = inside.copy()
            members.reshape(-1)[joining[:middle]] = True
            unit, v = np.zeros(inside.shape), np.zeros(inside.shape)
            unit.reshape(-1)[joining[middle]] = 1.0
            product(self.operator, unit, drive)
            scale = float(self.operator.rate.max())
            if not self.solve(-drive, members, v, 1e-10 * scale):
                unstable = middle
            else:
                y = np.maximum(v, 0.0) + unit
                product(self.operator, y, self.rest)
                if self.rest.reshape(-1)[joining[middle]] <= 0.0:
                    best, unstable = y, middle
                else:
                    stable = middle + 1
            if stable >= unstable:
                return best
