"""The interface: a line or plane of nodes, its coordinates and its Fourier transform."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer, ValidationInfo, model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import (
    Converted,
    Listed,
    Positive,
    as_count,
    as_number,
    in_si,
    model,
    to_plain,
)

Mask = NDArray[np.bool_]

FEWEST_NODES, MOST_NODES = 8, 2**24
"""Fewest nodes in each direction, and largest number in all."""
SHORTEST = 1e-30
"""Spacing of nodes, m, below which squares and ratios leave the range
of numbers."""


def _one_or_two(value: Any, read: Callable[[Any], Any]) -> Any:
    """Return the entries of a given value: one entry for a line, two entries for a plane.

    Return the entries of a given value: one entry for a line, two entries for a plane.

    >>> _one_or_two(3, _length), _one_or_two(np.array([3, 4.5]), float), _one_or_two([8, 1e2], int)
    (3.0, (3.0, 4.5), (8, 100))
    """
    value = in_si(value, "length")
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return read(value)
    if len(value) != 2:
        raise ValueError("must be a number for a line, or two (along x, along y) for a plane")
    return tuple(map(read, value))


def _length(value: Any) -> float:
    """Return a positive length, m.

    >>> for value in (2, 0.0, math.inf, -1.0):
    ...     try:
    ...         print(_length(value))
    ...     except ValueError as error:
    ...         print(error)
    2.0
    must be positive and finite
    must be positive and finite
    must be positive and finite
    """
    if not 0.0 < as_number(value) < math.inf:
        raise ValueError("must be positive and finite")
    return as_number(value)


def _node_count(value: Any) -> int:
    """Return an even node count.

    >>> for value in (8, 9, 6, 1e2):
    ...     try:
    ...         print(_node_count(value))
    ...     except ValueError as error:
    ...         print(error)
    8
    must be even and at least 8
    must be even and at least 8
    100
    """
    if as_count(value) < FEWEST_NODES or as_count(value) % 2:
        raise ValueError(f"must be even and at least {FEWEST_NODES}")
    return as_count(value)


def _two_places(value: Any) -> tuple[float, float]:
    """Return two lengths, m.

    >>> _two_places([0, np.float32(1.5)]), _two_places((-3, 0))
    ((0.0, 1.5), (-3.0, 0.0))
    >>> for value in ([1, 2, 3], "ab", (1, math.inf), 4):
    ...     try:
    ...         _two_places(value)
    ...     except ValueError as error:
    ...         print(error)
    must be two lengths
    must be two lengths
    must be finite
    must be two lengths
    """
    value = in_si(value, "length")
    if isinstance(value, str) or np.shape(np.asarray(value, dtype=object)) != (2,):
        raise ValueError("must be two lengths")
    first, second = map(as_number, value)
    if not math.isfinite(first + second):
        raise ValueError("must be finite")
    return first, second


_pair = BeforeValidator(_two_places)


@model(kw_only=True)
class Ellipse(Listed):
    """Ellipse on a plane, with axes along x and y. The interface can break inside the ellipse.

    Parameters
    ----------
    centre : (float, float)
        Position of the centre, m.
    semi_axes : (float, float)
        Semi-axes along x and y, m, positive.

    Examples
    --------
    >>> import stiction as st
    >>> patch = st.Ellipse(centre=(500.0, 500.0), semi_axes=(300.0, 200.0))
    >>> patch.semi_axes
    (300.0, 200.0)
    """

    centre: Annotated[tuple[float, float], _pair]
    semi_axes: Annotated[tuple[float, float], _pair]

    @model_validator(mode="after")
    def _positive(self) -> Ellipse:
        """Refuse an ellipse without an area.

        >>> Ellipse(centre=(-5.0, 0.0), semi_axes=(3.0, 0.0))
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: Ellipse: semi_axes: must be positive, got (3.0, 0.0)
        """
        if min(self.semi_axes) <= 0.0:
            raise InputError(f"semi_axes: must be positive, got {self.semi_axes}")
        return self


def _extent(value: Any, info: ValidationInfo) -> Any:
    """Read an extent: two ends of a line, two pairs or an `Ellipse` on a plane, or a mask.

    >>> from types import SimpleNamespace
    >>> info = SimpleNamespace(context=None)
    >>> _extent([1, 2], info), _extent([[1, 2], [3, 4]], info), _extent(None, info)
    ((1.0, 2.0), ((1.0, 2.0), (3.0, 4.0)), None)
    >>> _extent({"centre": [1, 2], "semi_axes": [3, 4]}, info).semi_axes
    (3.0, 4.0)
    >>> mask = _extent([False, True, True], info)
    >>> mask.tolist(), mask.flags.writeable
    ([False, True, True], False)
    >>> profile = SimpleNamespace(to_xarray=lambda: np.array([0.0, 2.0, -1.0]))
    >>> info = SimpleNamespace(context={"read": lambda path, quantity: profile})
    >>> _extent("mask.npy", info).tolist()
    [False, True, True]
    >>> _extent([1.0, 0.0, 1.0], info)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    ValueError: must be two ends, two pairs of ends, an Ellipse or a mask ...
    """
    read = (info.context or {}).get("read")
    if isinstance(value, str) and read is not None:
        value = np.asarray(read(value, "slip").to_xarray()) != 0.0  # a mask in a file
    if value is None or isinstance(value, Ellipse):
        return value
    if isinstance(value, dict):
        return Ellipse(**value)
    if not isinstance(value, list | tuple) or any(isinstance(item, bool) for item in value):
        value = in_si(value, "length")
    if (given := np.asarray(value)).dtype.kind == "b":
        mask = given.copy()
        mask.flags.writeable = False
        return mask
    if given.dtype.kind in "iuf" and given.shape not in ((2,), (2, 2)):
        raise ValueError(
            "must be two ends, two pairs of ends, an Ellipse or a mask of True and False (numbers"
            " become a mask by mask != 0)"
        )
    if given.ndim == 2:
        return tuple(map(_two_places, value))
    return _two_places(value)


def _plain_extent(value: Any) -> Any:
    """Return an extent in plain form for a study file.

    >>> _plain_extent(np.array([True, False])), _plain_extent((1.0, 2.0))
    ([True, False], [1.0, 2.0])
    """
    return value.tolist() if isinstance(value, np.ndarray) else to_plain(value)


Extent = Annotated[
    Any, BeforeValidator(_extent), PlainSerializer(_plain_extent), "tuple | Ellipse | mask"
]


_lengths = BeforeValidator(partial(_one_or_two, read=_length))
_counts = BeforeValidator(partial(_one_or_two, read=_node_count))
Lengths: TypeAlias = Converted[
    Annotated[float | tuple[float, float], _lengths], float | Sequence[float]
]
Counts: TypeAlias = Converted[Annotated[int | tuple[int, int], _counts], int | Sequence[int]]


@model
class Interface(Listed):
    """Interface with equally spaced nodes: a periodic line or plane, or a line in a specimen.

    Parameters
    ----------
    length : float or (float, float)
        Period, m. A number gives a line. Two numbers give a plane: the
        first is the period along x, the direction of load and slip, and
        the second is the period along y.
    nodes : int or (int, int)
        Node count in each direction, even and at least 8, at most
        2^24 in all. Powers of two are fastest.
    width : float, optional
        Width of a line, m, which turns its stresses into forces, N. A
        plane does not need a width. A specimen has a thickness instead.
    ends : {"periodic", "free"}, optional
        Set by a `Problem`: "free" if it has a `specimen`, which refuses
        "periodic". The nodes are then the centres of cells, x_i =
        (i + 1/2) length/nodes, and the interface stops at its ends.
    extent : (float, float), ((float, float), (float, float)), Ellipse or mask, optional
        Part of the interface that can break, by default the whole
        interface. Beyond the extent, both solids are a single piece,
        which never slips. For a line, give its two ends, m. For a
        plane, give two pairs of ends (along x and y) or an `Ellipse`.
        For a line or a plane you may also give a mask: a boolean array
        with shape (*shape), or in a study file the path of a ``.npy``
        file. Nodes at the ends can break. An extent of all nodes is the
        same as no extent.

    Notes
    -----
    With an extent, only the nodes that can break count in mean stresses, friction
    coefficients, forces and mean strengths. Periodic images of the extent interact.
    If the extent is small compared with the period, this effect is proportional to
    the square of their ratio.

    Examples
    --------
    >>> import stiction as st
    >>> st.Interface(length=0.1, nodes=1024).shape
    (1024,)
    >>> st.Interface(length=(0.2, 0.1), nodes=(256, 128)).dims
    ('x', 'y')
    >>> fault = st.Interface(length=8e3, nodes=1000, extent=(3e3, 5e3))
    >>> int(fault.breakable.sum())
    251
    """

    length: Lengths
    nodes: Counts
    width: Positive | None = None
    ends: Literal["periodic", "free"] | None = None
    extent: Extent = None
    _shown = "breakable", "coordinates", "shape", "spacing", "x", "y"

    @model_validator(mode="after")
    def _one_geometry(self) -> Interface:
        """Refuse parts that do not make a line or a plane.

        >>> def refused(*given, **more):
        ...     try:
        ...         Interface(*given, **more)
        ...     except InputError as error:
        ...         return str(error)[11:39]
        >>> refused(8.0, 8, width=0.5) or refused(9e-30, 8) or refused((8.0, 4.0), (2**13, 2**11))
        >>> refused((8.0, 4.0), 8), refused(8.0, (8, 8))
        ('length and nodes: give one n', 'length and nodes: give one n')
        >>> refused((8.0, 4.0), (8, 8), width=0.5), refused((8.0, 4.0), (8, 8), ends="free")
        ('width: lengths of a plane gi', 'ends: a plane is periodic. O')
        >>> refused((8.0, 4.0), (2**13, 2**11 + 2)), refused(7e-30, 8)
        ('nodes: must be at most 2^24 ', 'length: nodes are 8.75e-31 m')
        >>> refused(8.0, 8, extent=[True] * 6), refused(8.0, 8, extent=((1.0, 2.0), (3.0, 4.0)))
        ('extent: a mask must have the', 'extent: must be two ends or ')
        """
        if isinstance(self.length, tuple) != isinstance(self.nodes, tuple):
            raise InputError(
                "length and nodes: give one number of each for a line, or two of each for a plane,"
                f" got length = {self.length}, nodes = {self.nodes}"
            )
        if self.width is not None and self.is_plane:
            raise InputError("width: lengths of a plane give its area. Leave width out")
        if self.is_free and self.is_plane:
            raise InputError("ends: a plane is periodic. Only lines have free ends")
        if self.size > MOST_NODES:
            raise InputError(f"nodes: must be at most 2^24 in total, got {self.nodes}")
        if min(self.spacings) < SHORTEST:
            raise InputError(
                f"length: nodes are {min(self.spacings):g} m apart. Check the unit"
            )
        if problem := self._wrong_extent():
            raise InputError(f"extent: {problem}")
        return self

    def _wrong_extent(self) -> str | None:
        """Return a message if the extent is invalid, or None.

        The extent may begin and end with the interface:

        >>> valid = (0.0, 8.0), (2.0, 3.0)
        >>> for extent in (*valid, (2.0, 2.5), (-1.0, 3.0), (3.0, 2.0), (5.0, 8.1)):
        ...     try:
        ...         print(int(Interface(8.0, 8, extent=extent).breakable.sum()))
        ...     except InputError as error:
        ...         print(str(error)[11:61])
        8
        2
        extent: contains 1, but must contain at least two.
        extent: must be increasing and lie within 0 to 8 m
        extent: must be increasing and lie within 0 to 8 m
        extent: must be increasing and lie within 0 to 8 m
        >>> sides = (2.0, 3.0), (4.0, 17.0)
        >>> Interface((8.0, 16.0), (8, 8), extent=sides)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: Interface: ... within 0 to 16 m along y, got 4 to 17 m
        """
        extent, ends = self.extent, self._ends
        if extent is None:
            return None
        if isinstance(extent, np.ndarray) and extent.shape != self.shape:
            return f"a mask must have the shape {self.shape}, got {extent.shape}"
        if ends is not None and len(ends) != len(self.shape):
            valid = "two pairs of ends, an Ellipse" if self.is_plane else "two ends"
            return f"must be {valid} or a mask of shape {self.shape}, got {extent}"
        for dim, (low, high), length in zip(self.dims, ends or (), self.lengths, strict=False):
            if not -1e-9 * length <= low < high <= (1.0 + 1e-9) * length:
                return (
                    f"must be increasing and lie within 0 to {length:g} m along {dim}, got"
                    f" {low:g} to {high:g} m"
                )
        if (count := np.count_nonzero(self._inside)) < 2:
            return (
                f"contains {count}, but must contain at least two. Nodes are"
                f" {self.spacing:.3g} m apart. Check its unit (m)"
            )
        return None

    @property
    def _ends(self) -> tuple[tuple[float, float], ...] | None:
        """Ends of the extent along each direction, m.

        None if there is no extent, or for a mask.

        >>> Interface(8.0, 8, extent=(2.0, 5.0))._ends, Interface(8.0, 8)._ends
        (((2.0, 5.0),), None)
        >>> ellipse = Ellipse(centre=(4.0, 8.0), semi_axes=(3.0, 2.0))
        >>> Interface((8.0, 16.0), (8, 8), extent=ellipse)._ends
        ((1.0, 7.0), (6.0, 10.0))
        >>> Interface(8.0, 8, extent=[True, True, *[False] * 6])._ends
        """
        extent = self.extent
        if isinstance(extent, Ellipse):
            pairs = zip(extent.centre, extent.semi_axes, strict=True)
            return tuple((middle - half, middle + half) for middle, half in pairs)
        if isinstance(extent, tuple):
            return extent if isinstance(extent[0], tuple) else (extent,)
        return None

    @property
    def _inside(self) -> Mask:
        """Mask of the nodes in the extent, also on its border, with shape (*shape).

        The end of a periodic interface is its first node. Nodes of a specimen
        lie in the middle of cells:

        >>> for ends in (None, "free"):
        ...     print(np.flatnonzero(Interface(8.0, 8, extent=(5.0, 8.0), ends=ends)._inside))
        [0 5 6 7]
        [5 6 7]

        Nodes are 1 m and 2 m apart. Points of a lattice lie within and on a
        circle with the radius 2:

        >>> ellipse = Ellipse(centre=(4.0, 8.0), semi_axes=(2.0, 4.0))
        >>> inside = Interface((8.0, 16.0), (8, 8), extent=ellipse)._inside
        >>> int(inside.sum()), np.argwhere(inside)[:4].tolist()
        (13, [[2, 4], [3, 3], [3, 4], [3, 5]])
        >>> sides = (2.0, 3.0), (4.0, 8.0)
        >>> np.argwhere(Interface((8.0, 16.0), (8, 8), extent=sides)._inside)[:4].tolist()
        [[2, 2], [2, 3], [2, 4], [3, 2]]
        """
        extent, grid = self.extent, np.meshgrid(*self.coordinates.values(), indexing="ij")
        if isinstance(extent, np.ndarray):
            return extent
        # The distance from the middle, in units of half the extent. Around a
        # period, the end of the interface is its first node.
        distances = []
        for at, (low, high), length in zip(grid, self._ends or (), self.lengths, strict=True):
            away = np.abs(at - 0.5 * (low + high))
            away = away if self.is_free else np.minimum(away, length - away)
            distances.append(away / (0.5 * (high - low)))
        if isinstance(extent, Ellipse):
            return np.asarray(np.sum(np.square(distances), axis=0) <= 1.0 + 1e-9)
        return np.asarray(np.max(distances, axis=0) <= 1.0 + 1e-9)

    @cached_property
    def breakable(self) -> Mask:
        """Read-only mask of the nodes that can break, (*shape)."""
        inside = np.ones(self.shape, dtype=bool) if self.extent is None else self._inside
        inside.flags.writeable = False
        return inside

    @cached_property
    def is_held(self) -> bool:
        """Whether some nodes cannot break.

        An extent of all nodes is the same as no extent.
        """
        return self.extent is not None and not self.breakable.all()

    def mean(self, profiles: Array) -> Array:
        """Return means of profiles (..., *shape) over the nodes that can break.

        >>> profiles = np.arange(16.0).reshape(2, 8)
        >>> for extent in (None, (2.0, 4.0), (0.0, 7.0)):
        ...     print(Interface(8.0, 8, extent=extent).mean(profiles).tolist())
        [3.5, 11.5]
        [3.0, 11.0]
        [3.5, 11.5]
        """
        held = self.is_held
        return profiles[..., self.breakable].mean(-1) if held else profiles.mean(self.axes)

    @property
    def breakable_measure(self) -> float:
        """Length (m), or area on a plane (m²), of the nodes that can break.

        >>> sides = (4.0, 8.0), (6.0, 18.0)  # 3 x 5 nodes
        >>> for extent in (sides, None):
        ...     print(float(Interface((16.0, 48.0), (8, 16), extent=extent).breakable_measure))
        90.0
        768.0
        """
        return np.count_nonzero(self.breakable) * self.cell if self.is_held else self.measure

    @property
    def reach(self) -> float:
        """Longest side of the part that can break, m.

        For the whole interface it is a period.

        >>> sides = (2.0, 4.0), (4.0, 12.0)  # 3 m and 10 m
        >>> for extent in (sides, None):
        ...     print(float(Interface((8.0, 16.0), (8, 8), extent=extent).reach))
        10.0
        16.0
        >>> [Interface(8.0, 8, extent=extent).is_held for extent in ((2.0, 4.0), (0.0, 7.0))]
        [True, False]
        """
        if not self.is_held:
            return max(self.lengths)
        sides = [
            np.count_nonzero(self.breakable.any(axis=tuple({*self.axes} - {axis}))) * spacing
            for axis, spacing in zip(self.axes, self.spacings, strict=True)
        ]
        return max(sides)

    @cached_property
    def is_free(self) -> bool:
        """Whether the interface ends, as in a specimen, rather than being periodic."""
        return self.ends == "free"

    @cached_property
    def first(self) -> float:
        """Distance of the first node from the beginning, in spacings."""
        return 0.5 if self.is_free else 0.0

    @property
    def embedding(self) -> Interface:
        """Periodic interface for random fields, twice as long if the ends are free.

        >>> free = Interface(8.0, 16, ends="free").embedding
        >>> free.length, free.nodes, free.is_free, Interface(8.0, 16).embedding.length
        (16.0, 32, False, 8.0)
        """
        if not self.is_free:
            return self
        return Interface(2.0 * self.measure, 2 * self.size)

    @cached_property
    def lengths(self) -> tuple[float, ...]:
        """Period in each direction, m."""
        return self.length if isinstance(self.length, tuple) else (self.length,)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Node count in each direction, which is the shape of a profile."""
        return self.nodes if isinstance(self.nodes, tuple) else (self.nodes,)

    @cached_property
    def dims(self) -> tuple[str, ...]:
        """Names of the directions: ("x",) or ("x", "y")."""
        return ("x", "y")[: len(self.shape)]

    @cached_property
    def is_plane(self) -> bool:
        """Whether the interface is a plane."""
        return len(self.shape) == 2

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes in profiles (..., *shape), counted from the last."""
        return tuple(range(-len(self.shape), 0))

    @cached_property
    def size(self) -> int:
        """Total node count."""
        return math.prod(self.shape)

    @cached_property
    def measure(self) -> float:
        """Length of a line (m), or area of a plane (m²)."""
        return math.prod(self.lengths)

    @property
    def cell(self) -> float:
        """Length (m), or area on a plane (m²), that a node represents.

        >>> plane = Interface((16.0, 48.0), (8, 16))
        >>> plane.size, plane.measure, plane.cell, plane.spacings, plane.spacing
        (128, 768.0, 6.0, (2.0, 3.0), 3.0)
        >>> plane.lengths, plane.shape, plane.dims, plane.axes, plane.is_plane
        ((16.0, 48.0), (8, 16), ('x', 'y'), (-2, -1), True)
        >>> line = Interface(8.0, 16)
        >>> line.lengths, line.shape, line.dims, line.axes, line.is_plane, line.size, line.cell
        ((8.0,), (16,), ('x',), (-1,), False, 16, 0.5)
        """
        return self.measure / self.size

    @cached_property
    def spacings(self) -> tuple[float, ...]:
        """Distance between nodes in each direction, m."""
        return tuple(length / n for length, n in zip(self.lengths, self.shape, strict=True))

    @cached_property
    def spacing(self) -> float:
        """Distance between nodes, m. On a plane it is the larger distance."""
        return max(self.spacings)

    @property
    def coordinates(self) -> dict[str, Array]:
        """Positions of the nodes along each direction, in [0, length), m.

        >>> plane = Interface((8.0, 48.0), (8, 16))
        >>> {dim: places[:3].tolist() for dim, places in plane.coordinates.items()}
        {'x': [0.0, 1.0, 2.0], 'y': [0.0, 3.0, 6.0]}
        >>> Interface(8.0, 16, ends="free").x[[0, -1]].tolist()
        [0.25, 7.75]
        """
        directions = zip(self.dims, self.shape, self.spacings, strict=True)
        return {dim: (np.arange(n) + self.first) * spacing for dim, n, spacing in directions}

    @property
    def x(self) -> Array:
        """Node positions along x in [0, L), m, with shape (nodes,)."""
        return self.coordinates["x"]

    @property
    def y(self) -> Array:
        """Node positions along y on a plane, m, with shape (nodes,).

        >>> Interface((8.0, 48.0), (8, 16)).y[:3].tolist()
        [0.0, 3.0, 6.0]
        """
        if not self.is_plane:
            raise InputError("y: the interface is a line along x. Only a plane has y")
        return self.coordinates["y"]

    def describe_node(self, node: int) -> str:
        """Describe in words where a node of the flattened profile lies.

        >>> Interface((8.0, 48.0), (8, 16)).describe_node(35)
        'x = 2 m, y = 9 m'
        >>> Interface(8.0, 16, ends="free").describe_node(1)
        'x = 0.75 m'
        """
        entry = np.unravel_index(int(node), self.shape)
        places = zip(self.dims, entry, self.spacings, strict=True)
        return ", ".join(
            f"{dim} = {(i + self.first) * spacing:.6g} m" for dim, i, spacing in places
        )

    @property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of the wave vectors in `transform`, rad/m.

        The components broadcast to the shape of a transformed profile: (n//2 + 1,) on a
        line, (nx, 1) and (1, ny//2 + 1) on a plane.

        >>> Interface(2.0 * np.pi, 8).wave_vectors[0].round(9).tolist()
        [0.0, 1.0, 2.0, 3.0, 4.0]
        >>> kx, ky = Interface((2.0 * np.pi, 4.0 * np.pi), (8, 10)).wave_vectors
        >>> kx.shape, kx.ravel().round(9).tolist(), ky.round(9).tolist()
        ((8, 1), [0.0, 1.0, 2.0, 3.0, -4.0, -3.0, -2.0, -1.0], [[0.0, 0.5, 1.0, 1.5, 2.0, 2.5]])
        """
        *first, last = (2.0 * np.pi / length for length in self.lengths)
        along = last * np.arange(self.shape[-1] // 2 + 1)
        if not first:
            return (along,)
        n = self.shape[0]
        return (first[0] * ((np.arange(n) + n // 2) % n - n // 2))[:, None], along[None, :]

    @property
    def wavenumbers(self) -> Array:
        """Absolute values of the wave vectors, rad/m, with shape (n//2 + 1,) or (nx, ny//2 + 1).

        >>> k = Interface((2.0 * np.pi, 4.0 * np.pi), (8, 10)).wavenumbers
        >>> k.shape, round(float(k[5, 1]) ** 2, 9)
        ((8, 6), 9.25)
        >>> Interface(np.pi, 8).wavenumbers.round(9).tolist()
        [0.0, 2.0, 4.0, 6.0, 8.0]
        """
        vectors = self.wave_vectors
        return vectors[0] if len(vectors) == 1 else np.hypot(*vectors)

    @property
    def in_plane_share(self) -> Array:
        """Fraction of mode II, (kx/k)², at each wave vector on a plane. The rest is mode III.

        The constant mode counts as mode II. On a line the fraction is 1,
        because the problem sets the mode.

        >>> share = Interface((2.0 * np.pi, 4.0 * np.pi), (8, 10)).in_plane_share
        >>> share[[0, 0, 2, 1], [0, 1, 0, 4]].round(9).tolist()  # 4: ky = 2
        [1.0, 0.0, 1.0, 0.2]
        >>> Interface(2.0, 8).in_plane_share.tolist()
        [1.0, 1.0, 1.0, 1.0, 1.0]
        """
        k = self.wavenumbers
        k.flat[0] = 1.0
        share: Array = (self.wave_vectors[0] / k) ** 2
        share.flat[0] = 1.0
        return share

    def transform(self, profiles: Array) -> Array:
        """Return the real Fourier transform of profiles (..., *shape), unscaled.

        Profiles are transformed one at a time, so the result does not
        depend on the batch.

        >>> plane = Interface((8.0, 16.0), (8, 10))
        >>> wave = np.cos(2.0 * np.pi * (2.0 * plane.x[:, None] / 8.0 + plane.y / 16.0))
        >>> spectrum = plane.transform(np.stack([wave, 0.0 * wave]))
        >>> spectrum.shape, np.argwhere(np.abs(spectrum) > 1e-9).tolist()
        ((2, 8, 6), [[0, 2, 1]])
        >>> round(float(spectrum[0, 2, 1].real), 9)
        40.0
        """
        return np.fft.rfft2(profiles) if self.is_plane else np.fft.rfft(profiles)

    def inverse_transform(self, spectra: Array) -> Array:
        """Return profiles (..., *shape) from their real Fourier transforms.

        >>> for interface in (Interface(8.0, 10), Interface((8.0, 16.0), (8, 10))):
        ...     rows = np.arange(2.0 * interface.size).reshape(2, *interface.shape)
        ...     back = interface.inverse_transform(interface.transform(rows))
        ...     print(back.shape, float(np.abs(back - rows).max()) < 1e-9)
        (2, 10) True
        (2, 8, 10) True
        """
        if self.is_plane:
            return np.fft.irfft2(spectra, self.shape)
        return np.fft.irfft(spectra, self.shape[0])
