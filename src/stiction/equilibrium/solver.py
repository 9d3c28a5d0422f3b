"""The solver of the equilibrium method: samples in, onsets out, on lines and planes."""

import itertools
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.linear import inner
from stiction.equilibrium.dense import LineProgram
from stiction.equilibrium.patches import Patch, critical_patch, largest_patch, patches_of
from stiction.equilibrium.sample import (
    GAP,
    LENGTH,
    LOAD,
    PATCHES,
    POSITION,
    First,
    Sample,
    State,
    present_pieces,
    residual_nodes,
    steep_corners,
)
from stiction.equilibrium.transforms import PlaneProgram
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.problem import Problem
from stiction.problem import Sample as Samples
from stiction.results import position
from stiction.variables import Variable

FINE = 8.0
"""Nodes in the nucleation length below which there is a warning."""
ROUGHLY = {
    1: "single onsets are off by 0.4 % at 9 nodes and 3 % at 4 if the correlation length is a"
    " quarter of it, by 3 and 9 % if it is a tenth",
    2: "single onsets are off by 0.15 % at 9 nodes along x and 6 along y, by 0.5 % at 6 and 4",
}
SHARE = 0.5
"""Estimated error, in per cent of the onset, above which there is a warning."""
EVENT_CORE = 1e-3
"""Share of the largest added slip above which a node belongs to the patch of an event."""

Program: TypeAlias = LineProgram | PlaneProgram


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
    }


class Event(NamedTuple):
    """An instability that came to rest: the states before and after it."""

    before: State
    after: State


def event_table(
    problem: Problem, rows: Samples, row: int, events: list[Event]
) -> dict[str, Array]:
    """Return the variables of the arrested events of one sample, (events, ...) arrays."""
    interface, plane = problem.interface, problem.interface.is_plane
    initial, profile = rows.initial_stress[row].mean(), rows.load_profile.mean()
    table = []
    for before, after in events:
        added = (after.slip - before.slip).reshape(interface.shape)
        inside, patch = largest_patch(np.maximum(added, 0.0), interface.spacings, EVENT_CORE)
        stress = initial + before.load * profile
        moment = problem.solid.shear_modulus * float(added.sum()) * interface.cell
        measures = (
            (patch.centre, patch.extents, patch.area) if plane else (*patch.centre, patch.area)
        )
        table.append((before.load, stress, *measures, added[inside].mean(), moment))
    names = event_variables(interface)
    if not table:
        return {name: np.empty((0, 2)[: len(names[name].dims)]) for name in names}
    columns = zip(*table, strict=True)
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}


@dataclass
class Path:
    """Course of one sample until it slides.

    `first` is the first instability, `last` the last equilibrium, `known` is false where a jump
    or a path did not come to its end: `last` is then a lower bound.
    """

    first: State
    last: State
    events: list[Event] = field(default_factory=list)
    known: bool = True


def follow(program: Program, sample: Sample, found: State | None = None) -> Path:
    """Follow a sample from its first instability, or from rest, to global sliding.

    Arrest is overdamped: the patch stops at the least equilibrium of the same load. Inertia may
    carry it through.
    """
    if found is None:
        found = program.next(sample, program.at_rest(sample))
    first: State | None = None
    events: list[Event] = []
    known = found.known
    while found.unstable:
        jump = program.jump(sample, found)
        if jump.counts:
            first = first or found
            if not jump.arrested:
                known = jump.known
                break
            events.append(Event(found, jump.state))
        found = program.next(sample, jump.state)
        known = found.known
    return Path(first or found, found, events, known)


def listed(numbers: NDArray[np.int64], most: int = 5) -> str:
    """Return 'samples 0, 4 and 3 more'."""
    shown = ", ".join(map(str, numbers[:most]))
    more = f" and {numbers.size - most} more" if numbers.size > most else ""
    return f"sample{'s' * (numbers.size > 1)} {shown}{more}"


def make_program(problem: Problem, gap: float = 1e-6, every: int = 1) -> Program:
    """Return the programme that finds equilibria on all nodes of a problem, or every second."""
    if problem.interface.is_plane:
        return PlaneProgram(problem, gap, every)
    return LineProgram(problem, every)


