"""The load: a profile that grows, on top of an initial stress."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
import pydantic
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.model import (
    _PROFILE_SCHEMA,
    OptionalProfile,
    Positive,
    Profile,
    Real,
    _plain,
    _profile,
    is_unplaced,
    model,
)

Fraction = Annotated[Real, Field(ge=0.0, lt=1.0)]
NotNegative = Annotated[Real, Field(ge=0.0)]


class LoadShape:
    """A load profile by a formula; its mean over the interface is one, so that tau_0 is the mean
    stress."""

    def plain(self) -> dict[str, Any]:
        """What TOML and JSON hold."""
        return dataclasses.asdict(self)  # type: ignore[call-overload]  # of models

    def on(self, interface: Interface) -> Array:
        """Values at the nodes, (*shape); on a plane they vary along x."""
        length = np.atleast_1d(interface.length)[0]
        shape = interface.shape
        x = np.arange(shape[0]) * length / shape[0]
        away = np.mod(x - self._centre * length + 0.5 * length, length) - 0.5 * length
        values = self._at(np.abs(away), float(length))
        values = values / values.mean()
        result: Array = np.ascontiguousarray(
            np.broadcast_to(values.reshape(-1, *(1 for _ in shape[1:])), shape)
        )
        return result

    @property
    def _centre(self) -> float:
        raise NotImplementedError

    def _at(self, away: Array, length: float) -> Array:
        raise NotImplementedError


@model(kw_only=True)
class GradientLoad(LoadShape):
    """Load that falls linearly from a ridge to half a period away.

    Parameters
    ----------
    amplitude : float
        The profile runs from 1 + amplitude down to 1 - amplitude (1), in [0, 1).
    centre : float
        Where it is largest, as a share of the length, in [0, 1).

    Raises
    ------
    InputError
        If a number is out of range.
    """

    amplitude: Fraction
    centre: Fraction = 0.0
    type: Literal["gradient"] = "gradient"

    @property
    def _centre(self) -> float:
        return self.centre

    def _at(self, away: Array, length: float) -> Array:
        values: Array = 1.0 + self.amplitude * (1.0 - 4.0 * away / length)
        return values


@model(kw_only=True)
class EdgeLoad(LoadShape):
    """Load that is higher near an edge, where a pusher or the corner of a block acts.

    The profile is proportional to 1 + excess exp(-distance/decay). The interface is periodic, so
    that both sides of the edge are loaded, like a specimen and its mirror image.

    Parameters
    ----------
    excess : float
        How much higher at the edge than far away, over that far away (1), not negative.
    decay : float
        m, positive.
    edge : float
        Where it is, as a share of the length, in [0, 1).

    Raises
    ------
    InputError
        If a number is out of range.
    """

    excess: NotNegative
    decay: Positive
    edge: Fraction = 0.0
    type: Literal["edge"] = "edge"

    @property
    def _centre(self) -> float:
        return self.edge

    def _at(self, away: Array, length: float) -> Array:
        values: Array = 1.0 + self.excess * np.exp(-away / self.decay)
        return values


SHAPES: dict[str, type[Any]] = {"gradient": GradientLoad, "edge": EdgeLoad}


def _load_profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    """A shape, or what any profile may be."""
    if isinstance(value, LoadShape):
        return value
    if isinstance(value, dict) and "type" in value:
        kind = value["type"]
        if kind not in SHAPES:
            raise InputError(unknown_name("type", str(kind), SHAPES))
        return SHAPES[kind](**value)
    return _profile(value, info)


_SHAPE_SCHEMA = {
    "type": "object",
    "description": "'gradient' with amplitude, centre; or 'edge' with excess, decay, edge",
    "properties": {"type": {"enum": list(SHAPES)}},
    "required": ["type"],
}
LoadProfile: TypeAlias = Annotated[
    Any,
    BeforeValidator(_load_profile),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": [*_PROFILE_SCHEMA, _SHAPE_SCHEMA]}),
]


@model
class Load:
    """Shear stress on the interface if nothing slipped: tau_i(x) + tau_0 p(x), tau_0 rising.

    Parameters
    ----------
    profile : float, (nodes,) array, GradientLoad or EdgeLoad
        p, dimensionless, positive.
    initial_stress : float or (nodes,) array
        tau_i, Pa, below the peak strength everywhere.
    normal_pressure : float or (nodes,) array, optional
        Pa, positive on average. With it every onset has a `friction_coefficient`.

    Raises
    ------
    InputError
        If the profile is not positive or the pressure not positive on average.

    Examples
    --------
    A load that is higher in the middle of 8 nodes, under a pressure of 5 MPa:

    >>> import numpy as np
    >>> import stiction as st
    >>> load = st.Load(profile=1.0 + np.hanning(8), normal_pressure=5e6)
    >>> load.profile.shape
    (8,)
    """

    profile: LoadProfile = 1.0
    initial_stress: Profile = 0.0
    normal_pressure: OptionalProfile = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        problems = []
        if isinstance(self.profile, LoadShape) or is_unplaced(self.profile):
            pass
        elif not np.all(np.asarray(self.profile) > 0.0):
            worst = np.asarray(self.profile).min()
            problems.append(f"profile must be positive everywhere, smallest given is {worst:g}")
        pressure = self.normal_pressure
        if pressure is not None and not is_unplaced(pressure) and not np.mean(pressure) > 0.0:
            mean = np.mean(pressure)
            problems.append(f"normal_pressure must be positive on average, its mean is {mean:g}")
        if problems:
            raise InputError(problems)
        return self

    def profile_on(self, interface: Interface) -> Any:
        """p as a number, or at the nodes."""
        return self.profile.on(interface) if isinstance(self.profile, LoadShape) else self.profile
