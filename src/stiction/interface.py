"""The interface: a periodic line of nodes."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stiction._model import Positive, _count, model
from stiction._typing import Array
from stiction.errors import InputError

SHORTEST = 1e-30
"""Spacing of nodes, m, below which squares and ratios leave the range of numbers."""


@model
class Interface:
    """Periodic interface with equally spaced nodes.

    Parameters
    ----------
    length : float
        Period L, m.
    nodes : int
        Number of nodes n, even, from 8 to 2^24. Powers of two are fastest.

    Raises
    ------
    InputError
        If the length is not positive or the number of nodes is odd or out of range.
    """

    length: Positive
    nodes: Annotated[int, BeforeValidator(_count), Field(ge=8, le=2**24, multiple_of=2)]

    @model_validator(mode="after")
    def _of_this_world(self) -> Interface:
        if self.spacing < SHORTEST:
            raise InputError(
                f"length: must be at least {SHORTEST * self.nodes:g} m for {self.nodes}"
                f" nodes, got {self.length:g}; check its unit"
            )
        return self

    @property
    def spacing(self) -> float:
        """Distance between nodes, m."""
        return self.length / self.nodes

    @property
    def x(self) -> Array:
        """Node positions in [0, L), shape (nodes,), m."""
        return np.arange(self.nodes) * self.spacing

    @property
    def wavenumbers(self) -> Array:
        """Angular wavenumbers of a real transform, shape (nodes//2 + 1,), rad/m."""
        return 2.0 * np.pi / self.length * np.arange(self.nodes // 2 + 1)
