"""Likelihood of measured peaks as a function of the parameters."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, no_single_length
from stiction.inference.density import Densities, log_likelihoods, tabulate, to_v
from stiction.inference.onset_table import (
    Axis,
    corners,
    experiments_at,
    make_axes,
    nodes_of,
    simulate,
)
from stiction.inference.prior import Prior
from stiction.inference.scaling import Scaling, find_scaling
from stiction.progress import SILENT, Meter

SAMPLES = {"local_criterion": 2000, "equilibrium": 500}
FEW = 100
ALIKE = 0.8
"""Correlation of the onsets by two methods above which one helps the other."""
SPECIMEN = 2**20
"""Samples of a specimen of another length begin at multiples of this."""
TRIED = 200
"""Peaks that are predicted at each corner of the prior."""
BEYOND = 2.0
"""Spreads beyond the extremes of these at which a peak is out of reach."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Simulated onsets, and the likelihood of measured peaks that follows from them.

    Onsets and densities are in the unit of the peaks, one of each for every kind of specimen.
    """

    prior: Prior
    method: Any
    scaling: Scaling
    axes: tuple[Axis, ...]  # of the parameters that are simulated
    error: float  # standard deviation of the load cell
    onsets: tuple[Array, ...]  # (nodes, samples): of the same samples at every node
    densities: tuple[Densities, ...]
    samples: float  # independent ones that these are worth
    low: Array  # corners, as u, between which onsets are simulated
    high: Array
    peaks: tuple[Array, ...] = ()

    def of(self, peaks: Sequence[Array]) -> Self:
        """Return the same of other peaks."""
        return replace(self, peaks=tuple(peaks))

    def log_densities(self, number: int, theta: Array, peaks: Array) -> Array:
        """Return logarithms of the density of peaks of specimen `number`, (points, peaks)."""
        index, weight = corners(self.axes, theta)
        shift, stretch = map(np.ascontiguousarray, self.scaling.of(theta))
        own, out = np.ascontiguousarray(peaks), np.empty((theta.shape[0], peaks.size))
        densities = self.densities[number]
        log_likelihoods(index, weight, shift, stretch, self.error, densities, own, out)
        return out

    def parts(self, u: Array) -> Array:
        """Return logarithms of the likelihood of each test at points u, (points, tests)."""
        theta = self.prior.theta(u)
        parts = [self.log_densities(i, theta, peaks) for i, peaks in enumerate(self.peaks)]
        return np.concatenate(parts, axis=1)

    def __call__(self, u: Array) -> Array:
        """Return the logarithm of the likelihood at points u (points, parameters).

        -inf outside the box that was simulated.
        """
        inside = np.all((u >= self.low) & (u <= self.high), axis=1)
        result = np.full(u.shape[0], -np.inf)
        if inside.any():
            result[inside] = self.parts(u[inside]).sum(axis=1)
        return result

    def predicted(self, number: int, u: Array, seed: int) -> Array:
        """Draw a peak of specimen `number` at each of some points u (points, parameters)."""
        rng = np.random.default_rng([seed, 1])
        theta = self.prior.theta(u)
        shift, stretch = self.scaling.of(theta)
        onsets, known = self.onsets[number], self.densities[number]
        index, weight = corners(self.axes, theta)
        corner = (weight.cumsum(axis=1) < rng.random((u.shape[0], 1))).sum(axis=1)
        node = index[np.arange(u.shape[0]), np.minimum(corner, index.shape[1] - 1)]
        sample = rng.integers(onsets.shape[1], size=u.shape[0])
        z = (to_v(onsets, known.bound)[node, sample] - known.mean[node]) / known.spread[node]

        def between(values: Array) -> Array:
            found: Array = np.einsum("pc,pc->p", weight, values[index])
            return found

        onset = between(known.mean) + between(known.spread) * z
        if np.isfinite(known.bound).all():
            onset = between(known.bound) + np.exp(onset)
        return shift + stretch * onset + self.error * rng.standard_normal(u.shape[0])

    def refusals(self) -> list[str]:
        """Return messages on peaks that no parameters in the prior can produce."""
        texts = []
        ends = np.array(list(itertools.product(*zip(self.low, self.high, strict=True))))
        for number, peaks in enumerate(self.peaks):
            found = self.predicted(number, np.repeat(ends, TRIED, axis=0), 0)
            rows = found.reshape(-1, TRIED)
            room = BEYOND * rows.std(axis=1)
            least, most = rows.min(axis=1) - room, rows.max(axis=1) + room
            low, high = float(least.min()), float(most.max())
            far = (peaks < low) | (peaks > high)
            places = [
                ", ".join(
                    f"{n} = {v:.6g}" for n, v in zip(self.prior.names, point, strict=True)
                )
                for point in self.prior.theta(ends[[least.argmin(), most.argmax()]])
            ]
            for value in peaks[far][:1]:
                side = "below" if value < low else "above"
                texts.append(
                    f"peaks: {far.sum()} of {far.size} are out of reach, such as {value:g}, which"
                    f" lies {side} all that the prior can produce, {low:g} to {high:g} (the lowest"
                    f" come from {places[0]}, the highest come from {places[1]}); widen the prior,"
                    " check the unit, or leave out tests of another kind of specimen"
                )
        return texts


def make_likelihood(
    prior: Prior,
    low: Array | None = None,
    high: Array | None = None,
    *,
    method: Any,
    lengths: Sequence[float | None],
    error: float,
    samples: int | None,
    seed: int,
    variable: str,
    meter: Meter = SILENT,
) -> Likelihood:
    """Simulate the onsets that the likelihood needs.

    `lengths` are those of the specimens, m, None for the problem's own; `variable` is the name
    of the peaks among the results, with the standard `error` of the load cell. `low` and
    `high` are corners, as u, of the part of the prior that matters; all of it if left out.
    """
    low = np.zeros(prior.dimension) if low is None else low
    high = np.ones(prior.dimension) if high is None else high
    scaling = find_scaling(prior, method, variable)
    axes = make_axes(prior, scaling, low, high)
    thetas = nodes_of(axes, scaling.reference)
    count = samples or SAMPLES.get(method.type, FEW)
    meter.stage("simulated onsets", len(thetas) * len(lengths) * count)
    guided = method.type != "local_criterion" and not no_single_length(*prior.at(prior.middle))
    worth, onsets, densities = float(count), [], []
    for number, length in enumerate(lengths):
        experiments = experiments_at(prior, thetas, method, length)
        for end in (experiments[0], experiments[-1]):
            end.random.warn_if_inaccurate(end.problem.interface)
        options: Any = {"first": number * SPECIMEN, "seed": seed, "variable": variable}
        found = simulate(experiments, samples=count, meter=meter, **options)
        if guided:
            others = [own.by(LocalCriterion()) for own in experiments]
            local = simulate(others, samples=max(count, SAMPLES["local_criterion"]), **options)
            found, worth = moved(found, local)
        bound = np.array([_least_peak(own, variable) for own in experiments])
        onsets.append(found)
        densities.append(tabulate(found, bound))
    return Likelihood(
        prior, method, scaling, axes, error, tuple(onsets), tuple(densities), worth, low,
        high,
    )  # fmt: skip


def moved(few: Array, many: Array) -> tuple[Array, float]:
    """Move many onsets by the local criterion, (points, many), to those of a few by the method.

    The same samples by both methods differ little, and so do their quantiles: the difference of
    the quantiles of the few is added to the many. The few are returned if the methods differ much.
    The number is that of independent samples by the method that would serve as well.
    """
    known = many[:, : few.shape[1]]
    alike = np.mean([np.corrcoef(*pair)[0, 1] for pair in zip(few, known, strict=True)])
    if not alike > ALIKE:
        return few, few.shape[1]
    result = np.empty_like(many)
    for row, exact, local, own in zip(result, np.sort(few), many, np.sort(known), strict=True):
        row[:] = local + np.interp(local, own, exact - own)
    return result, float(1.0 / (alike**2 / many.shape[1] + (1.0 - alike**2) / few.shape[1]))


def _least_peak(experiment: Experiment, variable: str) -> float:
    """Return the least possible peak; -inf where none is known."""
    bound = LimitState(experiment).bounds[0]
    if variable != "friction_coefficient":
        return bound
    random_pressure = "normal_pressure" in experiment.random.names
    return -np.inf if random_pressure else bound / experiment.pressure
