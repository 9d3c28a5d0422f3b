"""Rows: validated strength profiles with everything else that may differ from sample to sample."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stiction._model import real_array
from stiction._typing import Array
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.profile_nodes import describe_gaps
from stiction.profiles import at_nodes

BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, of nodes that
weaken."""


def steepest_rate(strength: Array, residual: Array, rate: Array) -> float:
    """Largest weakening rate, Pa/m, of nodes that may break, all arrays (samples, nodes).

    Barriers are left out: with a uniform critical slip they weaken steeply, but never slip.
    """
    drop = strength - residual
    if drop.max() <= BARRIER * drop.min():
        return float(rate.max())
    weakens = np.isfinite(drop) & (drop > 0.0)
    typical = np.nanquantile(np.where(weakens, drop, np.nan), 0.25, axis=1)
    return float(rate[drop <= BARRIER * typical[:, None]].max())


def mean_strength(strength: Array) -> float:
    """Mean strength, Pa, where it is finite."""
    return float(strength.mean(where=np.isfinite(strength)))


@dataclass(frozen=True, eq=False)
class Rows:
    """A batch of samples as solvers see them.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, nodes) arrays
        tau_p, tau_r (Pa), W (Pa/m), tau_i (Pa); views of what was given, not to be written to.
        Strength may be infinite for methods that accept barriers.
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

    def part(self, some: slice) -> Rows:
        """Some of the samples."""
        return replace(
            self,
            strength=self.strength[some],
            residual_strength=self.residual_strength[some],
            weakening_rate=self.weakening_rate[some],
            initial_stress=self.initial_stress[some],
        )

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        return bool(np.all(self.weakening_rate == self.weakening_rate[:, :1]))

    @property
    def mean_strength(self) -> float:
        """Mean strength where it is finite, Pa."""
        return mean_strength(self.strength)

    @property
    def steepest_rate(self) -> float:
        """Largest weakening rate of nodes that may break, Pa/m."""
        return steepest_rate(self.strength, self.residual_strength, self.weakening_rate)

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


def as_rows(
    name: str,
    value: Any,
    quantity: str,
    interface: Interface,
    count: int | None = None,
    infinite: bool = False,
) -> Array:
    """`value` as a (samples, nodes) float64 array, or an `InputError` that names it.

    A single profile, (nodes,) or (nodes, 1), is one sample; where `count` is given, a scalar, a
    (nodes,) profile or a (count, 1) column is broadcast to it. Of labelled arrays the names of
    dimensions, the coordinate x and the units decide. Positive infinity passes if `infinite`.
    """
    nodes = interface.nodes
    samples = "samples" if count is None else str(count)
    valid = f"({samples}, {nodes}) or ({nodes},)"
    if count is not None:
        valid += f", ({samples}, 1) or a number"
    try:
        array = real_array(at_nodes(name, value, quantity, interface).values)
    except TypeError as error:
        raise InputError(f"{name}: must be numbers of shape {valid}; {error}") from None
    if array.shape == (nodes, 1) and count != nodes:
        array = array[:, 0]
    shapes: set[tuple[int, ...]] = {(nodes,)}
    if count is not None:
        shapes |= {(), (count, nodes), (count, 1)}
    if array.shape not in shapes and not (count is None and array.shape[1:] == (nodes,)):
        raise InputError(f"{name}: must have shape {valid}, got shape {array.shape}")
    if array.size == 0:
        raise InputError(f"{name}: has no samples, shape {array.shape}")
    bad = np.isnan(array) | (array == -np.inf) if infinite else ~np.isfinite(array)
    if bad.any():
        missing = np.isnan(array)
        unless = ", or inf where nothing breaks" if infinite else ""
        if array.shape[-1:] == (nodes,) and missing.any():
            where = describe_gaps(np.atleast_2d(missing), interface)
            raise InputError(
                f"{name}: must be finite{unless}: there {where}; st.onset(..., gaps='fill') and"
                " st.read_profile(..., gaps='fill') fill gaps with straight lines and remember them"
            )
        entry = tuple(int(i) for i in np.argwhere(np.atleast_1d(bad))[0])
        raise InputError(f"{name}: must be finite{unless}; entry {entry} is not")
    if array.ndim < 2 or array.shape[1] != nodes:
        array = np.broadcast_to(array, (count or 1, nodes))
    return array
