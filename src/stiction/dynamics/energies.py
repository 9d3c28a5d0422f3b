"""Energies of a rupture: dissipated by fracture, stored in the solids, radiated by waves."""

import numpy as np

from stiction.dynamics.state import Grid, Nodes, State
from stiction.friction.laws import FrictionLaw


def energy_balance(
    friction: FrictionLaw, nodes: Nodes, grid: Grid, state: State
) -> dict[str, float]:
    """Return strain, fracture and radiated energy, J/m; on a plane J.

    The static strain energy is the sum over modes of K(k)|delta_k|²/2. Waves carry away the work
    less friction less strain energy. The stress equals the strength wherever there is slip rate, so
    that the work of friction follows from the slip alone.
    """
    drop = np.where(np.isfinite(nodes.strength), nodes.strength - nodes.residual, 0.0)
    fracture = friction.dissipated(state.slip, drop, nodes.weakening)
    share = np.full(grid.transform.half, 2.0)  # a mode and its conjugate, which is left out
    share[..., 0] = share[..., -1] = 1.0  # modes without a conjugate
    power = share.ravel()[1:] * grid.stiffness[0, 1:] * np.abs(state.slip_hat[1:]) ** 2
    strain = float(0.5 * np.sum(power) * grid.cell / np.prod(grid.transform.shape))
    spent = float((fracture + nodes.residual * state.slip).sum()) * grid.cell
    return {
        "strain_energy": strain,
        "fracture_energy": float(fracture.sum()) * grid.cell,
        "radiated_energy": float(state.now["work"]) - spent - strain,
    }
