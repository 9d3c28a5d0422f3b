"""Profiles of planes, from .npy files and from labelled arrays over x and y.

They must lie at the nodes: nothing is interpolated and no gap is filled on a plane.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from stiction._model import real_array
from stiction._typing import Array
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.profile_files import read_npy
from stiction.profile_nodes import TOLERANCE

Factor = Callable[[Any, str], float]
"""Of a labelled array and a quantity ('x' for places): its unit over that of SI."""


def read_plane(path: Path, interface: Interface) -> Array:
    """The profile (nx, ny) in a .npy file, as it is; its first axis is x.

    Raises
    ------
    InputError
        If it is no .npy file of that shape.
    """
    if path.suffix.lower() != ".npy":
        raise InputError(
            f"{path}: a profile of a plane is a .npy file of shape {interface.shape}, the first"
            f" axis along x; got {path.name!r}"
        )
    array = read_npy(path)
    if array.shape != interface.shape:
        turned = array.shape == interface.shape[::-1]
        hint = "; x and y have changed places: the first axis is x" if turned else ""
        raise InputError(f"{path}: must have shape {interface.shape}, got {array.shape}{hint}")
    return array


def labelled_plane(source: Any, quantity: str, interface: Interface, factor: Factor) -> Array:
    """Values (nx, ny) or (samples, nx, ny), in SI, of a DataArray over 'x' and 'y' in any order."""
    if hasattr(source, "data_vars"):
        names = [str(name) for name in source.data_vars]
        if quantity not in names:
            raise InputError(
                f"holds no variable {quantity!r} (it has {', '.join(names) or 'none'})"
            )
        source = source[quantity]
    dims = [str(name) for name in source.dims]
    if all(name.startswith("dim_") for name in dims):  # never named: order counts
        return real_array(source.values) * factor(source, quantity)
    others = [name for name in dims if name not in interface.dims]
    if len(dims) - len(others) == 0 and len(others) == 1 and quantity != "strength":
        return real_array(source.values)[:, np.newaxis] * factor(source, quantity)
    if len(dims) - len(others) < 2 or len(others) > 1:
        raise InputError(
            "must have the dimensions 'x' and 'y', and at most one more, of the samples; got"
            f" ({', '.join(dims)})"
        )
    for dim, nodes in interface.coordinates.items():
        if dim not in source.coords:
            continue
        place = real_array(source.coords[dim].values) * factor(source.coords[dim], "x")
        spacing = interface.lengths[interface.dims.index(dim)] / nodes.size
        if place.shape != nodes.shape or np.abs(place - nodes).max() > TOLERANCE * spacing:
            raise InputError(
                f"{dim} must be the {nodes.size} nodes i L/n from 0 to {nodes[-1]:g} m, got"
                f" {place.size} from {place[0]:g} to {place[-1]:g} m; on a plane nothing is"
                " interpolated"
            )
    return real_array(source.transpose(*others, *interface.dims).values) * factor(source, quantity)
