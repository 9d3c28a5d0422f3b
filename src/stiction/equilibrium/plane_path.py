"""Paths and arrested events of planes: equilibria at given loads, and what a jump moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.equilibrium.follow_plane import PlaneEvent, follow_plane, plane_slip_at
from stiction.equilibrium.least_equilibrium import SLIDING, UNDECIDED
from stiction.equilibrium.plane_onset import symbol_of
from stiction.equilibrium.plane_patches import labelled_patches, patch_of
from stiction.equilibrium.plane_solver import plane_of, sample_of
from stiction.errors import warn_accuracy
from stiction.problem import Problem, Sample

ACCURACY = 1e-7
"""Of loads, as a share, and of stresses, as a share of the mean strength."""
MOVED = 1e-3
"""Share of the largest added slip from which on a node belongs to the patch of an event."""


def plane_equilibria(
    problem: Problem, rows: Sample, loads: Array
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.bool_]]:
    """Slip (m) and stress (Pa), (loads, nx, ny), arrested events so far, and whether it slides.

    Slip and stress are NaN where it slides.
    """
    plane, sample = plane_of(problem), sample_of(rows, 0)
    slip, status = plane_slip_at(plane, sample, loads, ACCURACY)
    if (status == UNDECIDED).any():
        first = int(np.argmax(status == UNDECIDED))
        warn_accuracy(
            f"no equilibrium was found at {loads[first]:g} Pa, and none was ruled out; the path"
            " ends below it"
        )
    interface = problem.interface
    symbol = symbol_of(plane, interface.shape)
    stress = np.full(slip.shape, np.nan)
    for number in range(loads.size):  # one at a time: transforms of all would take twice the memory
        relief = interface.inverse_transform(symbol * interface.transform(slip[number]))
        stress[number] = rows.initial_stress[0] + loads[number] * rows.load_profile - relief
    jumps = np.array([event.load for event in follow_plane(plane, sample).events])
    events = (jumps[None, :] < loads[:, None]).sum(axis=1)
    return slip, stress, events, status == SLIDING


class Jump(NamedTuple):
    """An arrested event: load (Pa), centre (m), extents (m), area (m²), mean slip (m), and slip
    times area over all the plane (m³)."""

    load: float
    centre: tuple[float, float]
    extents: tuple[float, float]
    area: float
    mean_slip: float
    potency: float


def jump_of(event: PlaneEvent, spacings: tuple[float, ...]) -> Jump:
    """What an event moved, around the largest slip added."""
    added = np.maximum(event.after - event.before, 0.0)
    numbers, _ = labelled_patches(added > MOVED * added.max())
    inside = numbers == numbers.flat[int(np.argmax(added))]
    patch = patch_of(inside, added, spacings)
    potency = float(added.sum()) * spacings[0] * spacings[1]
    return Jump(event.load, *patch, float(added[inside].mean()), potency)


def plane_jumps(problem: Problem, rows: Sample) -> list[tuple[int, Jump]]:
    """The arrested events of all samples, each with the number of its sample."""
    plane, spacings = plane_of(problem), problem.interface.spacings
    found = []
    for row in range(rows.samples):
        path = follow_plane(plane, sample_of(rows, row))
        if path.outcome != SLIDING:
            warn_accuracy(
                f"sample {row}: a jump at {path.load:g} Pa did not come to its end; events beyond"
                " it are not known"
            )
        found += [(row, jump_of(event, spacings)) for event in path.events]
    return found
