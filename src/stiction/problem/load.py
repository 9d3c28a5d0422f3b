"""The load: an initial stress plus a profile that grows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.kinds import Kinds, OneOf, register
from stiction.base.model import (
    AnyNumbers,
    Converted,
    OptionalProfile,
    PlacedProfile,
    Positive,
    Profile,
    Real,
    model,
)
from stiction.problem.interface import Interface

ShareBelowOne = Annotated[Real, Field(ge=0.0, lt=1.0)]
NotNegative = Annotated[Real, Field(ge=0.0)]


class LoadShape(ABC):
    """Load profile given by a formula and scaled to a mean of 1, so that tau_0 is the mean stress.

    To add a shape, write a subclass. Decorate it with
    `stiction.extensions.model`, which checks its parameters. Study
    files accept its `type` if you also decorate it with
    `stiction.extensions.register`.
    """

    family: ClassVar[str] = "loads"
    type: str

    @abstractmethod
    def values(self, interface: Interface) -> Array:
        """Return the profile at the nodes, with any mean. It must broadcast to the nodes."""

    def on(self, interface: Interface) -> Array:
        """Return the profile p at the nodes, with shape (*shape) and a mean of 1."""
        values, name = np.asarray(self.values(interface), np.float64), type(self).__name__
        try:
            np.broadcast_to(values, interface.shape)
        except ValueError:
            text = f"must have the shape {interface.shape} of the nodes, got {values.shape}"
            raise InputError(f"load.profile: {name}.values {text}") from None
        values = values / values.mean()
        if not np.all(values > 0.0):
            text = (
                f"must be positive everywhere. Its least value is {values.min():g} of its mean"
            )
            raise InputError(f"load.profile: {name} {text}")
        return np.ascontiguousarray(np.broadcast_to(values, interface.shape))


LOADS = Kinds("loads")
"""Load shapes of study files by their `type`."""


def distance(interface: Interface, centre: float) -> Array:
    """Return distances (m) along x from a share of the length, with shape (nx,) or (nx, 1)."""
    length = interface.lengths[0]
    x = np.arange(interface.shape[0]) * length / interface.shape[0]
    away = np.mod(x - centre * length + 0.5 * length, length) - 0.5 * length
    return np.abs(away).reshape(-1, *(1 for _ in interface.shape[1:]))


@register
@model(kw_only=True)
class GradientLoad(LoadShape):
    """Load that falls linearly from a ridge to a valley, half a period away.

    Parameters
    ----------
    amplitude : float
        The profile falls from 1 + amplitude to 1 - amplitude (1). In [0, 1).
    centre : float
        Position of the maximum as a share of the length, in [0, 1).
    """

    amplitude: ShareBelowOne
    centre: ShareBelowOne = 0.0
    type: Literal["gradient"] = "gradient"

    def values(self, interface: Interface) -> Array:
        """Return 1 + amplitude (1 - 4 |x - centre|/L)."""
        away = distance(interface, self.centre)
        return 1.0 + self.amplitude * (1.0 - 4.0 * away / interface.lengths[0])


@register
@model(kw_only=True)
class EdgeLoad(LoadShape):
    """Load that is higher near an edge, where a pusher or the corner of a block acts.

    The profile is proportional to 1 + excess exp(-distance/decay). It
    is symmetric about the edge, as for a specimen and its mirror image.

    Parameters
    ----------
    excess : float
        Excess load at the edge, relative to
        the load far away (1), not negative.
    decay : float
        Decay length, m, positive.
    edge : float
        Position of the edge as a share of the length, in [0, 1).
    """

    excess: NotNegative
    decay: Positive
    edge: ShareBelowOne = 0.0
    type: Literal["edge"] = "edge"

    def values(self, interface: Interface) -> Array:
        """Return 1 + excess exp(-distance/decay)."""
        return 1.0 + self.excess * np.exp(-distance(interface, self.edge) / self.decay)


def _shape(value: Any) -> Any:
    return value if isinstance(value, LoadShape) else NotImplemented


@model
class Load:
    """Shear stress tau_i(x) + tau_0 p(x) on an interface without slip. The load factor tau_0 rises.

    Parameters
    ----------
    profile : float, (nodes,) array, GradientLoad, EdgeLoad or another LoadShape
        p, dimensionless, positive.
    initial_stress : float or (nodes,) array
        tau_i, Pa, below the peak strength everywhere. `Rupture` also
        takes nodes at which it is higher, which break at once.
    normal_pressure : float or (nodes,) array, optional
        Pa, positive on average. Every onset then has a
        `friction_coefficient`.
    pressing_force : float, optional
        Force, N, positive, in place of `normal_pressure`. The force
        over the area of the interface, which must be known, is the
        uniform pressure, or the mean pressure between glued plates.

    Examples
    --------
    >>> import stiction as st
    >>> load = st.Load(profile=st.EdgeLoad(excess=2.0, decay=0.01), normal_pressure=5e6)
    """

    profile: Converted[
        Annotated[PlacedProfile, OneOf(LOADS, _shape, untyped=True)], AnyNumbers | LoadShape
    ] = 1.0  # type: ignore[assignment]  # converted
    initial_stress: Profile = 0.0  # type: ignore[assignment]
    normal_pressure: OptionalProfile = None  # type: ignore[assignment]
    pressing_force: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        profile, pressure, problems = self.profile, self.normal_pressure, []
        if isinstance(profile, float | np.ndarray) and np.min(profile) <= 0.0:
            problems.append(f"profile must be positive everywhere, got {np.min(profile):g}")
        if isinstance(pressure, float | np.ndarray) and np.mean(pressure) <= 0.0:
            mean = np.mean(pressure)
            problems.append(
                f"normal_pressure must be positive on average. Its mean is {mean:g}"
            )
        if pressure is not None and self.pressing_force is not None:
            problems.append(
                "pressing_force: give either normal_pressure (Pa) or pressing_force (N), not both"
            )
        if problems:
            raise InputError(problems)
        return self