class Solver:
    """Solves samples of a problem; safe to call from several threads.

    Its options are those of `Equilibrium`.
    """

    def __init__(
        self,
        problem: Problem,
        *,
        sensitivity: bool = False,
        slip: bool = False,
        discretization_error: bool = False,
        events: int = 0,
        gap: float = 1e-6,
    ) -> None:
        self.problem = problem
        self.program = make_program(problem, gap)
        self.sensitivity, self.slip, self.events = sensitivity, slip, events
        self.coarse: Program | None = None
        if discretization_error:
            _check_multiple_of_four(problem)
            self.coarse = make_program(problem, gap, every=2)

    def __call__(self, rows: Samples) -> dict[str, NDArray[Any]]:
        """Return the onset of each sample; see `Equilibrium`."""
        if self.coarse is None:
            cost = ROUGHLY[len(self.problem.interface.shape)]
            how = "Equilibrium(discretization_error=True) estimates it"
            self.problem.warn_if_coarse(rows, FINE, f"{cost}; {how}")
        first, states = self.program.first(rows, self.slip or self.sensitivity)
        interface = self.problem.interface
        places = slice(POSITION, POSITION + len(interface.shape))
        load, sliding = first.table[:, LOAD].copy(), first.table[:, places].copy()
        arrested = np.zeros(rows.samples, dtype=np.int64)
        reached, unproved, lost = np.zeros((3, rows.samples), dtype=np.bool_)
        events = self._no_events(rows.samples)
        for row, state in states.items():
            sample = self.program.sample_of(rows, row)
            try:
                path = follow(self.program, sample, state)
            except Exception as error:
                error.add_note(
                    f"in sample {row} of the {rows.samples} that were solved together"
                )
                raise
            if state is None:
                self._describe(first, row, sample, path.first)
                unproved[row] = not path.first.certified or np.isnan(first.table[row, GAP])
            last = path.last
            load[row], lost[row], arrested[row] = last.load, not path.known, len(path.events)
            reached[row] = residual_nodes(sample, last.slip).any()
            sliding[row] = first.table[row, places]
            if last.direction.any():
                sliding[row] = self._patch(last.direction).centre
            table = event_table(self.problem, rows, row, path.events[: self.events])
            for name, column in events.items():
                column[row, : len(table[name])] = table[name]
        at_first, gap = first.table[:, LOAD], first.table[:, GAP]
        self._warn(gap, at_first, unproved, lost)
        values = {
            "critical_load": load,
            "critical_stress": rows.mean_stress(load),
            "first_instability": rows.mean_stress(at_first),
            "certificate_gap": gap * rows.load_profile.mean(),
            "critical_position": first.table[:, places],
            "sliding_position": sliding,
            "slip_patches": first.table[:, PATCHES].astype(np.int64),
            "arrested_events": arrested,
            "residual_reached": reached,
        } | events
        if interface.is_plane:
            values["critical_patch_extent"] = first.table[:, 5:7]
            values["critical_patch_area"] = first.table[:, 7]
            values["certified"] = ~unproved
        else:
            values["critical_patch_length"] = first.table[:, LENGTH]
            for name in ("critical_position", "sliding_position"):
                values[name] = values[name][:, 0]
        if self.slip:
            values["slip"] = first.slip.reshape(rows.strength.shape)
        if self.sensitivity:
            sensitivity = first.multiplier * rows.load_profile.mean()
            values["sensitivity"] = sensitivity.reshape(rows.strength.shape)
            _warn_if_lost(sensitivity)
        if self.coarse is not None:
            values["discretization_error"] = self._discretization_error(
                rows, values["first_instability"]
            )
        return values

    def _no_events(self, samples: int) -> dict[str, Array]:
        """Return NaN for each variable of each of the events that are kept."""
        if not self.events:
            return {}
        return {
            name: np.full((samples, self.events, *(2,) * (len(variable.dims) - 1)), np.nan)
            for name, variable in event_variables(self.problem.interface).items()
        }

    def _patch(self, direction: Array) -> Patch:
        interface = self.problem.interface
        return critical_patch(direction.reshape(interface.shape), interface.spacings)[1]

    def _describe(self, first: First, row: int, sample: Sample, state: State) -> None:
        """Write the variables of a first instability that was found by following the path."""
        y = state.direction / max(inner(state.direction, sample.profile), 1e-300)
        patch = self._patch(y)
        gap = self.program.gap(sample, state, y)
        patches = patches_of(state.slip.reshape(self.problem.interface.shape))
        known = (state.load, gap, patches, *patch.centre, *patch.extents, patch.area)
        first.table[row, LOAD:] = known[: first.table.shape[1] - LOAD]
        if self.slip:
            first.slip[row] = state.slip
        if self.sensitivity:
            first.multiplier[row] = _sensitivity(self.program, sample, state, y)

    def _discretization_error(self, rows: Samples, onset: Array) -> Array:
        """Estimate the size of the error of each onset that is due to the node spacing, Pa.

        The same profiles are solved on every second node. The onset converges with the square of
        the spacing, so that the error is a third of the difference to a grid twice as coarse. Its
        sign is random on random profiles: the root mean square of all is taken.
        """
        assert self.coarse is not None
        others = []
        for offset in itertools.product((0, 1), repeat=len(rows.shape)):
            nodes: Any = (..., *(slice(first, None, 2) for first in offset))
            part = Samples(*(given[nodes] for given in rows))
            others.append(part.mean_stress(first_instabilities(self.coarse, part)))
        error: Array = (
            np.sqrt(np.mean([(other - onset) ** 2 for other in others], axis=0)) / 3.0
        )
        percent = 100.0 * error / np.abs(onset)
        if np.any(percent > SHARE):
            warn_accuracy(
                "the node spacing changes the first instability by an estimated"
                f" {np.sqrt(np.mean(percent**2)):.2g} % (root mean square of {onset.size}"
                f" samples, at most {percent.max():.2g} %); take more nodes"
            )
        return error

    def _warn(
        self, gap: Array, load: Array, unproved: NDArray[np.bool_], lost: NDArray[np.bool_]
    ) -> None:
        """Warn where bounds are wide or absent, or where a path was not followed to its end."""
        share = gap / np.maximum(np.abs(load), 1e-300)
        wide = np.flatnonzero(~unproved & ~(share <= self.program.widest_gap))
        if wide.size:
            warn_accuracy(
                f"the bounds of the first instability did not close to {self.program.widest_gap:g}"
                f" of it in {wide.size} of {gap.size} samples ({listed(wide)}): they hold, and are"
                f" up to {share[wide].max():.2g} of it apart; take more nodes"
            )
        free = np.flatnonzero(unproved)
        if free.size and self.problem.interface.is_plane:
            warn_accuracy(
                "nodes reach a corner of the law or their residual strength before the first"
                f" instability in {free.size} of {gap.size} samples ({listed(free)}): it was found"
                f" by following equilibria, to {share[free].max():.2g} of it, and has no"
                " certificate"
            )
        if lost.any():
            warn_accuracy(
                f"a jump was not followed to its end in {lost.sum()} of {gap.size}"
                f" samples ({listed(np.flatnonzero(lost))}): their critical load is the"
                " last with a known equilibrium, a lower bound"
            )


