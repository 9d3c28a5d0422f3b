"""The table of events, which are instabilities that came to rest, for all methods.

Problem
-------
An event takes an interface at rest from the slip d_0 to the slip d_1.
With delta = d_1 - d_0, the event releases the stress K delta, at the
load at which it begins. The table holds these measures:

1. The patch of an event is the region around the largest delta in which
   delta exceeds the fraction `MIN_ADDED_SLIP` of its largest value. The
   patch has extents, an area and a mean slip. Outside the patch, slip
   also grows a little.
2. The moment is G times the integral of delta. On a plane, the
   magnitude follows from the moment: Mw = (log10 M_0 - 9.1)/1.5 with
   M_0 in N m (Hanks and Kanamori, 1979, in SI units).
3. There are three stress drops (Noda, Lapusta and Kanamori,
   2013). The first is the mean of K delta over the patch. The
   second is the mean of K delta weighted by delta. The third is
   twice the energy that the slip releases beyond friction at the
   residual strength, over the integral of delta. Waves and
   weakening divide this energy. If the stress comes to rest at
   the residual strength at a constant load, the third equals the
   second. In a rupture both parts of the energy are known. They
   contain the work of the load, which rises during the event.
4. The fracture energy is the energy dissipated above the residual strength.
5. Methods with inertia also give the duration of an event. Between
   half-spaces, they give the time at which the event begins and the
   radiated energy.

With a machine, the load is the drive: the mean stress that the drive
would cause without slip. Slip lowers the actual stress.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.variables import Variable
from stiction.methods.equilibrium.patches import largest_patch
from stiction.methods.equilibrium.state import EquilibriumState
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.results import per_area, position
from stiction.problem.sample import Sample

OF_SPECIMENS = {
    "event_stress_drop": Variable("Pa", "drop of the mean interface stress", ("event",)),
    "event_travel": Variable("m", "travel of the drives before the event", ("event",)),
    "event_crosshead_travel": Variable(
        "m", "travel of the machine's far ends before the event", ("event",)
    ),
    "event_travel_step": Variable("m", "travel of the drives in the event", ("event",)),
}
WITH_INERTIA = {
    "event_duration": Variable("s", "time from the first to the last fast slip", ("event",))
}
BETWEEN_HALF_SPACES = {
    "event_time": Variable("s", "time from zero load to the event", ("event",)),
    "event_radiated_energy": Variable("J/m", "energy radiated by the event", ("event",)),
    "event_settled": Variable("1", "whether the event ended before its run did", ("event",)),
}
MIN_ADDED_SLIP = 1e-3
"""Smallest added slip of the nodes in the patch of an event, as a
fraction of the largest."""


def event_variables(interface: Interface, inertia: bool = False) -> dict[str, Variable]:
    """Return the variables of events.

    `inertia` adds the variables that a rupture provides.
    """

    # On a plane, positions have two components, and an area replaces
    # the length. `per_area` changes the units of energies and moments.
    def variable(units: str, text: str) -> Variable:
        return Variable(units, text, ("event",))

    plane = interface.is_plane
    centre = variable("m", "centre of the slip added by the event")
    extent = variable("m", f"{'extent' if plane else 'length'} of the patch that slipped")
    hypocentre = variable("m", "position of the node from which the event starts")
    start = variable("m", "end of the patch that slipped, towards smaller coordinates")
    end = variable("m", "end of the patch that slipped, towards larger coordinates")
    moment = "shear modulus times slip added" + ("" if plane else ", per unit depth")
    variables = {
        "event_load": variable("Pa", "load factor of the event"),
        "event_stress": variable("Pa", "mean interface stress at the event"),
        "event_position": position(interface, centre),
        "event_hypocentre": position(interface, hypocentre),
        "event_extent" if plane else "event_length": position(interface, extent),
        "event_start": position(interface, start),
        "event_end": position(interface, end),
        **({"event_area": variable("m2", "area of the patch that slipped")} if plane else {}),
        "event_mean_slip": variable("m", "mean slip added to that patch"),
        "event_largest_slip": variable("m", "largest slip added by the event"),
        "event_moment": variable("N", moment),
        **({"event_magnitude": variable("1", "moment magnitude")} if plane else {}),
        "event_area_stress_drop": variable(
            "Pa", "mean stress drop over the patch that slipped"
        ),
        "event_slip_stress_drop": variable("Pa", "mean stress drop weighted by the slip added"),
        "event_energy_stress_drop": variable(
            "Pa", "twice the energy released above the residual strength, over the slip added"
        ),
        "event_fracture_energy": variable("J/m", "dissipation of the event above the residual"),
        **(WITH_INERTIA if inertia else {}),
        **(OF_SPECIMENS if interface.is_free else BETWEEN_HALF_SPACES if inertia else {}),
    }
    return {name: per_area(interface, known) for name, known in variables.items()}


def of_samples(variables: dict[str, Variable]) -> dict[str, Variable]:
    """Return the variables of events in many samples."""
    return {
        name: replace(variable, dims=("sample", *variable.dims))
        for name, variable in variables.items()
    }


class ArrestedEvent(NamedTuple):
    """The states before and after an instability that came to rest.

    `known` holds, by name, the variables that only a method with
    inertia provides, and those that it knows better.
    """

    before: EquilibriumState
    after: EquilibriumState
    known: Mapping[str, Any] = MappingProxyType({})


def event_table(
    problem: Problem,
    rows: Sample,
    row: int,
    events: Sequence[ArrestedEvent],
    variables: Mapping[str, Variable],
    most: int | None = None,
) -> dict[str, Array]:
    """Return the variables of the events in one sample as arrays (events, ...).

    With `most`, the arrays hold the first `most` events. If there are
    fewer, they are padded with NaN.
    """
    # Methods that lack a variable do not ask for it, so `_measures` may
    # return more.
    measured = [_measures(problem, rows, row, event) for event in events[:most]]
    return tabulate(measured, variables, most)


def tabulate(
    measured: Sequence[Any], variables: Mapping[str, Variable], most: int | None = None
) -> dict[str, Array]:
    """Return the variables of measured events as arrays, padded with NaN to `most` events.

    Without `most` there is at least one row: a dimension of length zero
    would leave no row in the table of a path.
    """
    table, count = {}, len(measured)
    size = max(count, 1) if most is None else most
    for name, variable in variables.items():
        # After 'event', the only other dimension is 'direction'.
        components = (2,) * (len(variable.dims) - 1)
        table[name] = np.full((size, *components), np.nan)
        known = [values[name] for values in measured]
        table[name][:count] = np.reshape(known, (count, *components))
    return table


def patch_measures(problem: Problem, before: Any, added: Array, drop: Array) -> dict[str, Any]:
    """Return the measures of the patch, from added slip (*shape), m, and drop of shear stress, Pa.

    `before` is the state before the event.
    """
    direction = before.direction
    # 1. and 2. Patch and moment.
    # The centre and the extents follow the growth alone.
    interface, moment = problem.interface, moment_of(problem, added)
    periods = (np.inf,) if interface.is_free else interface.lengths  # after which places repeat
    inside, patch = largest_patch(np.maximum(added, 0.0), interface, MIN_ADDED_SLIP)
    return {
        "event_position": patch.centre,
        "event_hypocentre": place_of(interface, int(np.argmax(direction)))
        if direction.any()
        else (np.nan,) * len(interface.shape),
        "event_length": patch.area,
        "event_start": patch.starts,
        "event_end": np.mod(np.add(patch.starts, patch.extents), periods),
        "event_extent": patch.extents,
        "event_area": patch.area,
        "event_mean_slip": added[inside].mean(),
        "event_largest_slip": added.max(),
        "event_moment": moment,
        "event_magnitude": (np.log10(moment) - 9.1) / 1.5,
        # 3.
        "event_area_stress_drop": drop[inside].mean(),
        "event_slip_stress_drop": (drop * added).sum() / added.sum(),
    }


def _measures(problem: Problem, rows: Sample, row: int, event: ArrestedEvent) -> dict[str, Any]:
    """Return the variables of one event."""
    (before, after, known), interface, law = event, problem.interface, problem.friction
    means = (rows.initial_stress[row], rows.load_profile)
    initial, profile = (float(rows.mean(values)) for values in means)
    slips = before.slip.reshape(interface.shape), after.slip.reshape(interface.shape)
    added = slips[1] - slips[0]
    stress_before = before.load - problem.relief(before.slip)
    stress_after = after.load - problem.relief(after.slip)
    # 3. and 4. Stress drops and fracture energy. Waves and weakening
    # divide the work that the mean of the stresses before and after, at
    # a constant load, does on the slip beyond the residual strength.
    drop, residual = problem.released_stress(added), rows.residual_strength[row]
    # `above` is the stress before the event, less the residual strength.
    above = rows.initial_stress[row] + before.load * rows.load_profile - residual
    above = above - problem.released_stress(slips[0])
    # Nodes that cannot break do not slip, and dissipate nothing.
    weakening = np.where(np.isfinite(rows.strength[row]), rows.strength[row] - residual, 0.0)
    dissipated = [law.dissipated(slip, weakening, rows.weakening_rate[row]) for slip in slips]
    fracture = float((dissipated[1] - dissipated[0]).sum()) * interface.cell
    released = 0.5 * float(((2.0 * above - drop) * added).sum()) * interface.cell
    # With inertia, the energies are known. They include the work of the
    # load that rises.
    if "event_radiated_energy" in known:
        released = fracture + known["event_radiated_energy"]
    values = {
        "event_load": before.load,
        "event_stress": initial + stress_before * profile,
        **patch_measures(problem, before, added, drop),
        "event_energy_stress_drop": 2.0 * released / (added.sum() * interface.cell),
        "event_fracture_energy": fracture,
        **known,
    }
    if problem.specimen is not None:
        # The machine drives the whole interface, also beyond an extent.
        whole = before.load - float(problem.blocks.mean_relief(before.slip))
        travel_before = travel_of(problem, before.load, before.slip)
        travel_after = travel_of(problem, after.load, after.slip)
        values |= {
            "event_stress_drop": (stress_before - stress_after) * profile,
            "event_travel": travel_before,
            "event_crosshead_travel": travel_before
            + elongation_of(problem, float(rows.initial_stress[row].mean()) + whole),
            "event_travel_step": travel_after - travel_before,
        }
    return values


def place_of(interface: Interface, node: int) -> list[float]:
    """Return a node's position along each direction, m. The interface is flattened."""
    entry = np.unravel_index(node, interface.shape)
    return [float(at[i]) for at, i in zip(interface.coordinates.values(), entry, strict=True)]


def moment_of(problem: Problem, slip: Array) -> float:
    """Return the moment (N) of a slip in m, or the moment rate (N/s) of a slip rate in m/s.

    On a plane, the units are N m and N m/s.
    """
    return problem.solid.shear_modulus * float(slip.sum()) * problem.interface.cell


def travel_of(problem: Problem, load: float, slip: Array) -> float:
    """Return the total travel, m, of the two drives of a specimen since the unloaded state."""
    force = (load - float(problem.blocks.mean_relief(slip))) * problem.interface.measure
    return float(problem.blocks.travel(force, slip))


def elongation_of(problem: Problem, stress: float) -> float:
    """Return the elongation of the machine (m) at a mean stress of the whole interface (Pa).

    The elongation is NaN under a dead load.
    """
    assert problem.specimen is not None
    machine, depth = problem.specimen.drive.stiffness, problem.specimen.thickness
    if machine == 0.0:
        return np.nan
    if depth is None:  # without a thickness a machine must be rigid
        return 0.0
    return stress * (problem.interface.measure * depth) / machine
