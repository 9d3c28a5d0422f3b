"""Arrested events and their variables, and the travel of a machine on the way.

Behind a machine the load is the drive: the mean stress that it would cause without slip. Slip
relieves it.
"""

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.variables import Variable
from stiction.methods.equilibrium.patches import largest_patch
from stiction.methods.equilibrium.sample import EquilibriumState
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.results import position
from stiction.problem.sample import Sample

OF_SPECIMENS = {
    "event_stress_drop": Variable("Pa", "fall of the mean interface stress", ("event",)),
    "event_travel": Variable("m", "travel of the drives before the event", ("event",)),
    "event_crosshead_travel": Variable(
        "m", "travel of the machine's far ends before the event", ("event",)
    ),
    "event_travel_step": Variable("m", "travel of the drives in the event", ("event",)),
    "event_start": Variable("m", "left end of the patch that slipped", ("event",)),
}
MIN_ADDED_SLIP = 1e-3
"""Smallest added slip of the nodes in the patch of an event, as a share of the largest."""


def event_variables(interface: Interface) -> dict[str, Variable]:
    """Return the variables of each arrested event on a line or a plane."""

    def variable(units: str, text: str) -> Variable:
        return Variable(units, text, ("event",))

    plane = interface.is_plane
    centre = variable("m", "centre of the slip added by the event")
    extent = variable("m", f"{'extent' if plane else 'length'} of the patch that slipped")
    moment = "shear modulus times slip added" + ("" if plane else ", per unit depth")
    return {
        "event_load": variable("Pa", "load factor of the event"),
        "event_stress": variable("Pa", "mean interface stress at the event"),
        "event_position": position(interface, centre),
        "event_extent" if plane else "event_length": position(interface, extent),
        **({"event_area": variable("m2", "area of the patch that slipped")} if plane else {}),
        "event_mean_slip": variable("m", "mean slip added to that patch"),
        "event_moment": variable("N m" if plane else "N", moment),
        **(OF_SPECIMENS if interface.is_free else {}),
    }


class ArrestedEvent(NamedTuple):
    """States before and after an instability that came to rest."""

    before: EquilibriumState
    after: EquilibriumState


def event_table(
    problem: Problem, rows: Sample, row: int, events: list[ArrestedEvent]
) -> dict[str, Array]:
    """Return the variables of a sample's arrested events, (events, ...) arrays."""
    initial, profile = rows.initial_stress[row].mean(), rows.load_profile.mean()
    measured = [_measures(problem, initial, profile, *event) for event in events]
    return {
        name: np.array([values[name] for values in measured]).reshape(
            len(events), *(2 for _ in variable.dims[1:])
        )
        for name, variable in event_variables(problem.interface).items()
    }


def _measures(
    problem: Problem,
    initial: float,
    profile: float,
    before: EquilibriumState,
    after: EquilibriumState,
) -> dict[str, Any]:
    """Return the variables of an event; `initial` and `profile` are means over the interface."""
    interface = problem.interface
    added = (after.slip - before.slip).reshape(interface.shape)
    # Slip elsewhere also grows a little in an event. The patch is around the largest added slip.
    inside, patch = largest_patch(np.maximum(added, 0.0), interface, MIN_ADDED_SLIP)
    stress_before = before.load - problem.relief(before.slip)
    stress_after = after.load - problem.relief(after.slip)
    values = {
        "event_load": before.load,
        "event_stress": initial + stress_before * profile,
        "event_position": patch.centre,
        "event_length": patch.area,
        "event_extent": patch.extents,
        "event_area": patch.area,
        "event_mean_slip": added[inside].mean(),
        "event_moment": problem.solid.shear_modulus * float(added.sum()) * interface.cell,
    }
    if problem.specimen is not None:
        travel_before = travel_of(problem, before.load, before.slip)
        travel_after = travel_of(problem, after.load, after.slip)
        values |= {
            "event_stress_drop": (stress_before - stress_after) * profile,
            "event_travel": travel_before,
            "event_crosshead_travel": travel_before
            + elongation_of(problem, values["event_stress"]),
            "event_travel_step": travel_after - travel_before,
            "event_start": float(np.argmax(inside)) * interface.spacing,
        }
    return values


def travel_of(problem: Problem, load: float, slip: Array) -> float:
    """Return the travel of a specimen's two drives together since the unloaded state, m."""
    force = (load - float(problem.blocks.mean_relief(slip))) * problem.interface.measure
    return float(problem.blocks.travel(force, slip))


def elongation_of(problem: Problem, stress: float) -> float:
    """Return the elongation of the machine (m) at a mean stress of the whole interface (Pa).

    It is NaN under a dead load, which has no far end.
    """
    assert problem.specimen is not None
    machine, depth = problem.specimen.drive.stiffness, problem.specimen.thickness
    if machine == 0.0:
        return np.nan
    if depth is None:  # it is rigid
        return 0.0
    return stress * (problem.interface.measure * depth) / machine
