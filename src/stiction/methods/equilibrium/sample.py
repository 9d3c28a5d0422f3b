"""From the laws and samples of a problem to the arrays that kernels read."""

import numpy as np

from stiction.methods.equilibrium.strength import LINEAR, Pieces, StaticSample, make_sample
from stiction.problem.friction import FrictionLaw
from stiction.problem.friction.parameters import Linear, Polygon
from stiction.problem.sample import Sample


def refused(law: FrictionLaw) -> list[str]:
    """Return the reasons why a law cannot be followed piece by piece, or an empty list."""
    name, kind = type(law).__name__, type(law.parameters)
    if kind in (Linear, Polygon):
        return []
    return [
        f"friction: {name} is curved, but equilibria are followed along straight pieces. Use"
        " st.PiecewiseWeakening.from_law(friction, pieces=32) or, between half-spaces,"
        " st.Rupture(...)"
    ]


def pieces_of(law: FrictionLaw) -> Pieces:
    """Return the pieces of a law for which `refused` returns no reason."""
    parameters = law.parameters
    if not isinstance(parameters, Polygon):
        return LINEAR
    u, f = parameters.slip, parameters.fraction
    steep = np.append(-np.diff(f) / np.diff(u), 0.0)
    starts, first = f + steep * u, law.initial_slope
    return Pieces(u[1:].copy(), starts, steep / first, first, law.integral)


def sample_of(rows: Sample, pieces: Pieces, row: int | slice = slice(None)) -> StaticSample:
    """Return one sample or all samples of a batch, in the form that kernels need."""
    initial = rows.initial_stress[row]
    shape = (*initial.shape[: initial.ndim - rows.load_profile.ndim], -1)
    excess = (rows.strength[row] - initial).reshape(shape)
    residual = (rows.residual_strength[row] - initial).reshape(shape)
    # Copy the rate: numba would compile each kernel again for a
    # read-only array, as laws return.
    weakening_rate = rows.weakening_rate[row].reshape(shape).copy()
    return make_sample(excess, residual, rows.load_profile.flatten(), weakening_rate, pieces)
