"""The solver of the equilibrium method on planes: samples in, onset out, one after the other."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.equilibrium import discretization
from stiction.equilibrium.follow_plane import PlanePath, first_instability, follow_plane
from stiction.equilibrium.least_equilibrium import AT_RESIDUAL, SLIDING, PlaneSample
from stiction.equilibrium.plane_onset import Plane
from stiction.equilibrium.plane_patches import critical_patch, labelled_patches
from stiction.errors import warn_accuracy
from stiction.problem import Problem, Sample

FINE = 8.0
"""Nodes in the nucleation length, along x and along y, below which there is a warning."""
ROUGHLY = (
    "single onsets are off by 0.5 % at 6 nodes along x and 4 along y for a correlation length of a"
    " quarter of it, by 0.15 % at 9 and 6; Equilibrium(discretization_error=True) estimates it"
)
OPEN = 1.01
"""Times the gap asked for (round-off) from which on bounds count as not closed."""


def plane_of(problem: Problem, wavenumbers: Literal["spectral", "lattice"] = "spectral") -> Plane:
    """Geometry and elasticity of a problem on a plane."""
    x, y = problem.interface.lengths
    solid = problem.solid
    return Plane((x, y), solid.shear_modulus, solid.poisson_ratio, wavenumbers)


def sample_of(rows: Sample, row: int) -> PlaneSample:
    """One sample as the kernels take it."""
    one = rows.one(row)
    excess, residual = one.strength - one.initial_stress, one.residual_strength - one.initial_stress
    critical = (one.strength - one.residual_strength) / one.weakening_rate
    return PlaneSample(excess, residual, one.load_profile, one.weakening_rate, critical)


def residual_nodes(sample: PlaneSample, slip: Array) -> NDArray[np.bool_]:
    """Nodes that have reached their residual strength; those of constant strength are none."""
    reached: NDArray[np.bool_] = (slip >= AT_RESIDUAL * sample.critical) & (sample.critical > 0.0)
    return reached


def listed(numbers: NDArray[np.int64], most: int = 5) -> str:
    """'samples 0, 4 and 3 more'."""
    shown = ", ".join(map(str, numbers[:most]))
    more = f" and {numbers.size - most} more" if numbers.size > most else ""
    return f"sample{'s' * (numbers.size > 1)} {shown}{more}"


def warn_if_coarse(problem: Problem, rate: float) -> None:
    """Warn where few nodes lie in the nucleation length of a weakening rate (Pa/m)."""
    across = {"x": problem.effective_modulus, "y": problem.solid.shear_modulus}
    unit = problem.nucleation_lengths(rate)[0] / problem.effective_modulus
    spacings = dict(zip("xy", problem.interface.spacings, strict=True))
    nodes = {dim: unit * across[dim] / spacings[dim] for dim in "xy"}
    coarse = " and ".join(
        f"{nodes[dim]:.1f} nodes along {dim}" for dim in "xy" if nodes[dim] < FINE
    )
    if coarse:
        warn_accuracy(f"the nucleation length spans {coarse} (better {FINE:g} or more): {ROUGHLY}")


class PlaneSolver:
    """Solves samples of a problem on a plane; safe to call from several threads.

    Parameters
    ----------
    problem : Problem
    sensitivity, slip, discretization_error : bool
        Whether to return these as well.
    gap : float
        Relative distance of the bounds at which to stop.
    wavenumbers : {"spectral", "lattice"}
    """

    def __init__(
        self,
        problem: Problem,
        sensitivity: bool = False,
        slip: bool = False,
        discretization_error: bool = False,
        gap: float = 1e-6,
        wavenumbers: Literal["spectral", "lattice"] = "spectral",
    ) -> None:
        self.problem = problem
        self.plane = plane_of(problem, wavenumbers)
        self.sensitivity, self.slip = sensitivity, slip
        self.gap = gap
        self.discretization_error = discretization_error
        if discretization_error:
            discretization.check(problem)

    def __call__(self, rows: Sample) -> dict[str, NDArray[Any]]:
        """The onset of each sample; see `Equilibrium` for what comes back."""
        count, shape = rows.samples, rows.shape
        if not self.discretization_error:
            warn_if_coarse(self.problem, rows.steepest_rate)
        load, first, gap = np.empty((3, count))
        certified, undecided = np.empty((2, count), dtype=np.bool_)
        values: dict[str, NDArray[Any]] = {
            "critical_position": np.empty((count, 2)),
            "slip_patches": np.empty(count, dtype=np.int64),
            "critical_patch_extent": np.empty((count, 2)),
            "critical_patch_area": np.empty(count),
            "arrested_events": np.empty(count, dtype=np.int64),
            "residual_reached": np.empty(count, dtype=np.bool_),
            "sliding_position": np.empty((count, 2)),
        }
        if self.slip:
            values["slip"] = np.empty((count, *shape))
        if self.sensitivity:
            values["sensitivity"] = np.empty((count, *shape))
        for row in range(count):
            sample = sample_of(rows, row)
            try:
                path = follow_plane(self.plane, sample, self.gap)
            except Exception as error:
                error.add_note(f"in sample {row} of the {count} that were solved together")
                raise
            load[row], first[row], gap[row] = path.load, path.lower, path.upper - path.lower
            certified[row], undecided[row] = path.certified, path.outcome != SLIDING
            self._describe(values, row, sample, path)
        self._warn(gap, first, certified, undecided)
        found: dict[str, NDArray[Any]] = {
            "critical_load": load,
            "critical_stress": rows.mean_stress(load),
            "first_instability": rows.mean_stress(first),
            "certificate_gap": gap * rows.load_profile.mean(),
            "certified": certified,
        }
        if self.discretization_error:
            coarse = [self._coarse_onset(rows, a, b) for a in (0, 1) for b in (0, 1)]
            found["discretization_error"] = discretization.estimate(
                found["first_instability"], coarse
            )
        return found | values

    def _describe(
        self, values: dict[str, NDArray[Any]], row: int, sample: PlaneSample, path: PlanePath
    ) -> None:
        """Write what is known of one sample beside its loads."""
        spacings = self.problem.interface.spacings
        _, patch = critical_patch(path.direction, spacings)
        values["critical_position"][row] = patch.centre
        values["critical_patch_extent"][row] = patch.extents
        values["critical_patch_area"][row] = patch.area
        values["slip_patches"][row] = labelled_patches(path.slip > 0.0)[1]
        values["arrested_events"][row] = len(path.events)
        values["residual_reached"][row] = residual_nodes(sample, path.sliding_slip).any()
        values["sliding_position"][row] = critical_patch(path.sliding_direction, spacings)[1].centre
        if self.slip:
            values["slip"][row] = path.slip
        if self.sensitivity:  # where the strength is tau_r, it is so whatever tau_p
            own = np.where(residual_nodes(sample, path.slip), 0.0, path.direction)
            values["sensitivity"][row] = own * sample.profile.mean()

    def _coarse_onset(self, rows: Sample, a: int, b: int) -> Array:
        """First instability (mean stress, Pa) on the nodes a, a + 2, ... and b, b + 2, ..."""
        half = Sample(*(given[..., a::2, b::2] for given in rows))
        loads = [
            first_instability(self.plane, sample_of(half, row), self.gap)
            for row in range(half.samples)
        ]
        return half.mean_stress(np.array(loads))

    def _warn(
        self,
        gap: Array,
        load: Array,
        certified: NDArray[np.bool_],
        undecided: NDArray[np.bool_],
    ) -> None:
        """Say where the bounds are wide, or none, or where it did not come to an end."""
        magnitude = np.maximum(np.abs(load), 1e-300)
        wide = np.flatnonzero(certified & ~(gap <= OPEN * self.gap * magnitude))
        if wide.size:
            spectral = self.plane.wavenumbers == "spectral"
            advice = "take more nodes" + ", or wavenumbers='lattice'" * spectral
            warn_accuracy(
                f"the bounds of the first instability did not close to {self.gap:g} of it in"
                f" {wide.size} of {gap.size} samples ({listed(wide)}): they hold, and are up to"
                f" {(gap / magnitude)[wide].max():.2g} of it apart; {advice}"
            )
        free = np.flatnonzero(~certified)
        if free.size:
            warn_accuracy(
                f"nodes reach their residual strength before the first instability in {free.size}"
                f" of {gap.size} samples ({listed(free)}): it was found by following equilibria,"
                f" to {(gap / magnitude)[free].max():.2g} of it, and has no certificate"
            )
        lost = np.flatnonzero(undecided)
        if lost.size:
            warn_accuracy(
                f"a jump did not come to its end in {lost.size} of {gap.size} samples"
                f" ({listed(lost)}): their critical load is the last with a known equilibrium, a"
                " lower bound"
            )
