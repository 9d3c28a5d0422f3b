"""Sample: all that a method needs to know of an interface and that may differ between samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.model import real_array
from stiction.profile_nodes import describe_gaps
from stiction.profiles import at_nodes
from stiction.results import Variable

BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, of nodes that
weaken."""


def steepest_rate(strength: Array, residual: Array, rate: Array) -> float:
    """Largest weakening rate, Pa/m, of nodes that may break, all arrays (samples, *shape).

    Barriers are left out: with a uniform critical slip they weaken steeply, but never slip.
    """
    drop = strength - residual
    if drop.max() <= BARRIER * drop.min():
        return float(rate.max())
    drop = drop.reshape(drop.shape[0], -1)
    weakens = np.isfinite(drop) & (drop > 0.0)
    typical = np.nanquantile(np.where(weakens, drop, np.nan), 0.25, axis=1)
    return float(rate.reshape(drop.shape)[drop <= BARRIER * typical[:, None]].max())


def mean_strength(strength: Array) -> float:
    """Mean strength, Pa, where it is finite."""
    return float(strength.mean(where=np.isfinite(strength)))


class Sample(NamedTuple):
    """One interface or many: the profiles that every method starts from.

    A NamedTuple of arrays, so that compiled kernels take it as it is.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, *shape) arrays
        tau_p, tau_r (Pa), W at zero slip (Pa/m), tau_i (Pa); views of what was given, not to be
        written to. Without the first axis for `one` sample. Strength may be infinite for methods
        that accept barriers. Where it was given at or below the residual strength, both are equal:
        strength is constant, whatever W.
    load_profile : (*shape) array
        p, dimensionless, positive.
    normal_pressure : (samples, *shape) array
        Pa; NaN where the problem has none.
    """

    strength: Array
    residual_strength: Array
    weakening_rate: Array
    initial_stress: Array
    load_profile: Array
    normal_pressure: Array

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.strength.shape[0])

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of nodes in each direction."""
        return self.load_profile.shape

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes, counted from the last."""
        return tuple(range(-self.load_profile.ndim, 0))

    def part(self, some: slice) -> Sample:
        """Some samples of the batch."""
        own = (getattr(self, name)[some] for name in BY_SAMPLE)
        return self._replace(**dict(zip(BY_SAMPLE, own, strict=True)))

    def one(self, number: int) -> Sample:
        """Sample `number` by itself, its arrays of shape (*shape) and contiguous."""
        own = (np.ascontiguousarray(getattr(self, name)[number]) for name in BY_SAMPLE)
        return self._replace(**dict(zip(BY_SAMPLE, own, strict=True)))

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        flat = self.weakening_rate.reshape(self.samples, -1)
        return bool(np.all(flat == flat[:, :1]))

    @property
    def mean_strength(self) -> float:
        """Mean strength where it is finite, Pa."""
        return mean_strength(self.strength)

    @property
    def steepest_rate(self) -> float:
        """Largest weakening rate of nodes that may break, Pa/m."""
        return steepest_rate(self.strength, self.residual_strength, self.weakening_rate)

    def every_second(self, first: int) -> Sample:
        """The same samples on the nodes `first`, `first` + 2, ... of a line."""
        return Sample(*(values[..., first::2] for values in self))

    def mean_stress(self, load: Array) -> Array:
        """Mean interface stress <tau_i> + tau_0 <p>, Pa, at the loads tau_0 of shape (samples,)."""
        mean: Array = self.initial_stress.mean(axis=self.axes) + load * self.load_profile.mean()
        return mean


BY_SAMPLE = (
    "strength", "residual_strength", "weakening_rate", "initial_stress", "normal_pressure"
)  # fmt: skip
"""What has an axis of samples."""

PROFILES: dict[str, Variable] = {
    "strength": Variable("Pa", "peak strength"),
    "residual_strength": Variable("Pa", "residual strength"),
    "initial_stress": Variable("Pa", "initial stress"),
    "weakening_rate": Variable("Pa m-1", "weakening rate"),
    "critical_slip": Variable("m", "critical slip"),
    "fracture_energy": Variable("J m-2", "fracture energy"),
    "normal_pressure": Variable("Pa", "normal pressure"),
}
"""What may be given or sampled along an interface, with its unit; the order is that of the streams
of random draws and never changes."""


def profiles_of(
    name: str, value: Any, interface: Interface, samples: int | None = None, infinite: bool = False
) -> Array:
    """`value` as a (samples, *shape) float64 array, or an `InputError` that names it.

    A single profile (*shape) is one sample; where `samples` is given, a number, a profile or one
    number a sample, of shape (samples, 1), is broadcast to all. Of labelled arrays the names of
    dimensions, the coordinates and the units decide. Positive infinity passes if `infinite`.
    """
    shape = interface.shape
    nodes = ", ".join(map(str, shape))
    first = "samples" if samples is None else str(samples)
    valid = f"({first}, {nodes}) or ({nodes}{',' if len(shape) == 1 else ''})"
    if samples is not None:
        valid += f", ({samples}, 1) or a number"
    try:
        array = real_array(at_nodes(name, value, name, interface).values)
    except TypeError as error:
        raise InputError(f"{name}: must be numbers of shape {valid}; {error}") from None
    if array.shape == (*shape, 1) and samples != shape[0]:  # a column, as out of a table
        array = array[..., 0]
    allowed: set[tuple[int, ...]] = {shape}
    if samples is not None:
        column = (samples, *(1 for _ in shape))
        if array.shape == (samples, 1):
            array = array.reshape(column)
        allowed |= {(), (samples, *shape), column}
    if array.shape not in allowed and not (samples is None and array.shape[1:] == shape):
        turned = ""
        if len(shape) == 2 and array.shape[-2:] == shape[::-1]:
            turned = "; x and y have changed places: the first axis of a profile is x"
        raise InputError(f"{name}: must have shape {valid}, got shape {array.shape}{turned}")
    if array.size == 0:
        raise InputError(f"{name}: has no samples, shape {array.shape}")
    _check_finite(name, array, interface, infinite)
    if samples is not None:
        return np.broadcast_to(array, (samples, *shape))
    return array[None] if array.shape == shape else array


def _check_finite(name: str, array: Array, interface: Interface, infinite: bool) -> None:
    bad = np.isnan(array) | (array == -np.inf) if infinite else ~np.isfinite(array)
    if not bad.any():
        return
    missing = np.isnan(array)
    unless = ", or inf where nothing breaks" if infinite else ""
    if len(interface.shape) == 1 and array.shape[-1:] == interface.shape and missing.any():
        where = describe_gaps(np.atleast_2d(missing), interface)
        raise InputError(
            f"{name}: must be finite{unless}: there {where}; st.onset(..., gaps='fill') and"
            " st.read_profile(..., gaps='fill') fill gaps with straight lines and remember them"
        )
    entry = tuple(int(i) for i in np.argwhere(np.atleast_1d(bad))[0])
    raise InputError(f"{name}: must be finite{unless}; entry {entry} is not")


def named_profiles(given: Any) -> dict[str, Any]:
    """Profiles by name: of a mapping or dataset, or of the strength alone."""
    if isinstance(given, Mapping):  # a Dataset is one too
        names = [str(name) for name in given]
        unknown = [name for name in names if name not in PROFILES]
        if unknown and not hasattr(given, "data_vars"):
            raise InputError([unknown_name("profiles", name, PROFILES) for name in unknown])
        return {name: given[name] for name in names if name in PROFILES}
    return {"strength": given}
