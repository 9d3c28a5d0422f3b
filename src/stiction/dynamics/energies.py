"""Energies of a rupture: spent on breaking, stored in the solids, carried away by waves."""

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics.state import Floats, Grid, Nodes, State
from stiction.friction.laws import FrictionLaw


def fracture_energy(friction: FrictionLaw, slip: Floats, nodes: Nodes) -> Floats:
    """Return the energy dissipated above the residual strength at each node, J/m2."""
    drop = np.where(np.isfinite(nodes.strength), nodes.strength - nodes.residual, 0.0)
    return friction.dissipated(slip, drop, nodes.weakening)


def strain_energy(slip_hat: NDArray[np.complex128], grid: Grid) -> float:
    """Return the static strain energy of a slip: sum over modes of K(k)|delta_k|^2/2; J/m or J."""
    half = grid.transform.half
    share = np.full(half, 2.0)  # each mode, and its conjugate that the transform leaves out
    share[..., 0] = share[..., -1] = 1.0  # which these do not have
    power = np.abs(slip_hat[1:]) ** 2
    nodes = int(np.prod(grid.transform.shape))
    energy = np.sum(share.ravel()[1:] * grid.stiffness[0, 1:] * power)
    return float(0.5 * energy * grid.cell / nodes)


def radiated_energy(friction: FrictionLaw, nodes: Nodes, grid: Grid, state: State) -> float:
    """Return the energy carried away by waves, J/m: work less friction less strain energy.

    The stress equals the strength wherever there is slip rate, so that the work of friction follows
    from the slip alone. On a plane J.
    """
    slip, work = state.slip, float(state.now["work"])
    spent = fracture_energy(friction, slip, nodes) + nodes.residual * slip
    return work - float(spent.sum()) * grid.cell - strain_energy(state.slip_hat, grid)
