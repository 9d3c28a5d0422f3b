"""What a run amounts to: energies, seismic moment, rupture speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.arrays import Fields, Grid, Nodes
from stiction.friction.law import FrictionLaw

Floats = NDArray[np.float64]


def fracture_energy(friction: FrictionLaw, slip: Floats, nodes: Nodes) -> Floats:
    """Energy dissipated above the residual strength at each node, J/m2.

    Parameters
    ----------
    friction : FrictionLaw
    slip : (..., nodes) array
        m.
    nodes : Nodes
    """
    drop = np.where(np.isfinite(nodes.strength), nodes.strength - nodes.residual, 0.0)
    return friction.dissipated(slip, drop, nodes.weakening)


def strain_energy(slip_hat: NDArray[np.complex128], grid: Grid) -> float:
    """Static strain energy of a slip, J/m (on a plane J): sum over modes of K(k)|delta_k|^2/2.

    Parameters
    ----------
    slip_hat : (modes,) complex array
        Real transform of the slip, unnormalised, m.
    grid : Grid
    """
    half = grid.transform.half
    share = np.full(half, 2.0)  # each mode, and its conjugate that the transform leaves out
    share[..., 0] = share[..., -1] = 1.0  # which these do not have
    power = np.abs(slip_hat[1:]) ** 2
    nodes = int(np.prod(grid.transform.shape))
    energy = np.sum(share.ravel()[1:] * grid.stiffness[0, 1:] * power)
    return float(0.5 * energy * grid.cell / nodes)


def radiated_energy(friction: FrictionLaw, nodes: Nodes, grid: Grid, fields: Fields) -> float:
    """Energy carried away by waves, J/m: work of the load, less friction, less strain energy.

    The stress equals the strength wherever there is slip rate, so that the work of friction follows
    from the slip alone. On a plane J.
    """
    slip, work = fields.slip, float(fields.watch[monitor.WORK])
    spent = fracture_energy(friction, slip, nodes) + nodes.residual * slip
    return work - float(spent.sum()) * grid.cell - strain_energy(fields.slip_hat, grid)


def rupture_speed(arrival: Floats, spacing: float, window: float) -> Floats:
    """Apparent speed of the rupture front at each node, m/s; nan where no front passed.

    Parameters
    ----------
    arrival : (nodes,) array
        When the front arrived (periodic in the node), s; nan where it never did.
    spacing : float
        dx, m.
    window : float
        Length over which the speed is taken, m.

    Returns
    -------
    (nodes,) array
        window/|difference in arrival| where arrival is strictly monotone over the window around
        the node, so that the birth of patches and the meeting of fronts do not count as motion.
        Patches that grow ahead of the front still raise the apparent speed.
    """
    half = max(1, round(0.5 * window / spacing))
    n = arrival.size
    if 2 * half >= n:
        return np.full(n, np.nan)
    wrapped = np.concatenate([arrival[-half:], arrival, arrival[:half]])
    difference = np.diff(wrapped)
    count = np.lib.stride_tricks.sliding_window_view(difference, 2 * half)
    monotone = np.all(count > 0.0, axis=1) | np.all(count < 0.0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = 2 * half * spacing / np.abs(wrapped[2 * half :] - wrapped[: -2 * half])
    return np.where(monotone, speed, np.nan)
