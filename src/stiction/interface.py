"""The interface: a periodic line or plane of nodes, its coordinates and its Fourier transform."""

from __future__ import annotations

import math
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema, model_validator

from stiction.arrays import Array, inverse_transform, transform
from stiction.errors import InputError
from stiction.model import _count, _number, model

FEWEST = 8
MOST = 2**24
SHORTEST = 1e-30
"""Spacing of nodes, m, below which squares and ratios leave the range of numbers."""


def _one_or_two(value: Any) -> tuple[Any, ...]:
    """The entries of what was given: one of a line, two of a plane."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return (value,)
    if len(value) != 2:
        raise ValueError("must be a number for a line, or two, (along x, along y), for a plane")
    return tuple(value)


def _lengths(value: Any) -> Any:
    lengths = tuple(_number(entry) for entry in _one_or_two(value))
    if not all(0.0 < length < math.inf for length in lengths):
        raise ValueError("must be positive and finite")
    return lengths if len(lengths) == 2 else lengths[0]


def _nodes(value: Any) -> Any:
    counts = tuple(_count(entry) for entry in _one_or_two(value))
    for count in counts:
        if count < FEWEST:
            raise ValueError(f"must be at least {FEWEST}")
        if count % 2:
            raise ValueError("must be even")
    if math.prod(counts) > MOST:
        raise ValueError(f"must be at most 2^24 = {MOST} in all")
    return counts if len(counts) == 2 else counts[0]


def _schema(kind: str) -> WithJsonSchema:
    pair = {"type": "array", "items": {"type": kind}, "minItems": 2, "maxItems": 2}
    return WithJsonSchema({"anyOf": [{"type": kind}, pair]})


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


Length: TypeAlias = Annotated[
    float | tuple[float, float],
    BeforeValidator(_lengths), PlainSerializer(_plain), _schema("number"),
]  # fmt: skip
Nodes: TypeAlias = Annotated[
    int | tuple[int, int],
    BeforeValidator(_nodes), PlainSerializer(_plain), _schema("integer"),
]  # fmt: skip


@model
class Interface:
    """Periodic interface with equally spaced nodes: a line, or a plane.

    Parameters
    ----------
    length : float or (float, float)
        Period, m. One number is a line, two are a plane: along x, the direction of load and slip,
        and along y, across it.
    nodes : int or (int, int)
        Number of nodes in each direction, even and at least 8, at most 2^24 in all. Powers of two
        are fastest.

    Raises
    ------
    InputError
        If a length is not positive, a number of nodes is odd or out of range, or one of the two
        says line and the other plane.

    Examples
    --------
    >>> import stiction as st
    >>> st.Interface(length=0.1, nodes=1024).shape
    (1024,)
    >>> st.Interface(length=(0.2, 0.1), nodes=(256, 128)).dims
    ('x', 'y')
    """

    length: Length
    nodes: Nodes

    @model_validator(mode="after")
    def _one_geometry(self) -> Interface:
        if isinstance(self.length, tuple) != isinstance(self.nodes, tuple):
            raise InputError(
                "length and nodes: give one number each for a line or two each for a plane, got"
                f" length = {_plain(self.length)}, nodes = {_plain(self.nodes)}"
            )
        if min(self.spacings) < SHORTEST:
            raise InputError(
                f"length: the nodes must be at least {SHORTEST:g} m apart, got"
                f" {min(self.spacings):g} m; check its unit"
            )
        return self

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
        """Whether it has two directions."""
        return len(self.shape) == 2

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes of profiles (..., *shape), counted from the last."""
        return tuple(range(-len(self.shape), 0))

    @property
    def size(self) -> int:
        """Number of nodes in all."""
        return math.prod(self.shape)

    @property
    def extent(self) -> float:
        """Length of a line (m), area of a plane (m²)."""
        return math.prod(self.lengths)

    @property
    def cell(self) -> float:
        """What a node stands for: a length (m), on a plane an area (m²)."""
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
        return {
            dim: np.arange(n) * spacing
            for dim, n, spacing in zip(self.dims, self.shape, self.spacings, strict=True)
        }

    @property
    def x(self) -> Array:
        """Node positions along x in [0, L), shape (nodes,), m."""
        return self.coordinates["x"]

    def describe_node(self, node: int) -> str:
        """Where a node is, counted in the order of a flat profile, for messages."""
        entry = np.unravel_index(int(node), self.shape)
        places = zip(self.dims, entry, self.spacings, strict=True)
        return ", ".join(f"{dim} = {i * spacing:.6g} m" for dim, i, spacing in places)

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors of `transform`, rad/m.

        They broadcast against each other to the shape of a transformed profile: (n//2 + 1,) on a
        line; (nx, 1) and (1, ny//2 + 1) on a plane.
        """
        unit = [2.0 * np.pi / length for length in self.lengths]
        last = unit[-1] * np.arange(self.shape[-1] // 2 + 1)
        if not self.is_plane:
            return (last,)
        n = self.shape[0]
        first = unit[0] * ((np.arange(n) + n // 2) % n - n // 2)
        return first[:, None], last[None, :]

    @property
    def wavenumbers(self) -> Array:
        """Absolute values of the wave vectors of `transform`, rad/m.

        Shape (n//2 + 1,) on a line and (nx, ny//2 + 1) on a plane.
        """
        vectors = self.wave_vectors
        return vectors[0] if len(vectors) == 1 else np.hypot(*vectors)

    @property
    def in_plane_share(self) -> Array | None:
        """(kx/k)² of the wave vectors of a plane: how much of mode II, the rest being mode III.

        The constant mode counts as mode II. None on a line, whose mode is the problem's.
        """
        if not self.is_plane:
            return None
        k = self.wavenumbers.copy()
        k[0, 0] = 1.0
        share: Array = (self.wave_vectors[0] / k) ** 2
        share[0, 0] = 1.0
        return share

    def transform(self, profiles: Array) -> Array:
        """Real Fourier transform of profiles (..., *shape), unscaled."""
        return transform(profiles, len(self.shape))

    def inverse_transform(self, spectra: Array) -> Array:
        """Profiles (..., *shape) of real Fourier transforms."""
        return inverse_transform(spectra, self.shape)
