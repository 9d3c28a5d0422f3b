"""The solver of the equilibrium method: samples in, onsets out, on lines and planes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy, warn_of_samples
from stiction.methods.equilibrium.dense.program import DenseProgram
from stiction.methods.equilibrium.events import ArrestedEvent, event_table, relief_of
from stiction.methods.equilibrium.patches import Mask, critical_patch, patches_of
from stiction.methods.equilibrium.sample import (
    EquilibriumState,
    Program,
    StaticSample,
    make_sample,
    multiplier_of,
    present_pieces,
    refused,
    residual_nodes,
    row_of,
    sample_of,
)
from stiction.methods.equilibrium.transforms.plane import PlaneProgram
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample

MIN_NODES_IN_NUCLEATION_LENGTH = 8.0
"""Below, there is a warning with the expected error."""
ERRORS_OF_COARSE_GRIDS = {  # by the number of dimensions
    1: "single onsets are off by 0.4 % at 9 nodes and 3 % at 4 if the correlation length is a"
    " quarter of it, by 3 and 9 % if it is a tenth",
    2: "single onsets are off by 0.15 % at 9 nodes along x and 6 along y, by 0.5 % at 6 and 4",
}
MIN_PEAK_HEIGHT = 0.02
"""Height of the peak above the mean residual strength, as a share of the fall of strength, below
which the peak is hardly more than the stress of sliding."""
STRENGTH_STEP = 1e-7
"""Rise of the strength of a node for a difference quotient, as a share of the mean."""


class SamplePath(NamedTuple):
    """Course of one sample until it slides.

    `first` is the first instability, `last` the last equilibrium, `known` is false where a jump
    or a path did not come to its end: `last` is then a lower bound. `peak` is the largest mean
    stress on the way, over the mean of the load profile. `arrival` (s) is when the front of the
    event that slides arrived at each node, with inertia.
    """

    first: EquilibriumState
    last: EquilibriumState
    peak: float
    events: list[ArrestedEvent]
    known: bool
    arrival: Array | None


def follow_to_sliding(program: Program, sample: StaticSample) -> SamplePath:
    """Follow a sample from rest to global sliding.

    Arrest is overdamped: the patch stops at the least equilibrium of the same load. Inertia may
    carry it through.
    """
    state = program.next(sample)
    first: EquilibriumState | None = None
    events: list[ArrestedEvent] = []
    known, peak, arrival = state.known, state.highest, None
    while state.unstable:
        jump = program.jump(sample, state)
        if jump.counts:
            first = first or state
            if not jump.arrested:
                known, arrival = jump.known, jump.arrival
                break
            events.append(ArrestedEvent(state, jump.state))
        state = program.next(sample, jump.state)
        known, peak = state.known, max(peak, state.highest)
    return SamplePath(first or state, state, peak, events, known, arrival)


def make_program(problem: Problem, gap: float = 1e-6) -> Program:
    """Return the programme that finds equilibria of a problem, or raise an `InputError`."""
    if reasons := refused(problem.friction):
        raise InputError(reasons)
    if problem.interface.breakable is not None:
        raise InputError("interface.extent: is taken by st.Rupture() between half-spaces")
    return PlaneProgram(problem, gap) if problem.interface.is_plane else DenseProgram(problem)


def warn_of_signs(problem: Problem) -> None:
    """Warn where it is not proved that equilibria are the least ones."""
    if problem.specimen is not None and problem.blocks.positive:
        warn_accuracy(
            "the stiffness of these blocks has positive entries off its diagonal, up to"
            f" {problem.blocks.positive:.1g} of the diagonal: that equilibria are the least ones,"
            " and bounds rigorous, is then not proved (docs/specimens.md)"
        )


class OnsetSolver:
    """Solves samples of a problem with options of `Equilibrium`; safe in several threads."""

    def __init__(self, problem: Problem, options: Any, program: Program) -> None:
        self.problem, self.options, self.program = problem, options, program

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """Return the onset of each sample; see `Equilibrium`."""
        warn_of_signs(self.problem)
        self.problem.warn_if_coarse(
            rows,
            MIN_NODES_IN_NUCLEATION_LENGTH,
            ERRORS_OF_COARSE_GRIDS[len(self.problem.interface.shape)],
        )
        samples, table, flags = sample_of(rows, self.program.pieces), [], []
        for row in range(rows.samples):
            sample = row_of(samples, row)
            try:
                path = follow_to_sliding(self.program, sample)
            except Exception as error:
                error.add_note(
                    f"in sample {row} of the {rows.samples} that were solved together"
                )
                raise
            flags.append((path.known, path.first.certified, path.first.stopped))
            table.append(self._values(rows, row, sample, path))
        values = {name: np.array([row[name] for row in table]) for name in table[0]}
        values["critical_stress"] = rows.mean_stress(values["critical_stress"])
        values["first_instability"] = rows.mean_stress(values["first_instability"])
        values["certificate_gap"] *= rows.load_profile.mean()
        self._warn(rows, values, *np.array(flags).T)
        return values

    def _values(
        self, rows: Sample, row: int, sample: StaticSample, path: SamplePath
    ) -> dict[str, Any]:
        """Return the variables of one sample, the first instability as a load."""
        interface, shape = self.problem.interface, rows.strength[row].shape
        first, last = path.first, path.last
        sliding_patch = patch = critical_patch(multiplier_of(sample, first), interface)
        # On lines the multiplier is known of a programme, which passes no corner.
        straight = last is first and first.multiplier is not None and not interface.is_plane
        if last is not first and last.direction.any():
            sliding_patch = critical_patch(last.direction, interface)
        values: dict[str, Any] = {
            "critical_load": last.load,
            "critical_stress": path.peak,
            "first_instability": first.load - relief_of(self.problem, first.slip),
            "certificate_gap": first.gap,
            "critical_position": patch.centre if interface.is_plane else patch.centre[0],
            "sliding_position": (
                sliding_patch.centre if interface.is_plane else sliding_patch.centre[0]
            ),
            "slip_patches": patches_of(first.slip, interface),
            "arrested_events": len(path.events),
            "residual_reached": not straight and bool(residual_nodes(sample, last.slip).any()),
        }
        if interface.is_plane:
            values["critical_patch_extent"] = patch.extents
            values["critical_patch_area"] = patch.area
            values["certified"] = first.certified
        else:
            values["critical_patch_length"] = patch.area
        stable = path.known and not first.unstable  # behind a stiff machine
        if stable:
            of_patch = ("first_instability", "critical_position", "critical_patch_length")
            values |= dict.fromkeys(of_patch, np.nan)
        if self.options.slip:
            values["slip"] = first.slip.reshape(shape)
        if self.options.sensitivity:
            derivative = np.full(first.slip.size, np.nan)
            if not stable:
                derivative = _sensitivity(self.problem, self.program, sample, first)
            values["sensitivity"] = derivative.reshape(shape) * rows.load_profile.mean()
        if most := self.options.events:
            events = event_table(self.problem, rows, row, path.events[:most])
            for name, column in events.items():
                values[name] = np.full((most, *column.shape[1:]), np.nan)
                values[name][: len(column)] = column
        return values

    def _warn(
        self,
        rows: Sample,
        values: dict[str, Array],
        known: Mask,
        certified: Mask,
        stopped: Mask,
    ) -> None:
        """Warn of what is not as it mostly is: values are of all samples, stresses in Pa."""
        first, unproved = values["first_instability"], ~certified
        share = values["certificate_gap"] / np.maximum(np.abs(first), 1e-300)
        warn_of_samples(
            f"the bounds of the first instability did not close to {self.program.widest_gap:g} of"
            " it in {samples}: they hold, and are up to {worst:.2g} of it apart; take more nodes",
            ~unproved & ~(share <= self.program.widest_gap),
            share,
        )
        if self.problem.interface.is_plane:
            warn_of_samples(
                "nodes reach a corner of the law or their residual strength before the first"
                " instability in {samples}: it was found by following equilibria, to {worst:.2g}"
                " of it, and has no certificate",
                unproved,
                share,
            )
        warn_of_samples(
            "no patch becomes unstable in {samples}: behind so stiff a machine their interface"
            " slides stably, and first_instability is NaN",
            np.isnan(first),
        )
        warn_of_samples(
            "a jump was not followed to its end in {samples}: their critical load is the last with"
            " a known equilibrium, a lower bound",
            ~known,
        )
        warn_of_samples(
            "a node that slipped stops before the first instability in {samples}: its equilibria"
            " are no longer the least ones, so that nothing bounds it from above, and"
            " certificate_gap is NaN",
            stopped & np.isfinite(first),
        )
        residual = rows.residual_strength.mean(axis=rows.axes)
        falls = (rows.strength - rows.residual_strength).reshape(rows.samples, -1)
        above = values["critical_stress"] - residual
        above /= np.maximum(np.median(falls, axis=1), 1e-300)
        warn_of_samples(
            "all but the last nodes are at their residual strength before the peak in {samples}:"
            " static friction is then the mean residual strength, to {worst:.2g} of what strength"
            " falls by, and depends on little else",
            values["residual_reached"] & (above < MIN_PEAK_HEIGHT),
            above,
        )
        if self.options.sensitivity:
            unknown = np.isnan(values["sensitivity"]).reshape(rows.samples, -1).any(axis=1)
            warn_of_samples(
                "the first instability has no known derivative in {samples}, so sensitivity is NaN:"
                " nodes pass a corner from which their law falls more steeply, or the turning point"
                " was not resolved",
                np.isfinite(first) & unknown,
            )


def _sensitivity(
    problem: Problem, program: Program, sample: StaticSample, state: EquilibriumState
) -> Array:
    """Derivative of the stress of an instability by the peak strengths.

    NaN where a node passed a corner beyond which it weakens more steeply.
    """
    pieces = sample.pieces
    if state.stopped:
        return _quotients(problem, program, sample, state)
    if pieces.steepens and not state.certified:
        return np.full(state.slip.size, np.nan)
    # A piece starts from share tau_p + (1 - share) tau_r; the share of the last piece is 0.
    share = pieces.starts[present_pieces(sample, state.slip).piece]
    return program.gradient(sample, state) * np.where(sample.critical > 0.0, share, 1.0)


def _quotients(
    problem: Problem, program: Program, sample: StaticSample, first: EquilibriumState
) -> Array:
    """Derivative of the stress of a first instability, node by node: paths are straight."""
    stress_before = first.load - relief_of(problem, first.slip)
    step = STRENGTH_STEP * float(np.abs(sample.excess).mean())
    derivative = np.empty(sample.excess.size)
    for node in range(derivative.size):
        excess, residual = sample.excess.copy(), sample.residual.copy()
        excess[node] += step
        residual[node] += step * (sample.critical[node] == 0.0)  # its strength is constant
        raised = make_sample(excess, residual, sample.profile, sample.rate, sample.pieces)
        state = program.next(raised)
        derivative[node] = (state.load - relief_of(problem, state.slip) - stress_before) / step
    return derivative
