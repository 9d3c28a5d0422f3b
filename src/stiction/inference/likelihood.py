"""Likelihood of measured peaks as a function of the parameters."""

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, no_single_length
from stiction.inference.density import Densities, log_likelihoods, tabulate
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

BATCHES = 8
"""Number of parts of the sample, each left out once to estimate the Monte Carlo error."""
SAMPLES = {"local_criterion": 2000, "equilibrium": 500}
FEW = 100
ALIKE = 0.8
"""Correlation of the onsets by two methods above which one helps the other."""
SPECIMEN = 2**20
"""Samples of a specimen of another length begin at multiples of this."""
BEYOND = 2.0
"""Spreads beyond the extremes of all simulated peaks beyond which a peak is out of reach."""
ERRORS = 5.0
"""Standard deviations of the load cell that are added to this distance."""


class Specimen(NamedTuple):
    """Simulated results of one kind of specimen, in the unit of the peaks."""

    onsets: Array  # (nodes, samples): of the same samples at every node
    local: Array | None  # by the local criterion, of the same samples and of more, if they help
    bound: Array  # (nodes,): least possible peak; -inf where none is known
    peaks: Array  # (nodes, samples): onsets, as many as of the local criterion if that helps
    densities: Densities  # of the peaks

    @classmethod
    def of(cls, onsets: Array, local: Array | None, bound: Array) -> Self:
        """Estimate the densities of simulated onsets."""
        peaks = onsets if local is None else moved(onsets, local)
        return cls(onsets, local, bound, peaks, tabulate(peaks, bound))

    def without(self, batch: int) -> Self:
        """Return the same from all samples but those of one batch."""

        def kept(values: Array) -> Array:
            return values[:, np.arange(values.shape[1]) % BATCHES != batch]

        local = None if self.local is None else kept(self.local)
        return self.of(kept(self.onsets), local, self.bound)


class Model(NamedTuple):
    """All that does not depend on the data: made once, used for any number of data sets."""

    prior: Prior
    method: Any
    scaling: Scaling
    axes: tuple[Axis, ...]  # of the parameters that are simulated
    error: float  # standard deviation of the load cell, in the unit of the peaks
    specimens: tuple[Specimen, ...]
    low: Array  # corners, as u, between which onsets are simulated
    high: Array

    def log_densities(self, number: int, theta: Array, peaks: Array) -> Array:
        """Return logarithms of the density of peaks of specimen `number`, (points, peaks)."""
        used = self.specimens[number].densities
        index, weight = corners(self.axes, theta)
        shift, stretch = map(np.ascontiguousarray, self.scaling.of(theta))
        own, out = np.ascontiguousarray(peaks), np.empty((theta.shape[0], peaks.size))
        log_likelihoods(index, weight, shift, stretch, self.error, used, own, out)
        return out

    def reach(self, number: int) -> tuple[float, float, str]:
        """Return the least and greatest peak of specimen `number`, and at which parameters."""
        own, keys = self.specimens[number], list(self.scaling.keys)
        spread = BEYOND * own.peaks.std(axis=1)
        lowest = np.maximum(own.peaks.min(axis=1) - spread, own.densities.bound)
        highest = own.peaks.max(axis=1) + spread
        nodes = nodes_of(self.axes, self.scaling.reference)
        ends = self.prior.theta(np.stack([self.low, self.high])).T[keys]
        points = np.concatenate([nodes] * 2 ** len(keys))
        points[:, keys] = np.repeat(list(itertools.product(*ends)), len(nodes), axis=0)
        shift, stretch = self.scaling.of(points)
        least = shift + stretch * np.tile(lowest, 2 ** len(keys)) - ERRORS * self.error
        most = shift + stretch * np.tile(highest, 2 ** len(keys)) + ERRORS * self.error
        names = self.prior.names
        texts = [
            ", ".join(f"{name} = {v:.6g}" for name, v in zip(names, point, strict=True))
            for point in points[[least.argmin(), most.argmax()]]
        ]
        text = f"the lowest come from {texts[0]}, the highest come from {texts[1]}"
        return float(least.min()), float(most.max()), text


def make_model(
    prior: Prior,
    *,
    method: Any,
    lengths: Sequence[float | None],
    error: float,
    samples: int | None,
    seed: int,
    variable: str,
    meter: Meter = SILENT,
    low: Array | None = None,
    high: Array | None = None,
) -> Model:
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
    count = SAMPLES.get(method.type, FEW) if samples is None else samples
    more = 0
    if method.type != "local_criterion" and not no_single_length(*prior.at(prior.middle)):
        more = max(count, SAMPLES["local_criterion"])
    meter.stage("simulated onsets", len(thetas) * len(lengths) * (count + more))
    specimens = []
    for number, length in enumerate(lengths):
        experiments = experiments_at(prior, thetas, method, length)
        for end in (experiments[0], experiments[-1]):
            end.random.warn_if_inaccurate(end.problem.interface)
        options: Any = {"seed": seed, "variable": variable, "meter": meter}
        options["first"] = number * SPECIMEN
        onsets, local = simulate(experiments, samples=count, **options), None
        if more:
            others = [own.by(LocalCriterion()) for own in experiments]
            local = simulate(others, samples=more, **options)
            # What `moved` saves outweighs what it adds from a correlation of 0.63 on.
            pairs = zip(onsets, local[:, :count], strict=True)
            if not np.mean([np.corrcoef(*pair)[0, 1] for pair in pairs]) > ALIKE:
                local = None
        bound = np.array([least_peak(own, variable) for own in experiments])
        specimens.append(Specimen.of(onsets, local, bound))
    return Model(prior, method, scaling, axes, error, tuple(specimens), low, high)


def least_peak(experiment: Experiment, variable: str) -> float:
    """Return the least possible peak; -inf where none is known."""
    bound = LimitState(experiment).bounds[0]
    if variable != "friction_coefficient":
        return bound
    random_pressure = "normal_pressure" in experiment.random.names
    return -np.inf if random_pressure else bound / experiment.pressure


def moved(few: Array, many: Array) -> Array:
    """Move many onsets by the local criterion, (points, many), to those of a few by the method.

    The same samples by both methods differ little, and so do their quantiles: the difference of
    the quantiles of the few is added to the many.
    """
    result = np.empty_like(many)
    for row, exact, local in zip(result, few, many, strict=True):
        known = np.sort(local[: exact.size])
        row[:] = local + np.interp(local, known, np.sort(exact) - known)
    return result


class Likelihood(NamedTuple):
    """A model and data: peaks of each specimen."""

    model: Model
    peaks: tuple[Array, ...]

    def parts(self, u: Array) -> list[Array]:
        """Return logarithms of the likelihood of each test at points u, (points, tests) each."""
        theta, densities = self.model.prior.theta(u), self.model.log_densities
        return [densities(i, theta, peaks) for i, peaks in enumerate(self.peaks)]

    def __call__(self, u: Array) -> Array:
        """Return the logarithm of the likelihood at points u (points, parameters).

        -inf outside the box that was simulated.
        """
        inside = np.all((u >= self.model.low) & (u <= self.model.high), axis=1)
        result = np.full(u.shape[0], -np.inf)
        if inside.any():
            result[inside] = np.concatenate(self.parts(u[inside]), axis=1).sum(axis=1)
        return result

    def without(self, batch: int) -> Self:
        """Return the same from all simulated samples but those of one batch."""
        specimens = tuple(one.without(batch) for one in self.model.specimens)
        return self._replace(model=self.model._replace(specimens=specimens))
