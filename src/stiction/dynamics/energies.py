"""What a run amounts to: energies, seismic moment, rupture speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.arrays import Fields, Grid, Nodes
from stiction.friction import FrictionLaw

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


def rupture_speed(arrival: Floats, spacings: Sequence[float], windows: Sequence[float]) -> Floats:
    """Apparent speed of the rupture front at each node, m/s; nan where no front passed.

    Parameters
    ----------
    arrival : (nodes,) or (nx, ny) array
        When the front arrived (periodic in the nodes), s; nan where it never did.
    spacings, windows : sequences of float
        Along each direction: distance of nodes, and length over which the speed is taken, m.

    Returns
    -------
    array of the same shape
        1/|gradient of arrival|, each component as a difference over its window around the node,
        where arrival is strictly monotone over the window in some direction, so that the birth of
        patches and the meeting of fronts do not count as motion. Patches that grow ahead of the
        front still raise the apparent speed.
    """
    slowness, moves = np.zeros(arrival.shape), np.zeros(arrival.shape, dtype=bool)
    for axis, (spacing, window) in enumerate(zip(spacings, windows, strict=True)):
        half = max(1, round(0.5 * window / spacing))
        n = arrival.shape[axis]
        if 2 * half >= n:
            return np.full(arrival.shape, np.nan)
        along = np.moveaxis(arrival, axis, -1)
        wrapped = np.concatenate([along[..., -half:], along, along[..., :half]], axis=-1)
        difference = np.diff(wrapped, axis=-1)
        steps = np.lib.stride_tricks.sliding_window_view(difference, 2 * half, axis=-1)
        monotone = np.all(steps > 0.0, axis=-1) | np.all(steps < 0.0, axis=-1)
        change = np.abs(wrapped[..., 2 * half :] - wrapped[..., : -2 * half])
        slowness += np.moveaxis((change / (2 * half * spacing)) ** 2, -1, axis)
        moves |= np.moveaxis(monotone, -1, axis)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(moves, 1.0 / np.sqrt(slowness), np.nan)