def first_instabilities(program: Program, rows: Samples) -> Array:
    """Return the loads of the first instabilities alone, tau_0, Pa."""
    first, states = program.first(rows, False)
    load = first.table[:, LOAD].copy()
    for row, state in states.items():
        if state is None:
            sample = program.sample_of(rows, row)
            found = program.next(sample, program.at_rest(sample))
            load[row] = (
                found if found.certified else follow(program, sample, found).first
            ).load
    return load


def _check_multiple_of_four(problem: Problem) -> None:
    """Raise `InputError` if taking every second node leaves an odd number of nodes."""
    shape = problem.interface.shape
    if any(nodes % 4 for nodes in shape):
        given, enough = (" x ".join(map(str, n)) for n in (shape, [n + -n % 4 for n in shape]))
        raise InputError(
            f"interface.nodes: must be a multiple of four for discretization_error, got {given};"
            f" take {enough}"
        )


def _sensitivity(program: Program, sample: Sample, state: State, y: Array) -> Array:
    """Derivative of the load of an instability by the peak strengths, from its multiplier.

    NaN where nodes begin to weaken more steeply at that load, several at once or on a plane.
    """
    piece = present_pieces(sample, state.slip).piece
    if isinstance(program, PlaneProgram):
        if sample.pieces.steepens and not state.certified:
            return np.full(y.size, np.nan)
    elif (corners := steep_corners(sample, state.slip)).size:
        return program.corner_sensitivity(sample, state.slip, piece, corners)
    # A piece starts from share tau_p + (1 - share) tau_r; the share of the last piece is 0.
    return y * np.where(sample.critical > 0.0, sample.pieces.starts[piece], 1.0)


def _warn_if_lost(sensitivity: Array) -> None:
    """Warn where a first instability has no derivative."""
    lost = int(np.isnan(sensitivity).any(axis=1).sum())
    if lost:
        warn_accuracy(
            f"nodes begin to weaken more steeply in {lost} of {len(sensitivity)} samples:"
            " their first instability has no known derivative, so sensitivity is NaN"
        )
