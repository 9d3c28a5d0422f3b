"""Energies of a rupture: dissipated by fracture, stored in the solids, radiated by waves."""

import numpy as np

from stiction.dynamics.state import Floats, Grid, Nodes, Spectrum, State
from stiction.friction.laws import FrictionLaw


def fracture_energy(friction: FrictionLaw, slip: Floats, nodes: Nodes) -> Floats:
    """Return the energy dissipated above the residual strength at each node, J/m2."""
    drop = np.where(np.isfinite(nodes.strength), nodes.strength - nodes.residual, 0.0)
    return friction.dissipated(slip, drop, nodes.weakening)


def strain_energy(slip_hat: Spectrum, grid: Grid) -> float:
    """Return the static strain energy of a slip: sum over modes of K(k)|delta_k|^2/2; J/m or J."""
    share = np.full(grid.transform.half, 2.0)  # a mode and its conjugate, which is left out
    share[..., 0] = share[..., -1] = 1.0  # modes without a conjugate
    power = share.ravel()[1:] * grid.stiffness[0, 1:] * np.abs(slip_hat[1:]) ** 2
    return float(0.5 * np.sum(power) * grid.cell / np.prod(grid.transform.shape))


def energy_balance(
    friction: FrictionLaw, nodes: Nodes, grid: Grid, state: State
) -> dict[str, float]:
    """Return strain, fracture and radiated energy, J/m; on a plane J.

    Waves carry away the work less friction less strain energy. The stress equals the strength
    wherever there is slip rate, so that the work of friction follows from the slip alone.
    """
    fracture = fracture_energy(friction, state.slip, nodes)
    strain = strain_energy(state.slip_hat, grid)
    spent = float((fracture + nodes.residual * state.slip).sum()) * grid.cell
    return {
        "strain_energy": strain,
        "fracture_energy": float(fracture.sum()) * grid.cell,
        "radiated_energy": float(state.now["work"]) - spent - strain,
    }
