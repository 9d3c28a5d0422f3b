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

    On a plane, energies and moments are totals, and an area and an extent
    replace the length:

    >>> line, plane = Interface(0.8, 8), Interface((0.8, 2.0), (8, 10))
    >>> on_line, on_plane = event_variables(line), event_variables(plane)
    >>> on_line["event_moment"].units
    'N'
    >>> on_plane["event_moment"].units
    'N m'
    >>> sorted(on_line.keys() - on_plane)
    ['event_length']
    >>> sorted(on_plane.keys() - on_line)
    ['event_area', 'event_extent', 'event_magnitude']
    >>> [name for name, variable in on_plane.items() if len(variable.dims) == 2]
    ['event_position', 'event_hypocentre', 'event_extent', 'event_start', 'event_end']

    Inertia adds variables, and in specimens drives travel:

    >>> sorted(event_variables(line, True).keys() - on_line)
    ['event_duration', 'event_radiated_energy', 'event_settled', 'event_time']
    >>> free = Interface(0.8, 8, ends="free")
    >>> [len(event_variables(free, inertia).keys() - on_line) for inertia in (False, True)]
    [4, 5]
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
    """Return the variables of events in many samples.

    >>> of_samples({"event_load": Variable("Pa", "load", ("event",))})["event_load"].dims
    ('sample', 'event')
    """
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

    Without events there is one row of NaN, or as many rows as `most` demands:

    >>> variables = {"event_load": Variable("Pa", "load", ("event",))}
    >>> event_table(None, None, 0, [], variables)
    {'event_load': array([nan])}
    >>> event_table(None, None, 0, [], variables, 2)
    {'event_load': array([nan, nan])}
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

    >>> a, b = Variable("m", "", ("event",)), Variable("m", "", ("event", "direction"))
    >>> table = tabulate([{"a": 3.0, "b": (1.0, 2.0), "c": 7.0}], {"a": a, "b": b}, 2)
    >>> table["a"].tolist()
    [3.0, nan]
    >>> table["b"].tolist()
    [[1.0, 2.0], [nan, nan]]
    >>> tabulate([{"a": 3.0}, {"a": 4.0}], {"a": a})["a"].tolist()
    [3.0, 4.0]
    >>> tabulate([], {"b": b})["b"].shape
    (1, 2)
    >>> tabulate([], {"b": b}, 0)["b"].shape
    (0, 2)
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

    The nodes are 0.1 m apart. Node 6 slipped too little to belong to the
    patch, which lies across the border of a circle, and node 2 went back:

    >>> from types import SimpleNamespace
    >>> solid = SimpleNamespace(shear_modulus=5.0)
    >>> problem = SimpleNamespace(interface=Interface(0.8, 8), solid=solid)
    >>> before = SimpleNamespace(direction=np.array([0, 0.2, 0, 0, 0, 0, 0, 0.1]))
    >>> added, drop = np.array([4.0, 1, -0.8, 0, 0, 0, 0.002, 3.0]), np.arange(1.0, 9.0)
    >>> found = patch_measures(problem, before, added, drop)
    >>> names = "position", "length", "start", "end", "hypocentre", "mean_slip"
    >>> print(*(np.round(found[f"event_{name}"], 6) for name in names))
    [0.775] 0.3 [0.65] [0.15] [0.1] 2.666667
    >>> names = "largest_slip", "area_stress_drop", "slip_stress_drop", "moment", "magnitude"
    >>> print(*(round(float(found[f"event_{name}"]), 3) for name in names))
    4.0 3.667 3.834 3.601 -5.696
    >>> before.direction = np.zeros(8)
    >>> patch_measures(problem, before, added, drop)["event_hypocentre"]
    (nan,)

    At a free end, places do not repeat:

    >>> problem.interface = Interface(0.8, 8, ends="free")
    >>> found = patch_measures(problem, before, added[::-1], drop)
    >>> np.round([*found["event_start"], *found["event_end"]], 6).tolist()
    [0.6, 0.8]
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
    """Return the variables of one event.

    A slip of 0.1 m grows by 0.2 (1 + cos x) m, which releases 2 cos x Pa.
    Before the event, the stress is 0.5 + 3 x 2 Pa, 1 Pa above the residual
    strength. The sum over (1 - cos x) x 0.2 (1 + cos x) x 0.1 m is 0.08 J/m:

    >>> from types import SimpleNamespace
    >>> from stiction.problem.friction import LinearWeakening
    >>> problem = SimpleNamespace(
    ...     interface=Interface(0.8, 8), friction=LinearWeakening(3.0), specimen=None,
    ...     solid=SimpleNamespace(shear_modulus=5.0), relief=lambda slip: 0.0,
    ...     released_stress=lambda slip: 10.0 * (slip - slip.mean()),
    ... )
    >>> initial, residual, strength = np.outer([0.5, 5.5, 6.4], np.ones(8))
    >>> strength[4] = np.inf
    >>> rows = SimpleNamespace(
    ...     initial_stress=[None, initial], load_profile=np.full(8, 2.0), mean=np.mean,
    ...     residual_strength=[None, residual], strength=[None, strength],
    ...     weakening_rate=[None, np.full(8, 3.0)],
    ... )
    >>> slip = np.full(8, 0.1)
    >>> added = 0.2 * (1.0 + np.cos(np.arange(8) * np.pi / 4))
    >>> before = EquilibriumState(3.0, slip, added)
    >>> event = ArrestedEvent(before, EquilibriumState(3.2, slip + added, added))
    >>> found = _measures(problem, rows, 1, event)
    >>> names = "stress", "area_stress_drop", "slip_stress_drop", "energy_stress_drop"
    >>> print(*(round(float(found[f"event_{name}"]), 6) for name in names))
    6.5 0.285714 1.0 1.0

    Beyond d_c = 0.9/3 m, the whole energy, 0.9^2/6 = 0.135 J/m², is
    dissipated. Five nodes dissipate 0.06 J/m² more than before, and two
    nodes 0.03 J/m². Waves radiate further 0.05 J/m:

    >>> round(found["event_fracture_energy"], 6)
    0.036
    >>> waves = event._replace(known={"event_radiated_energy": 0.05})
    >>> found = _measures(problem, rows, 1, waves)
    >>> round(float(found["event_energy_stress_drop"]), 6)
    1.075
    >>> found["event_radiated_energy"]
    0.05

    In a machine, slip lowers the stress by 2 Pa/m times mean slip times profile:

    >>> problem.relief = lambda slip: 2.0 * slip.mean()
    >>> travel = lambda force, slip: force / 8.0 + slip.mean()
    >>> relief = lambda slip: 3.0 * slip.mean()
    >>> problem.blocks = SimpleNamespace(mean_relief=relief, travel=travel)
    >>> drive = SimpleNamespace(stiffness=4.0)
    >>> problem.specimen = SimpleNamespace(drive=drive, thickness=0.5)
    >>> found = _measures(problem, rows, 1, event)
    >>> names = "stress", "stress_drop", "travel", "crosshead_travel", "travel_step"
    >>> print(*(round(float(found[f"event_{name}"]), 6) for name in names))
    6.1 0.4 0.37 0.69 0.16
    """
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
    """Return a node's position along each direction, m. The interface is flattened.

    >>> np.round(place_of(Interface((0.8, 2.0), (8, 10)), 13), 6).tolist()
    [0.1, 0.6]
    """
    entry = np.unravel_index(node, interface.shape)
    return [float(at[i]) for at, i in zip(interface.coordinates.values(), entry, strict=True)]


