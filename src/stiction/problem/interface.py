"""The interface: a line or plane of nodes, its coordinates and its Fourier transform."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Positive, as_count, as_number, in_si, model

FEWEST_NODES, MOST_NODES = 8, 2**24
"""Nodes in each direction, and in all."""
SHORTEST = 1e-30
"""Spacing of nodes, m, below which squares and ratios leave the range of numbers."""


def _one_or_two(value: Any, read: Callable[[Any], Any]) -> Any:
    """Return what was given, entry by entry: one of a line, two of a plane."""
    value = in_si(value, "length")
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return read(value)
    if len(value) != 2:
        raise ValueError("must be a number for a line, or two, (along x, along y), for a plane")
    return tuple(read(in_si(item, "length")) for item in value)


def _length(value: Any) -> float:
    if not 0.0 < as_number(value) < math.inf:
        raise ValueError("must be positive and finite")
    return as_number(value)


def _node_count(value: Any) -> int:
    if as_count(value) < FEWEST_NODES or as_count(value) % 2:
        raise ValueError(f"must be even and at least {FEWEST_NODES}")
    return as_count(value)


_lengths = BeforeValidator(partial(_one_or_two, read=_length))
_counts = BeforeValidator(partial(_one_or_two, read=_node_count))


@model
class Interface:
    """Interface with equally spaced nodes, periodic: a line, or a plane; or that of a specimen.

    Parameters
    ----------
    length : float or (float, float)
        Period, m. One number gives a line, two give a plane: along x, the direction of load
        and slip, and along y, across it.
    nodes : int or (int, int)
        Number of nodes in each direction, even and at least 8, at most 2^24 in all. Powers of two
        are fastest.
    width : float, optional
        Of a line, m: turns its stresses into forces, N. A plane has its area, and a specimen its
        thickness.
    ends : {"periodic", "free"}
        Set by a `Problem`: "free" if it has a `specimen`. The nodes are then the centres of cells,
        x_i = (i + 1/2) length/nodes, and nothing is continued beyond the ends.

    Examples
    --------
    >>> import stiction as st
    >>> st.Interface(length=0.1, nodes=1024).shape
    (1024,)
    >>> st.Interface(length=(0.2, 0.1), nodes=(256, 128)).dims
    ('x', 'y')
    """

    length: Annotated[float | tuple[float, float], _lengths]
    nodes: Annotated[int | tuple[int, int], _counts]
    width: Positive | None = None
    ends: Literal["periodic", "free"] = "periodic"

    @model_validator(mode="after")
    def _one_geometry(self) -> Interface:
        if isinstance(self.length, tuple) != isinstance(self.nodes, tuple):
            raise InputError(
                "length and nodes: give one number each for a line or two each for a plane, got"
                f" length = {self.length}, nodes = {self.nodes}"
            )
        if self.width is not None and self.is_plane:
            raise InputError("width: a plane has its area; leave the width out")
        if self.is_free and self.is_plane:
            raise InputError(
                "ends: a plane is periodic in both directions; only lines have free ends"
            )
        if self.size > MOST_NODES:
            raise InputError(
                f"nodes: must be at most 2^24 = {MOST_NODES} in all, got {self.nodes}"
            )
        if min(self.spacings) < SHORTEST:
            raise InputError(
                f"length: the nodes must be at least {SHORTEST:g} m apart, got"
                f" {min(self.spacings):g} m; check its unit"
            )
        return self

    @property
    def is_free(self) -> bool:
        """Whether the interface ends, as that of a specimen, instead of being periodic."""
        return self.ends == "free"

    @property
    def first(self) -> float:
        """Distance of the first node from the beginning, in spacings."""
        return 0.5 if self.is_free else 0.0

    @property
    def embedding(self) -> Interface:
        """The periodic interface on which its random fields live: itself, or one twice as long."""
        if not self.is_free:
            return self
        return Interface(2.0 * self.extent, 2 * self.size)

    @property
    def lengths(self) -> tuple[float, ...]:
        """Period in each direction, m."""
        return self.length if isinstance(self.length, tuple) else (self.length,)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of nodes in each direction: the shape of a profile."""
        return self.nodes if isinstance(self.nodes, tuple) else (self.nodes,)

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the directions: ("x",) or ("x", "y")."""
        return ("x", "y")[: len(self.shape)]

    @property
    def is_plane(self) -> bool:
        """Whether the interface is a plane."""
        return len(self.shape) == 2

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes of profiles (..., *shape), counted from the last."""
        return tuple(range(-len(self.shape), 0))

    @property
    def size(self) -> int:
        """Total number of nodes."""
        return math.prod(self.shape)

    @property
    def extent(self) -> float:
        """Length of a line (m), area of a plane (m²)."""
        return math.prod(self.lengths)

    @property
    def cell(self) -> float:
        """Length (m) that a node represents; on a plane, its area (m²)."""
        return self.extent / self.size

    @property
    def spacings(self) -> tuple[float, ...]:
        """Distance between nodes in each direction, m."""
        return tuple(length / n for length, n in zip(self.lengths, self.shape, strict=True))

    @property
    def spacing(self) -> float:
        """Distance between nodes, m; on a plane the larger of the two."""
        return max(self.spacings)

    @property
    def coordinates(self) -> dict[str, Array]:
        """Positions of the nodes along each direction, in [0, length), m."""
        directions = zip(self.dims, self.shape, self.spacings, strict=True)
        return {dim: (np.arange(n) + self.first) * spacing for dim, n, spacing in directions}

    @property
    def x(self) -> Array:
        """Node positions along x in [0, L), shape (nodes,), m."""
        return self.coordinates["x"]

    @property
    def y(self) -> Array:
        """Node positions along y of a plane, shape (nodes,), m."""
        if not self.is_plane:
            raise InputError("y: the interface is a line along x; only a plane has y")
        return self.coordinates["y"]

    def describe_node(self, node: int) -> str:
        """Return the position of a node of the flat profile in words."""
        entry = np.unravel_index(int(node), self.shape)
        places = zip(self.dims, entry, self.spacings, strict=True)
        return ", ".join(
            f"{dim} = {(i + self.first) * spacing:.6g} m" for dim, i, spacing in places
        )

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors of `transform`, rad/m.

        They broadcast against each other to the shape of a transformed profile: (n//2 + 1,) on a
        line; (nx, 1) and (1, ny//2 + 1) on a plane.
        """
        *first, last = (2.0 * np.pi / length for length in self.lengths)
        along = last * np.arange(self.shape[-1] // 2 + 1)
        if not first:
            return (along,)
        n = self.shape[0]
        return (first[0] * ((np.arange(n) + n // 2) % n - n // 2))[:, None], along[None, :]

    @property
    def wavenumbers(self) -> Array:
        """Absolute values of the wave vectors, rad/m: (n//2 + 1,) or (nx, ny//2 + 1)."""
        vectors = self.wave_vectors
        return vectors[0] if len(vectors) == 1 else np.hypot(*vectors)

    @property
    def in_plane_share(self) -> Array:
        """Share of mode II, (kx/k)², at each wave vector of a plane; the rest is mode III.

        The constant mode counts as mode II. One on a line, where the problem sets the mode.
        """
        k = self.wavenumbers
        k.flat[0] = 1.0
        share: Array = (self.wave_vectors[0] / k) ** 2
        share.flat[0] = 1.0
        return share

    def transform(self, profiles: Array) -> Array:
        """Return the real Fourier transform of profiles (..., *shape), unscaled.

        Each profile is transformed by itself, so that the result does not depend on the batch.
        """
        return np.fft.rfft2(profiles) if self.is_plane else np.fft.rfft(profiles)

    def inverse_transform(self, spectra: Array) -> Array:
        """Return the profiles (..., *shape) of real Fourier transforms."""
        if self.is_plane:
            return np.fft.irfft2(spectra, self.shape)
        return np.fft.irfft(spectra, self.shape[0])
