"""Rows: validated strength profiles with everything else that may differ from sample to sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction._model import real_array
from stiction._typing import Array
from stiction.errors import InputError


@dataclass(frozen=True, eq=False)
class Rows:
    """A batch of samples as solvers see them.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, nodes) arrays
        tau_p, tau_r (Pa), W (Pa/m), tau_i (Pa); views of what was given, not to be written to.
        Where tau_p was given at or below tau_r, tau_r = tau_p: strength is constant, whatever W.
    load_profile : (nodes,) array
        p, dimensionless, positive.
    spacing : float
        Distance between nodes, m.
    """

    strength: Array
    residual_strength: Array
    weakening_rate: Array
    initial_stress: Array
    load_profile: Array
    spacing: float

    @property
    def count(self) -> int:
        """Number of samples."""
        return int(self.strength.shape[0])

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(self.strength.shape[1])

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        return bool(np.all(self.weakening_rate == self.weakening_rate[:, :1]))

    def every_second(self, first: int) -> Rows:
        """The same samples on the nodes `first`, `first` + 2, ..."""
        nodes = slice(first, None, 2)
        return Rows(
            self.strength[:, nodes], self.residual_strength[:, nodes],
            self.weakening_rate[:, nodes], self.initial_stress[:, nodes],
            self.load_profile[nodes], 2.0 * self.spacing,
        )  # fmt: skip

    def mean_stress(self, load: Array) -> Array:
        """Mean interface stress <tau_i> + tau_0 <p>, Pa, at the loads tau_0 of shape (samples,)."""
        mean: Array = self.initial_stress.mean(axis=1) + load * self.load_profile.mean()
        return mean


def as_rows(name: str, value: Any, nodes: int, count: int | None = None) -> Array:
    """`value` as a (samples, nodes) float64 array, or an `InputError` that names it.

    A single profile (nodes,) is one sample; where `count` is given, a scalar, a (nodes,) profile
    or a (count, 1) column is broadcast to it.
    """
    samples = "samples" if count is None else str(count)
    valid = f"({samples}, {nodes}) or ({nodes},)"
    if count is not None:
        valid += f", ({samples}, 1) or a number"
    try:
        array = real_array(value)
    except TypeError as error:
        raise InputError(f"{name}: must be numbers of shape {valid}; {error}") from None
    shapes: set[tuple[int, ...]] = {(nodes,)}
    if count is not None:
        shapes |= {(), (count, nodes), (count, 1)}
    if array.shape not in shapes and not (count is None and array.shape[1:] == (nodes,)):
        raise InputError(f"{name}: must have shape {valid}, got shape {array.shape}")
    if array.size == 0:
        raise InputError(f"{name}: has no samples, shape {array.shape}")
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(np.atleast_1d(bad))[0])
        raise InputError(f"{name}: must be finite; entry {where} is not")
    if array.ndim < 2 or array.shape[1] != nodes:
        array = np.broadcast_to(array, (count or 1, nodes))
    return array
