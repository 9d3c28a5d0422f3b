"""Likelihood of measured peaks, and of where slip began, as a function of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.errors import InputError, warn_accuracy
from stiction.inference.affine import Affine, find_affine, not_affine
from stiction.inference.density import Densities, log_likelihoods, tabulate
from stiction.inference.onset_table import OnsetTable, make_axes, simulate, thetas_of
from stiction.inference.positions import position_table
from stiction.inference.prior import Prior
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.reliability.limit_state import LimitState

BATCHES = 8
"""Parts of the sample, each left out once, by which the Monte Carlo error is estimated."""
SAMPLES = {"local_criterion": 2000, "equilibrium": 500}
FEW = 100


@dataclass(frozen=True, eq=False)
class Specimen:
    """What is simulated of one kind of specimen.

    Attributes
    ----------
    length : float or None
        m; None for the problem's own interface.
    table : OnsetTable
    densities : Densities
    """

    length: float | None
    table: OnsetTable
    densities: Densities


@dataclass(frozen=True, eq=False)
class Model:
    """All that does not depend on the data: made once, used for any number of data sets.

    Attributes
    ----------
    prior : Prior
    method
    affine : Affine
    error : float
        Standard deviation of the load cell, in the unit of the peaks.
    specimens : tuple of Specimen
    low, high : (parameters,) arrays
        Corners, as u, between which it is simulated.
    """

    prior: Prior
    method: Any
    affine: Affine
    error: float
    specimens: tuple[Specimen, ...]
    low: Array
    high: Array

    def log_densities(
        self,
        number: int,
        theta: Array,
        peaks: Array,
        densities: Densities | None = None,
        floor: float = -np.inf,
    ) -> Array:
        """Of peaks of specimen `number` at points, (points, peaks)."""
        own = self.specimens[number]
        used = own.densities if densities is None else densities
        index, weight = own.table.corners(theta)
        shift, stretch = self.affine.of(theta)
        out = np.empty((theta.shape[0], peaks.size))
        log_likelihoods(
            index,
            weight,
            np.ascontiguousarray(shift),
            np.ascontiguousarray(stretch),
            self.error,
            used,
            np.ascontiguousarray(peaks),
            floor,
            out,
        )
        return out

    def without(self, batch: int) -> list[Densities]:
        """Densities of each specimen from all samples but those of one batch."""
        found = []
        for own in self.specimens:
            kept = np.arange(own.table.peaks.shape[1]) % BATCHES != batch
            found.append(tabulate(own.table.peaks[:, kept], own.densities.bound))
        return found


def make_model(
    prior: Prior,
    *,
    method: Any,
    lengths: Sequence[float | None],
    error: float,
    samples: int | None,
    seed: int,
    variable: str,
    meter: Meter,
    low: Array | None = None,
    high: Array | None = None,
    scaling: bool = True,
) -> Model:
    """Simulate what the likelihood needs.

    Parameters
    ----------
    prior : Prior
    method : Method
    lengths : sequence
        Of the specimens, m; None for the problem's own.
    error : float
    samples : int, optional
    seed : int
    variable : {"critical_stress", "friction_coefficient"}
    meter : Meter
    low, high : (parameters,) arrays, optional
        Corners (as u) of the part of the prior that matters; all of it if left out.
    scaling : bool
        Use affine scaling where it holds; otherwise simulate every parameter.
    """
    low = np.zeros(prior.dimension) if low is None else low
    high = np.ones(prior.dimension) if high is None else high
    affine = find_affine(prior, method)
    if variable == "friction_coefficient" and affine.keys:
        affine = _per_pressure(prior, affine)
    if not scaling:
        affine = not_affine(affine.reference, "positions depend on more than shift and stretch")
    axes = make_axes(prior, affine, low, high)
    thetas = thetas_of(axes, affine.reference)
    count = SAMPLES.get(method.type, FEW) if samples is None else samples
    # Where positions count, the pairs of peak and position have to be the method's own.
    control = scaling and method.type != "local_criterion" and not local_refused(prior)
    everywhere = count if not control else max(count, SAMPLES["local_criterion"])
    meter.stage("simulated onsets", len(thetas) * len(lengths) * (count + control * everywhere))
    specimens = []
    for number, length in enumerate(lengths):
        options: dict[str, Any] = {
            "length": length,
            "first": number * 2**20,
            "seed": seed,
            "variable": variable,
            "meter": meter,
        }
        peaks, places = simulate(prior, thetas, method=method, samples=count, **options)
        if control:
            local, places = simulate(
                prior, thetas, method=LocalCriterion(), samples=everywhere, **options
            )
            peaks = controlled(peaks, local)
        table = OnsetTable(axes, peaks, places)
        densities = tabulate(peaks, bounds_of(prior, thetas, method, variable))
        specimens.append(Specimen(length, table, densities))
    return Model(prior, method, affine, error, tuple(specimens), low, high)


def bounds_of(prior: Prior, thetas: Array, method: Any, variable: str) -> Array:
    """Least possible peaks at some points, (points,); -inf where none is known."""
    if variable == "friction_coefficient" and "normal_pressure" in prior.random.names:
        return np.full(len(thetas), -np.inf)
    found = np.empty(len(thetas))
    for row, theta in enumerate(thetas):
        problem, random = prior.at(theta)
        found[row] = LimitState(problem, random, method).bounds[0]
    if variable == "friction_coefficient":
        found /= float(np.mean(prior.problem.load.normal_pressure))
    return found


def controlled(peaks: Array, local: Array) -> Array:
    """Many onsets by the local criterion, (points, many), moved to where a few by the method are.

    The same samples by both methods differ little, and so do their quantiles: the difference of
    the quantiles of the few is added to the many.
    """
    result = np.empty_like(local)
    for row, (few, many) in enumerate(zip(peaks, local, strict=True)):
        known = np.sort(many[: few.size])
        result[row] = many + np.interp(many, known, np.sort(few) - known)
    return result


def local_refused(prior: Prior) -> str | None:
    """Why the local criterion cannot be a first stage, at the middle of the prior."""
    problem, random = prior.at(prior.theta(np.full((1, prior.dimension), 0.5))[0])
    return LimitState(problem, random, LocalCriterion()).no_single_length()


def _per_pressure(prior: Prior, affine: Affine) -> Affine:
    """Shift in units of the friction coefficient."""
    pressure = prior.problem.load.normal_pressure
    if "normal_pressure" in prior.random.names or pressure is None:
        return not_affine(affine.reference, "the normal pressure is random")
    return replace(affine, shifts=affine.shifts / float(np.mean(pressure)))


@dataclass(frozen=True, eq=False)
class Likelihood:
    """A model and data.

    Attributes
    ----------
    model : Model
    peaks : tuple of arrays
        Of each specimen.
    position_tables : tuple of arrays or None
        (nodes, peaks) logarithms of the density of the position given the peak, or None.
    """

    model: Model
    peaks: tuple[Array, ...]
    position_tables: tuple[Array | None, ...]

    def each(self, u: Array, floor: float = -np.inf) -> Array:
        """Logarithm of the likelihood of each test at points u (points, parameters)."""
        theta = self.model.prior.theta(u)
        parts = []
        for number, peaks in enumerate(self.peaks):
            part = self.model.log_densities(number, theta, peaks, floor=floor)
            places = self.position_tables[number]
            if places is not None:
                index, weight = self.model.specimens[number].table.corners(theta)
                part += np.einsum("pc,pcj->pj", weight, places[index])
            parts.append(part)
        return np.concatenate(parts, axis=1)

    def __call__(self, u: Array, floor: float = -np.inf) -> Array:
        """Logarithm of the likelihood at points u (points, parameters).

        -inf outside the prior, and, for speed, where it is below `floor`.
        """
        if len(self.peaks) > 1 or self.position_tables[0] is not None:
            floor = -np.inf  # other parts may make up for it
        inside = np.all((u >= self.model.low) & (u <= self.model.high), axis=1)
        result = np.full(u.shape[0], -np.inf)
        if inside.any():
            result[inside] = self.each(u[inside], floor).sum(axis=1)
        return result

    def of_peaks(self, u: Array, *, without: int | None = None) -> Array:
        """Of the peaks alone; `without` a batch of the simulated samples."""
        theta = self.model.prior.theta(u)
        result = np.zeros(u.shape[0])
        densities = None if without is None else self.model.without(without)
        for number, peaks in enumerate(self.peaks):
            own = None if densities is None else densities[number]
            result += self.model.log_densities(number, theta, peaks, own).sum(axis=1)
        return result


def varies(problem: Problem) -> bool:
    """Whether a load or friction profile makes one place differ from another."""
    load, friction = problem.load, problem.friction
    parts = [load.profile, load.initial_stress, friction.residual_strength]
    parts += [friction.residual_ratio, friction.scale[1]]
    return any(part is not None and np.ptp(part) > 0.0 for part in parts)


def make_likelihood(
    model: Model,
    peaks: Sequence[Array],
    positions: Sequence[Array | None],
    *,
    quiet: bool = False,
) -> Likelihood:
    """Join data to a model; positions that say nothing are left out, with a warning.

    Raises
    ------
    InputError
        If positions were seen on a plane.
    """
    tables: list[Array | None] = []
    prior = model.prior
    alike = not varies(prior.problem)
    for own, specimen, seen in zip(peaks, model.specimens, positions, strict=True):
        if seen is None or alike:
            tables.append(None)
            continue
        if prior.problem.interface.is_plane:
            raise InputError("positions: can be used on a line only; leave them out on a plane")
        length = specimen.length or prior.problem.interface.extent
        tables.append(position_table(specimen.table, length, own, seen, model.error))
    if alike and not quiet and any(seen is not None for seen in positions):
        warn_accuracy(
            "positions: say nothing here, and are not used: load and friction are the same"
            " everywhere, so slip begins anywhere with the same probability whatever the parameters"
        )
    return Likelihood(model, tuple(peaks), tuple(tables))
