"""The solver of the equilibrium method: samples in, onsets out, on lines and planes."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.elasticity.linear import dot
from stiction.equilibrium.dense import GAP, LENGTH, LOAD, PATCHES, POSITION, LineProgram
from stiction.equilibrium.follow import Event, Path, State, follow
from stiction.equilibrium.patches import critical_patch, largest_patch, patches_of
from stiction.equilibrium.sample import Sample, present_pieces, residual_nodes, steep_corners
from stiction.equilibrium.transforms import PlaneProgram
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.problem import Problem
from stiction.problem import Sample as Samples
from stiction.results import Variable, position

FINE = 8.0
"""Nodes in the nucleation length below which there is a warning."""
ROUGHLY = (
    "single onsets of a line are off by 0.4 % at 9 nodes and by 3 % at 4 for a correlation length"
    " of a quarter of it, by 3 and 9 % for a tenth; those of a plane by 0.15 % at 9 along x and 6"
    " along y, by 0.5 % at 6 and 4; Equilibrium(discretization_error=True) estimates it"
)
SHARE = 0.5
"""Estimated error, in per cent of the onset, from which on there is a warning."""
EVENT_CORE = 1e-3
"""Share of the largest added slip from which on a node belongs to the patch of an event."""

_PATCH = Variable("m", "length of the patch that slipped", ("event",))
EVENTS = {
    "event_load": Variable("Pa", "load factor of the event", ("event",)),
    "event_stress": Variable("Pa", "mean interface stress at the event", ("event",)),
    "event_position": Variable("m", "centre of the slip added by the event", ("event",)),
    "event_length": _PATCH,
    "event_mean_slip": Variable("m", "mean slip added to that patch", ("event",)),
    "event_moment": Variable("N", "shear modulus times slip added, per unit depth", ("event",)),
}


def event_variables(interface: Interface) -> dict[str, Variable]:
    """Return what is known of each arrested event on a line or a plane."""
    if not interface.is_plane:
        return EVENTS
    extent = replace(_PATCH, long_name="extent of the patch that slipped")
    area = replace(_PATCH, units="m2", long_name="area of the patch that slipped")
    moment = Variable("N m", "shear modulus times slip added", ("event",))
    variables = EVENTS | {"event_position": position(interface, EVENTS["event_position"])}
    variables |= {"event_extent": position(interface, extent), "event_area": area}
    del variables["event_length"]
    return variables | {"event_moment": moment}


def event_table(problem: Problem, rows: Samples, row: int, events: list[Event]) -> dict[str, Array]:
    """Return the variables of the arrested events of one sample, (events, ...) arrays."""
    interface = problem.interface
    found: dict[str, list[Any]] = {name: [] for name in event_variables(interface)}
    initial = rows.initial_stress[row].mean()
    for event in events:
        added = (event.after.slip - event.before.slip).reshape(interface.shape)
        inside, patch = largest_patch(np.maximum(added, 0.0), interface.spacings, EVENT_CORE)
        found["event_load"].append(event.before.load)
        found["event_stress"].append(initial + event.before.load * rows.load_profile.mean())
        found["event_position"].append(patch.centre if interface.is_plane else patch.centre[0])
        if interface.is_plane:
            found["event_extent"].append(patch.extents)
            found["event_area"].append(patch.area)
        else:
            found["event_length"].append(patch.extents[0])
        found["event_mean_slip"].append(added[inside].mean())
        moment = problem.solid.shear_modulus * float(added.sum()) * interface.cell
        found["event_moment"].append(moment)
    wide = [name for name, variable in event_variables(interface).items() if variable.dims[1:]]
    return {
        name: np.reshape(column, (-1, 2)) if name in wide else np.array(column, dtype=np.float64)
        for name, column in found.items()
    }


def listed(numbers: NDArray[np.int64], most: int = 5) -> str:
    """Return 'samples 0, 4 and 3 more'."""
    shown = ", ".join(map(str, numbers[:most]))
    more = f" and {numbers.size - most} more" if numbers.size > most else ""
    return f"sample{'s' * (numbers.size > 1)} {shown}{more}"


def make_program(
    problem: Problem, gap: float = 1e-6, prove_sliding: bool = False, every: int = 1
) -> LineProgram | PlaneProgram:
    """Return what finds the equilibria of a problem on its nodes, or on every second one."""
    if problem.interface.is_plane:
        return PlaneProgram(problem, gap, every)
    return LineProgram(problem, every, prove_sliding)


class Solver:
    """Solves samples of a problem; safe to call from several threads.

    Parameters
    ----------
    problem : Problem
    sensitivity, slip, discretization_error, prove_sliding, events, gap
        As of `Equilibrium`.
    """

    def __init__(
        self,
        problem: Problem,
        *,
        sensitivity: bool = False,
        slip: bool = False,
        discretization_error: bool = False,
        prove_sliding: bool = False,
        events: int = 0,
        gap: float = 1e-6,
    ) -> None:
        self.problem = problem
        self.program = make_program(problem, gap, prove_sliding)
        self.sensitivity, self.slip, self.events = sensitivity, slip, events
        self.coarse: LineProgram | PlaneProgram | None = None
        if discretization_error:
            _check_multiple_of_four(problem)
            self.coarse = make_program(problem, gap, every=2)

    def __call__(self, rows: Samples) -> dict[str, NDArray[Any]]:
        """Return the onset of each sample; see `Equilibrium`."""
        if self.coarse is None:
            self.problem.warn_if_coarse(rows, FINE, ROUGHLY)
        first, states = self.program.first(rows, self.slip)
        values = self._empty(rows)
        load, gap = np.empty((2, rows.samples))
        if first is not None:
            load[:], gap[:] = first.table[:, LOAD], first.table[:, GAP]
            values["critical_position"][:] = first.table[:, POSITION]
            values["sliding_position"][:] = first.table[:, POSITION]
            values["critical_patch_length"][:] = first.table[:, LENGTH]
            values["slip_patches"][:] = first.table[:, PATCHES]
            if self.slip:
                values["slip"] = first.slip
            if self.sensitivity:
                values["sensitivity"] = first.multiplier
        at_first = load.copy()
        certified, known = np.ones((2, rows.samples), dtype=np.bool_)
        for row, state in states.items():
            sample = self.program.sample_of(rows, row)
            try:
                path = follow(self.program, sample, state)
            except Exception as error:
                error.add_note(f"in sample {row} of the {rows.samples} that were solved together")
                raise
            load[row], known[row] = path.last.load, path.known
            if state is None:
                at_first[row] = path.first.load
                gap[row] = self._describe(values, row, sample, path.first)
                certified[row] = path.first.certified and not np.isnan(gap[row])
            self._describe_end(values, rows, row, sample, path)
        self._warn(gap, at_first, certified, known)
        values |= {
            "critical_load": load,
            "critical_stress": rows.mean_stress(load),
            "first_instability": rows.mean_stress(at_first),
            "certificate_gap": gap * rows.load_profile.mean(),
        }
        if self.problem.interface.is_plane:
            values["certified"] = certified
        if self.sensitivity:
            values["sensitivity"] *= rows.load_profile.mean()
            _warn_if_lost(values["sensitivity"])
        if self.coarse is not None:
            values["discretization_error"] = self._discretization_error(
                rows, values["first_instability"]
            )
        return values

    def _empty(self, rows: Samples) -> dict[str, NDArray[Any]]:
        """What is returned for each sample besides its loads, to be filled."""
        count, interface = rows.samples, self.problem.interface
        place = (count, 2) if interface.is_plane else (count,)
        values: dict[str, NDArray[Any]] = {
            "critical_position": np.empty(place),
            "sliding_position": np.empty(place),
            "slip_patches": np.empty(count, dtype=np.int64),
            "arrested_events": np.zeros(count, dtype=np.int64),
            "residual_reached": np.zeros(count, dtype=np.bool_),
        }
        if interface.is_plane:
            values["critical_patch_extent"] = np.empty(place)
            values["critical_patch_area"] = np.empty(count)
        else:
            values["critical_patch_length"] = np.empty(count)
        for name in ("slip", "sensitivity"):
            if getattr(self, name):
                values[name] = np.empty((count, *rows.shape))
        if self.events:
            for name, variable in event_variables(interface).items():
                components = (2,) * (len(variable.dims) - 1)
                values[name] = np.full((count, self.events, *components), np.nan)
        return values

    def _describe(
        self, values: dict[str, NDArray[Any]], row: int, sample: Sample, state: State
    ) -> float:
        """Write what is known of a first instability besides its load; returns the gap, Pa."""
        interface = self.problem.interface
        profile = sample.profile
        y = state.direction / max(dot(state.direction, profile, profile.size), 1e-300)
        _, patch = critical_patch(y.reshape(interface.shape), interface.spacings)
        values["slip_patches"][row] = patches_of(state.slip.reshape(interface.shape))
        if interface.is_plane:
            values["critical_position"][row] = patch.centre
            values["critical_patch_extent"][row] = patch.extents
            values["critical_patch_area"][row] = patch.area
        else:
            values["critical_position"][row] = patch.centre[0]
            values["critical_patch_length"][row] = patch.extents[0]
        if self.slip:
            values["slip"][row] = state.slip.reshape(interface.shape)
        if self.sensitivity:
            slope = _sensitivity(self.program, sample, state.slip, y)
            values["sensitivity"][row] = slope.reshape(interface.shape)
        return self.program.gap(sample, state, y)

    def _describe_end(
        self, values: dict[str, NDArray[Any]], rows: Samples, row: int, sample: Sample, path: Path
    ) -> None:
        """Write what happened after the first instability."""
        interface, last = self.problem.interface, path.last
        values["arrested_events"][row] = len(path.events)
        reached = residual_nodes(sample, last.slip, self.program.at_corner)
        values["residual_reached"][row] = reached.any()
        if last.direction.any():
            direction = last.direction.reshape(interface.shape)
            _, patch = critical_patch(direction, interface.spacings)
            centre = patch.centre if interface.is_plane else patch.centre[0]
            values["sliding_position"][row] = centre
        if self.events:
            table = event_table(self.problem, rows, row, path.events[: self.events])
            for name, column in table.items():
                values[name][row, : len(column)] = column

    def _discretization_error(self, rows: Samples, onset: Array) -> Array:
        """Size of the error of each onset that is due to the distance of the nodes, Pa.

        The same profiles are solved on every second node. The onset converges with the square of
        the spacing, so that the error is a third of the difference to a grid twice as coarse. Its
        sign is that of chance on random profiles: the root mean square of all is taken.
        """
        assert self.coarse is not None
        others = []
        for offset in itertools.product((0, 1), repeat=len(rows.shape)):
            nodes: Any = (..., *(slice(first, None, 2) for first in offset))
            part = Samples(*(given[nodes] for given in rows))
            others.append(part.mean_stress(first_instabilities(self.coarse, part)))
        error: Array = np.sqrt(np.mean([(other - onset) ** 2 for other in others], axis=0)) / 3.0
        percent = 100.0 * error / np.abs(onset)
        if np.any(percent > SHARE):
            warn_accuracy(
                "the distance of the nodes changes the first instability by an estimated"
                f" {np.sqrt(np.mean(percent**2)):.2g} % (root mean square of {onset.size} samples,"
                f" at most {percent.max():.2g} %); take more nodes"
            )
        return error

    def _warn(
        self, gap: Array, load: Array, certified: NDArray[np.bool_], known: NDArray[np.bool_]
    ) -> None:
        """Warn where the bounds are wide, or none, or where a path did not come to an end."""
        magnitude = np.maximum(np.abs(load), 1e-300)
        wide = np.flatnonzero(certified & ~(gap <= self.program.widest_gap * magnitude))
        if wide.size:
            warn_accuracy(
                f"the bounds of the first instability did not close to {self.program.widest_gap:g}"
                f" of it in {wide.size} of {gap.size} samples ({listed(wide)}): they hold, and are"
                f" up to {(gap / magnitude)[wide].max():.2g} of it apart; take more nodes"
            )
        free = np.flatnonzero(~certified)
        if free.size and self.problem.interface.is_plane:
            warn_accuracy(
                f"nodes reach their residual strength before the first instability in {free.size}"
                f" of {gap.size} samples ({listed(free)}): it was found by following equilibria,"
                f" to {(gap / magnitude)[free].max():.2g} of it, and has no certificate"
            )
        lost = np.flatnonzero(~known)
        if lost.size:
            warn_accuracy(
                f"a jump did not come to its end in {lost.size} of {gap.size} samples"
                f" ({listed(lost)}): their critical load is the last with a known equilibrium, a"
                " lower bound"
            )


def first_instabilities(program: LineProgram | PlaneProgram, rows: Samples) -> Array:
    """Return the loads of the first instabilities alone, tau_0, Pa."""
    first, states = program.first(rows, False)
    load = np.empty(rows.samples) if first is None else first.table[:, LOAD].copy()
    for row, state in states.items():
        if state is None:
            sample = program.sample_of(rows, row)
            found = program.next(sample, program.at_rest(sample))
            load[row] = (found if found.certified else follow(program, sample, found).first).load
    return load


def _check_multiple_of_four(problem: Problem) -> None:
    """Raise `InputError` if every second node is not an even number of nodes."""
    shape = problem.interface.shape
    if any(nodes % 4 for nodes in shape):
        given, enough = (" x ".join(map(str, n)) for n in (shape, [n + -n % 4 for n in shape]))
        raise InputError(
            f"interface.nodes: must be a multiple of four for discretization_error, got {given};"
            f" take {enough}"
        )


def _sensitivity(
    program: LineProgram | PlaneProgram, sample: Sample, slip: Array, y: Array
) -> Array:
    """Derivative of the load of an instability by the peak strengths, from its multiplier."""
    piece = present_pieces(sample, slip, program.at_corner).piece
    corners = steep_corners(sample, slip)
    if isinstance(program, LineProgram) and corners.size:
        return program.corner_sensitivity(sample, slip, piece, corners)
    # Of a piece that starts from share tau_p + (1 - share) tau_r; the share of the last is 0.
    return y * np.where(sample.critical > 0.0, sample.pieces.starts[piece], 1.0)


def _warn_if_lost(sensitivity: Array) -> None:
    """Warn where a first instability has no derivative."""
    count = len(sensitivity)
    lost = int(np.isnan(sensitivity.reshape(count, -1)).any(axis=1).sum())
    if lost:
        warn_accuracy(
            f"several nodes begin to weaken more steeply at once in {lost} of {count}"
            " samples: their first instability has no derivative, sensitivity is NaN"
        )
