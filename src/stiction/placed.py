"""Profiles that belong to a problem but came before its interface was known."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import FEWEST, Interface
from stiction.labelled_arrays import labelled
from stiction.profile_files import read_npy
from stiction.profile_nodes import Points, check_gaps
from stiction.profiles import at_nodes, points_of
from stiction.quantities import UNITS

_READ = ("x", "value", "unit", "x_unit")
_PUT = ("interpolate", "gaps")


@dataclasses.dataclass(frozen=True, eq=False)
class Placed:
    """Points of one quantity in SI, and what may be done to put them on nodes.

    Attributes
    ----------
    points : Points
    interpolate : bool
    gaps : {"refuse", "fill"}
    """

    points: Points
    interpolate: bool = False
    gaps: Any = "refuse"
    dims = ("x",)

    def on(self, interface: Interface) -> Array:
        """Values at the nodes."""
        found = self.points.on(interface, interpolate=self.interpolate, gaps=self.gaps)
        return found.values

    def plain(self) -> dict[str, Any]:
        """What TOML and JSON hold."""
        points = self.points
        x = {} if points.x is None else {"x": points.x.tolist()}
        options = {"interpolate": self.interpolate, "gaps": self.gaps}
        return {**x, "values": points.values.tolist(), **options}

    def __eq__(self, other: Any) -> bool:
        return isinstance(other, Placed) and repr(self.plain()) == repr(other.plain())

    def __hash__(self) -> int:
        return hash(repr(self.plain()))

    def __repr__(self) -> str:
        return f"<{self.points.values.size} points of a profile>"


def on_nodes(name: str, given: Any, interface: Interface) -> Any:
    """A profile with coordinates or units of its own as a number or an array at the nodes.

    Raises
    ------
    InputError
        Naming `name`.
    """
    quantity = quantity_of(name.rpartition(".")[2])
    try:
        if isinstance(given, dict):
            given = placed_profile(given, quantity, None)
        if isinstance(given, Placed):
            return given.on(interface)
    except InputError as error:
        raise InputError([f"{name}: {text}" for text in error.problems]) from None
    return np.asarray(at_nodes(name, given, quantity, interface).values)


def placed_profile(given: Any, field: str, folder: Any) -> Any:
    """A profile as `Placed`, or as an array if it comes in the order of the nodes without gaps.

    Parameters
    ----------
    given : path, dict, DataArray or Dataset
        A dict has `file` and options of `read_profile`, or `values` and `x`.
    field : str
        Name of the parameter.
    folder : path or None
        What paths are relative to; None where none are taken, outside study files.
    """
    quantity = quantity_of(field)
    options: dict[str, Any] = {}
    if isinstance(given, dict):
        options = dict(given)
        if ("file" in options) == ("values" in options):
            raise InputError("a profile as a table needs either file or values")
        valid = ("file", *_READ, *_PUT) if "file" in options else ("values", "x", *_PUT)
        wrong = [unknown_name("profile", str(key), valid) for key in options if key not in valid]
        if wrong:
            raise InputError(wrong)
        given = options.pop("file", None)
        if given is not None and not isinstance(given, str | Path):
            raise InputError("file: must be a path")
    put = {name: options.pop(name) for name in _PUT if name in options}
    check_gaps(put.get("gaps", "refuse"))
    if put.get("gaps") == "skip":
        raise InputError("gaps: 'skip' leaves samples out, and this is of all; take 'fill'")
    if not isinstance(put.get("interpolate", False), bool):
        raise InputError("interpolate: must be true or false")
    if given is None:
        x = options.get("x")
        points = Points(_row(options["values"]), None if x is None else _row(x))
        if points.x is not None and points.x.shape != points.values.shape:
            raise InputError("values and x must have the same length")
    elif isinstance(given, str | Path):
        if folder is None:
            raise InputError(
                "file names belong in a study file; in Python give a number, an array or"
                " st.read_profile(path)"
            )
        try:
            path = Path(folder) / given
            if path.suffix.lower() == ".npy" and not options:
                array = read_npy(path)
                if array.ndim == 2 and min(array.shape) >= FEWEST:  # a plane, and no columns
                    return array
            points = points_of(path, quantity, **options)
        except InputError as error:
            raise InputError([f"{given}: {text}" for text in error.problems]) from None
    else:
        points = labelled(given, quantity)
    if points.values.ndim != 1:
        raise InputError(f"must have shape (nodes,), got shape {points.values.shape}")
    if points.x is None and not np.isnan(points.values).any():
        return points.values
    return Placed(points, **put)


def _row(given: Any) -> Array:
    try:
        return np.array(given, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise InputError("x and values must be lists of numbers") from None


def quantity_of(field: str) -> str:
    """What the parameter of this name holds."""
    return "load_profile" if field == "profile" else field


def is_profile(key: str) -> bool:
    """Whether a dotted key of a study takes a profile."""
    return quantity_of(key.rsplit(".", 1)[-1]) in UNITS
