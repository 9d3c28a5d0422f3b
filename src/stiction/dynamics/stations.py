"""Stations: places whose slip, slip rate and shear stress are recorded after every step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.model import describe, is_finite
from stiction.results import Variable

Floats = NDArray[np.float64]
_RECORDED = ("step", "station")
VARIABLES: dict[str, Variable] = {
    "station_slip": Variable("m", "slip at a station after each step", _RECORDED),
    "station_slip_rate": Variable("m/s", "slip rate at a station after each step", _RECORDED),
    "station_shear_stress": Variable(
        "Pa", "shear stress (traction) at a station after each step", _RECORDED
    ),
}
"""In the order of a station's columns in the record of steps."""


@dataclass(frozen=True, eq=False)
class Stations:
    """Nodes that are recorded.

    Attributes
    ----------
    names : (stations,) array of str
    nodes : (stations,) array of int
        Flat, also on a plane.
    places : (stations, dimensions) array
        Of these nodes, m.
    """

    names: NDArray[Any]
    nodes: NDArray[np.int64]
    places: Floats

    @property
    def columns(self) -> int:
        """Of the record of steps."""
        return len(VARIABLES) * self.nodes.size

    def of_record(self, record: Floats) -> dict[str, Floats]:
        """What rows (steps, columns) hold of the stations, (steps, stations) each."""
        if not self.nodes.size:
            return {}
        own = record[:, monitor.COLUMNS :].reshape(-1, self.nodes.size, len(VARIABLES))
        return {name: own[..., i].copy() for i, name in enumerate(VARIABLES)}

    def coordinates(self, interface: Interface) -> dict[str, tuple[NDArray[Any], Variable]]:
        """Names and places, as a dataset takes them."""
        if not self.nodes.size:
            return {}
        names = (self.names, Variable("", "name of a station", ("station",)))
        return {"station": names} | {
            f"station_{dim}": (place, Variable("m", f"{dim} of a station's node", ("station",)))
            for dim, place in zip(interface.dims, self.places.T, strict=True)
        }


def make_stations(given: Any, interface: Interface) -> Stations:
    """The stations that a user names.

    Parameters
    ----------
    given : mapping of str to place
        A place is x (m), on a plane (x, y); the node nearest to it is taken.
    interface : Interface

    Raises
    ------
    InputError
        Naming every station that is not on the interface.
    """
    if given is None:
        given = {}
    example = "{'centre': (0.05, 0.02)}" if interface.is_plane else "{'centre': 0.05}"
    if not isinstance(given, Mapping):
        raise InputError(
            f"stations: must be names and places in m, such as {example}, got {describe(given)}"
        )
    problems: list[str] = []
    nodes: list[list[int]] = []
    for name, place in given.items():
        parts = tuple(place) if isinstance(place, tuple | list | np.ndarray) else (place,)
        if not isinstance(name, str) or not name:
            problems.append(f"stations: a name must be a text, got {describe(name)}")
        elif len(parts) != len(interface.shape) or not all(is_finite(part) for part in parts):
            wanted = "a pair (x, y)" if interface.is_plane else "a number x"
            problems.append(f"stations[{name!r}]: must be {wanted} in m, got {describe(place)}")
        elif not _within(parts, interface):
            reach = " x ".join(f"{length:g}" for length in interface.lengths)
            problems.append(
                f"stations[{name!r}]: {describe(place)} is not on the interface of {reach} m;"
                " places are in m, from the first node"
            )
        else:
            steps = zip(parts, interface.spacings, interface.shape, strict=True)
            nodes.append([round(float(part) / spacing) % n for part, spacing, n in steps])
    if problems:
        raise InputError(problems)
    index = np.array(nodes, dtype=np.int64).reshape(len(nodes), len(interface.shape))
    flat = index[:, 0] if not interface.is_plane else index @ [interface.shape[1], 1]
    return Stations(
        names=np.array(list(given), dtype=str),
        nodes=np.asarray(flat, dtype=np.int64),
        places=index * np.array(interface.spacings),
    )


def _within(parts: tuple[Any, ...], interface: Interface) -> bool:
    return all(0.0 <= part <= length for part, length in zip(parts, interface.lengths, strict=True))
