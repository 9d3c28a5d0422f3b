"""What a run amounts to: energies, seismic moment, rupture speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.friction.law import FrictionLaw

Floats = NDArray[np.float64]


def fracture_energy(friction: FrictionLaw, slip: Floats, rows: Floats) -> Floats:
    """Energy dissipated above the residual strength at each node, J/m2.

    Parameters
    ----------
    friction : FrictionLaw
    slip : (..., nodes) array
        m.
    rows : (6, nodes) array
        tau_p (infinite where nothing breaks), tau_r, W, and more.
    """
    drop = np.where(np.isfinite(rows[0]), rows[0] - rows[1], 0.0)
    return friction.dissipated(slip, drop, rows[2])


def strain_energy(slip_hat: NDArray[np.complex128], stiffness: Floats, spacing: float) -> float:
    """Static strain energy of a slip distribution, J/m: sum over modes of (G*|k|/4)|delta_k|^2 L.

    Parameters
    ----------
    slip_hat : (nodes//2 + 1,) complex array
        Real transform of the slip, unnormalised, m.
    stiffness : (nodes//2,) array
        G*|k|/2 of the modes from 1 on, Pa/m.
    spacing : float
        dx, m.
    """
    nodes = 2 * (slip_hat.size - 1)
    share = np.full(slip_hat.size - 1, 2.0)
    share[-1] = 1.0  # the shortest wave has no conjugate partner
    power = np.abs(slip_hat[1:]) ** 2
    return float(0.5 * np.sum(share * stiffness * power) * spacing / nodes)


def radiated_energy(
    friction: FrictionLaw,
    work: float,
    slip: Floats,
    slip_hat: NDArray[np.complex128],
    rows: Floats,
    stiffness: Floats,
    spacing: float,
) -> float:
    """Energy carried away by waves, J/m: work of the load, less friction, less strain energy.

    Parameters
    ----------
    friction : FrictionLaw
    work : float
        int int (tau_0 p + tau_i) V dx dt, J/m.
    rows : (6, nodes) array
        As in `Run`.
    slip, slip_hat, stiffness, spacing
        As above. The stress equals the strength wherever there is slip rate, so that the work of
        friction follows from the slip alone.
    """
    spent = fracture_energy(friction, slip, rows) + rows[1] * slip
    return work - float(spent.sum()) * spacing - strain_energy(slip_hat, stiffness, spacing)


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
