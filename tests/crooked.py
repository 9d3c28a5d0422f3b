"""A line and a plane with nothing symmetric: what holds on them does not hold by accident.

The load has a mean other than one, initial stress, residual strength and pressure vary, cells have
unequal sides, and the weakest place lies across the seam.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from setups import make_problem

import stiction as st


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
