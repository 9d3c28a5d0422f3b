"""Likelihood of measured peaks: simulated onsets on a grid of parameters, and their densities."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, no_single_length
from stiction.errors import InputError
from stiction.inference.density import ERRORS, Densities, log_likelihoods, tabulate, to_v
from stiction.inference.prior import Prior
from stiction.inference.scaling import Scaling, find_scaling
from stiction.interface import Interface
from stiction.progress import SILENT, Meter
from stiction.random.synthesis import BLOCK

NODES = {0: 1, 1: 25, 2: 11, 3: 7, 4: 5}
"""Nodes along each simulated parameter, by the number of these parameters."""
LOG = 3.0
"""Ratio of the ends of a prior from which a parameter is interpolated in its logarithm."""
SAMPLES = {"local_criterion": 2000, "equilibrium": 500}
FEW = 100
ALIKE = 0.8
"""Correlation of the onsets by two methods above which one helps the other."""
SPECIMEN = 2**20
"""Samples of a specimen of another length begin at multiples of this."""
BEYOND = 2.0
"""Spreads beyond the extremes of these at which a peak is out of reach."""


class Axis(NamedTuple):
    """Nodes of one simulated parameter."""

    parameter: int  # its place in the prior
    values: Array  # rising
    log: bool  # whether to interpolate in the logarithm

    def place(self, theta: Array) -> tuple[NDArray[np.int64], Array]:
        """Return the node below each value (points,), and the share of the way to the next."""
        nodes, at = (np.log(self.values), np.log(theta)) if self.log else (self.values, theta)
        cell = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, nodes.size - 2)
        share = (at - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
        return cell, np.clip(share, 0.0, 1.0)


def make_axes(prior: Prior, scaling: Scaling, low: Array, high: Array) -> tuple[Axis, ...]:
    """Place the nodes of the parameters that need simulation between two corners, as u."""
    simulated = [i for i in range(prior.dimension) if i not in scaling.keys]
    if len(simulated) not in NODES:
        names = ", ".join(prior.names[i] for i in simulated)
        raise InputError(
            f"prior: {len(simulated)} parameters would have to be simulated on a grid,"
            f" {names}; at most {max(NODES)} are possible: fix the best-known ones"
        )
    axes = []
    for i, (first, last) in enumerate(prior.theta(np.array([low, high])).T):
        log = bool(first > 0.0 and last >= LOG * first)
        space = np.geomspace if log else np.linspace
        axes.append(Axis(i, space(first, last, NODES[len(simulated)]), log))
    return tuple(axes[i] for i in simulated)


def nodes_of(axes: Sequence[Axis], reference: Array) -> Array:
    """Return the parameters at all nodes, (nodes, parameters); those that scale at `reference`."""
    steps = np.array(list(itertools.product(*(axis.values for axis in axes))))
    result = np.tile(reference, (len(steps), 1))
    result[:, [axis.parameter for axis in axes]] = steps
    return result


def corners(axes: Sequence[Axis], theta: Array) -> tuple[NDArray[np.int64], Array]:
    """Return nodes around points (points, parameters) and their weights, (points, 2^axes) each."""
    count = theta.shape[0]
    index, weight = np.zeros((count, 1), dtype=np.int64), np.ones((count, 1))
    for axis in axes:
        cell, share = axis.place(theta[:, axis.parameter])
        index = np.concatenate(
            [index * axis.values.size + (cell + k)[:, None] for k in (0, 1)], 1
        )
        weight = np.concatenate([weight * (1.0 - share)[:, None], weight * share[:, None]], 1)
    return index, weight


def experiments_at(
    prior: Prior, thetas: Array, method: Any, length: float | None = None
) -> list[Experiment]:
    """Return the experiments at points (points, parameters), on specimens of a length, m.

    The node spacing is that of the problem.
    """
    found = []
    for theta in thetas:
        problem, random = prior.at(theta)
        own = problem.interface
        with prior.named(theta):
            if length is not None and own.is_plane:
                raise InputError(
                    "peaks: specimen lengths apply to lines only; the interface is a plane"
                )
            if length is not None and not np.isclose(length, own.extent, rtol=1e-9):
                nodes = 2 * max(4, round(0.5 * length / own.spacing))
                problem = replace(problem, interface=Interface(length, nodes))
            found.append(Experiment(problem, random, method))
    return found


def simulate(
    experiments: Sequence[Experiment],
    *,
    samples: int,
    first: int,
    seed: int,
    variable: str,
    meter: Meter = SILENT,
) -> Array:
    """Return onsets of samples first, ... of some experiments, (experiments, samples).

    Sample i has the same draws in each of them.
    """
    peaks = np.empty((len(experiments), samples))
    jobs = [
        (number, start, count)
        for number, own in enumerate(experiments)
        for start, count in own.batches(first, samples, max(BLOCK, own.batch))
    ]

    def work(job: tuple[int, int, int]) -> None:
        number, start, count = job
        values = experiments[number].with_seed(seed).results(start, count)
        peaks[number, start - first : start - first + count] = values[variable]
        meter.advance(count)

    in_threads(work, jobs, usable_cores())
    return peaks


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
        texts, keys = [], list(self.scaling.keys)
        nodes = nodes_of(self.axes, self.scaling.reference)
        ends = self.prior.theta(np.stack([self.low, self.high])).T[keys]
        points = np.concatenate([nodes] * 2 ** len(keys))
        points[:, keys] = np.repeat(list(itertools.product(*ends)), len(nodes), axis=0)
        shift, stretch = self.scaling.of(points)
        for onsets, known, peaks in zip(self.onsets, self.densities, self.peaks, strict=True):
            room = BEYOND * onsets.std(axis=1)
            lowest = np.maximum(onsets.min(axis=1) - room, known.bound)
            highest = onsets.max(axis=1) + room
            least = shift + stretch * np.tile(lowest, 2 ** len(keys)) - ERRORS * self.error
            most = shift + stretch * np.tile(highest, 2 ** len(keys)) + ERRORS * self.error
            low, high = float(least.min()), float(most.max())
            far = (peaks < low) | (peaks > high)
            places = [
                ", ".join(
                    f"{n} = {v:.6g}" for n, v in zip(self.prior.names, point, strict=True)
                )
                for point in points[[least.argmin(), most.argmax()]]
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
