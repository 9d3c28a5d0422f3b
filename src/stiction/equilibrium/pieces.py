"""The straight pieces of a friction law, along which equilibria are followed.

A law of M pieces has M corners; piece M is the residual strength. Between corners everything is
linear, and a corner is an event. The linear law has one piece: its start is tau_p, to the bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.friction import FrictionLaw
from stiction.friction.kernels import registered
from stiction.friction.parameters import Linear, Polygon
from stiction.jit import jit

AT_CORNER = 1.0 - 1e-12
"""Share of the slip at a corner from which a node counts as beyond it."""


class Pieces(NamedTuple):
    """A falling polygon f of u = slip/d_c, in what does not depend on the node.

    Attributes
    ----------
    ends : (M,) array
        u at the end of each piece, the last 1.
    starts : (M + 1,) array
        f of each piece, and of the residual strength, continued back to zero slip: 1, ..., 0.
    slopes : (M + 1,) array
        How steep they are in units of the first: 1, ..., 0.
    first : float
        -f' of the first piece.
    area : float
        Integral of f.
    """

    ends: Array
    starts: Array
    slopes: Array
    first: float
    area: float


LINEAR = Pieces(np.array([1.0]), np.array([1.0, 0.0]), np.array([1.0, 0.0]), 1.0, 0.5)


def refused(law: FrictionLaw) -> list[str]:
    """Why a law cannot be followed piece by piece; nothing if it can."""
    name = type(law).__name__
    try:
        parameters = law.parameters
    except NotImplementedError:
        return [f"friction: {name} does not say what its parameters are"]
    if isinstance(parameters, Linear | Polygon):
        return []
    instead = "use st.Rupture(...)" if registered(parameters) else "use another law"
    return [
        f"friction: equilibria are followed along straight pieces, and {name} has none;"
        f" use st.PiecewiseWeakening.from_law(friction, pieces=32), or {instead}"
    ]


def pieces_of(law: FrictionLaw) -> Pieces:
    """The pieces of a law that `refused` has nothing against."""
    parameters = law.parameters
    if not isinstance(parameters, Polygon):
        return LINEAR
    u, f = parameters.slip, parameters.fraction
    steep = np.append(-np.diff(f) / np.diff(u), 0.0)
    starts = f + steep * u
    return Pieces(u[1:].copy(), starts, steep / steep[0], float(steep[0]), law.integral)


def steepens(pieces: Pieces) -> bool:
    """Whether a piece falls more steeply than the one before it."""
    return bool(np.any(np.diff(pieces.slopes) > 0.0))


@jit
def piece_at(pieces: Pieces, critical: float, slip: float) -> int:
    """The piece on which a node of this d_c is after a slip."""
    piece = 0
    while piece < pieces.ends.shape[0] and slip >= AT_CORNER * (pieces.ends[piece] * critical):
        piece += 1
    return piece


@jit
def start_of(pieces: Pieces, excess: float, residual: float, piece: int) -> float:
    """What a piece has at zero slip, Pa: tau_p on the first, tau_r on the last, to the bit."""
    share = pieces.starts[piece]
    return share * excess + (1.0 - share) * residual
