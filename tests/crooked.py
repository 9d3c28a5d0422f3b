"""A line and a plane with nothing symmetric: what holds on them does not hold by accident.

The load has a mean other than one, initial stress, residual strength and pressure vary, cells have
unequal sides, the weakest place and the gap lie across the seam, and what is measured comes in mm
and MPa from an x that is not 0.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from setups import make_problem

import stiction as st

BEGIN = 0.0113
"""Where the coordinates of measured profiles begin, m."""


def uneven(interface: st.Interface, *, seed: int) -> Any:
    """A smooth field of mean 0 between -1 and 1, from a few waves of different phases."""
    rng = np.random.default_rng(seed)
    places = np.meshgrid(*interface.coordinates.values(), indexing="ij")
    turns = [
        2.0 * np.pi * x / length for x, length in zip(places, interface.lengths, strict=True)
    ]
    field = np.zeros(interface.shape)
    for number in (1, 2, 3):
        for turn in (*turns, sum(turns)):
            field += np.cos(number * turn + rng.uniform(0.0, 6.0)) * rng.uniform(0.4, 1.0)
    return field / np.abs(field).max()


def across_the_seam(interface: st.Interface, radius: float) -> Any:
    """A dip of height one, centred .3 of a spacing before the end of x and of y."""
    square: Any = 0.0
    places = np.meshgrid(*interface.coordinates.values(), indexing="ij")
    for x, length, h in zip(places, interface.lengths, interface.spacings, strict=True):
        square = square + ((x + 0.3 * h + length / 2.0) % length - length / 2.0) ** 2
    return np.exp(-square / radius**2)


def crooked(nodes: Any, length: Any, **options: Any) -> tuple[st.Problem, Any]:
    """A problem of linear weakening and a strength, neither of which is like its mirror image."""
    interface = st.Interface(length, nodes)
    load = st.Load(
        profile=1.3 + 0.3 * uneven(interface, seed=1),
        initial_stress=6e4 + 4e4 * uneven(interface, seed=2),
        normal_pressure=3e6 + 1e6 * uneven(interface, seed=3),
    )
    residual = 2e5 + 5e4 * uneven(interface, seed=4)
    given = {"weakening_rate": 0.28e12, "residual_strength": residual, "load": load} | options
    dip = across_the_seam(interface, 4e-3)
    strength = 1.1e6 + 1e5 * uneven(interface, seed=5) - 4.6e5 * dip
    return make_problem(nodes, length, **given), strength


LINE, LINE_STRENGTH = crooked(96, 0.037)
"""Of 6 nucleation lengths of 16 nodes."""
PLANE, PLANE_STRENGTH = crooked((24, 20), (0.023, 0.0164))
"""Of cells of .96 by .82 mm."""
TWO = np.stack(
    [LINE_STRENGTH, 1.04 * np.roll(LINE_STRENGTH, 31) - 2e4 * uneven(LINE.interface, seed=8)]
)
LINE_GAP = np.isin(np.arange(96), (93, 94, 95, 0, 1))
PLANE_GAP = np.logical_and.outer(
    np.isin(np.arange(24), (22, 23, 0)), np.isin(np.arange(20), (19, 0))
)
"""Nodes where nothing was measured, across the seam of x and, on the plane, of y."""


def of_width(problem: st.Problem, width: float) -> st.Problem:
    """The problem on an interface of a width, so that forces are known."""
    wide = dataclasses.replace(problem.interface, width=width)
    return dataclasses.replace(problem, interface=wide)


def as_measured(
    interface: st.Interface, values: Any, unit: str = "MPa", scale: float = 1e6
) -> Any:
    """Values at the nodes, in another unit, over coordinates in mm that begin at `BEGIN`."""
    steps = [round(BEGIN / h) for h in interface.spacings]
    rolled = np.roll(values, [-step for step in steps], range(-len(steps), 0)) / scale
    coordinates = {
        dim: (dim, (np.arange(n) + step) * h * 1e3, {"units": "mm"})
        for dim, n, step, h in zip(
            interface.dims, interface.shape, steps, interface.spacings, strict=True
        )
    }
    return xr.DataArray(rolled, coordinates, interface.dims, attrs={"units": unit})


def in_mm(array: Any) -> Any:
    """Stresses along x, Pa, in kPa over places in mm, the last one first."""
    there = ("x", 1e3 * array.x.values, {"units": "mm"})
    return (1e-3 * array).assign_coords(x=there).assign_attrs(units="kPa")[::-1]


def write_table(path: Path, measured: Any, name: str = "strength") -> Path:
    """A measured profile as a table with a line of names such as 'x (mm);strength (MPa)'."""
    table = measured.to_dataframe(name).reset_index()
    heads = [f"{dim} (mm)" for dim in measured.dims] + [f"{name} ({measured.units})"]
    table[[*measured.dims, name]].to_csv(path, sep=";", header=heads, index=False)
    return path