def moment_of(problem: Problem, slip: Array) -> float:
    """Return the moment (N) of a slip in m, or the moment rate (N/s) of a slip rate in m/s.

    On a plane, the units are N m and N m/s.

    >>> from types import SimpleNamespace
    >>> solid, plane = SimpleNamespace(shear_modulus=5.0), Interface((0.8, 2.0), (8, 10))
    >>> problem = SimpleNamespace(solid=solid, interface=plane)
    >>> round(moment_of(problem, np.array([3.0, 4.0])), 6)  # 5 Pa x 7 m x 0.1 m x 0.2 m
    0.7
    """
    return problem.solid.shear_modulus * float(slip.sum()) * problem.interface.cell


def travel_of(problem: Problem, load: float, slip: Array) -> float:
    """Return the total travel, m, of the two drives of a specimen since the unloaded state.

    Slip lowers the load from 5 to 2 Pa, which act on 0.5 m:

    >>> from types import SimpleNamespace
    >>> travel = lambda force, slip: force / 8.0 + slip[0]
    >>> blocks = SimpleNamespace(mean_relief=lambda slip: 2.0 * slip.mean(), travel=travel)
    >>> problem = SimpleNamespace(blocks=blocks, interface=Interface(0.5, 8))
    >>> travel_of(problem, 5.0, np.array([1.0, 2.0]))
    1.125
    """
    force = (load - float(problem.blocks.mean_relief(slip))) * problem.interface.measure
    return float(problem.blocks.travel(force, slip))


def elongation_of(problem: Problem, stress: float) -> float:
    """Return the elongation of the machine (m) at a mean stress of the whole interface (Pa).

    The elongation is NaN under a dead load.

    6 Pa act on 0.5 m x 0.25 m, against 4 N/m:

    >>> from types import SimpleNamespace
    >>> drive = SimpleNamespace(stiffness=4.0)
    >>> specimen = SimpleNamespace(drive=drive, thickness=0.25)
    >>> problem = SimpleNamespace(specimen=specimen, interface=Interface(0.5, 8))
    >>> elongation_of(problem, 6.0)
    0.1875
    >>> specimen.thickness = None
    >>> elongation_of(problem, 6.0)
    0.0
    >>> drive.stiffness = 0.0
    >>> elongation_of(problem, 6.0)
    nan
    """
    assert problem.specimen is not None
    machine, depth = problem.specimen.drive.stiffness, problem.specimen.thickness
    if machine == 0.0:
        return np.nan
    if depth is None:  # without a thickness a machine must be rigid
        return 0.0
    return stress * (problem.interface.measure * depth) / machine
