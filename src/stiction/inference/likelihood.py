"""Likelihood of measured peaks, from simulated onsets on a parameter grid.

Problem. Parameters theta of a random interface are unknown. Peaks y_j =
T + error were measured on specimens with onset T. Compute the
likelihood L(theta) = prod_j p(y_j | theta) for any theta. Each density
p needs hundreds of simulated onsets.

Sources. Steps 1 to 3 and 5 are our own. Step 4 is a control variate
(Hammersley and Handscomb, Monte Carlo Methods, 1964, section 5.5),
applied to quantiles in place of a mean.

Steps:

1. Find the parameters that only shift and stretch the onset
   (`stiction.inference.prior`). They need no simulation.
2. Place nodes along each of the other parameters, at most four, in the
   relevant box of the prior.
3. Simulate onsets at every node of the product grid. Use the same
   draws, so that L is smooth.
4. If the method is expensive and the local criterion applies, use the
   method only at the corners and at a few nodes between them
   (`COARSE`), and the local criterion at all nodes. Shift the onsets
   from the local criterion by the difference between both quantile
   functions. Do so only if the correlation between the onsets from both
   methods is above `MIN_CORRELATION`.
5. Tabulate the density at each node (`stiction.inference.density`).
   Between nodes, the log of the standardised density, the bound, the
   mean and the spread are linear in each parameter.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_user
from stiction.base.progress import SILENT, Meter, duration
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState
from stiction.inference.density import ERRORS, Densities, densities_of, log_likelihoods
from stiction.inference.peaks import VARIABLES, si_of
from stiction.inference.prior import Prior, Scaling, find_scaling
from stiction.methods.criterion.local import LocalCriterion
from stiction.methods.protocol import optional_member
from stiction.problem.problem import Problem, warn_of_weld
from stiction.random.synthesis import SAMPLES_PER_BLOCK

NODES = {0: 1, 1: 25, 2: 11, 3: 7, 4: 5}
COARSE = {0: 1, 1: 5, 2: 4, 3: 3, 4: 2}
"""Nodes along each simulated parameter, by the number of these
parameters. An expensive method that the local criterion guides is
simulated at the coarse nodes only."""
LOG = 3.0
"""Ratio of the ends of a prior from which on a parameter is interpolated
in its logarithm."""
MIN_CORRELATION = 0.8
"""Correlation of the onsets by two methods above which step 4 is
worthwhile."""
SPECIMEN = 2**20
"""Samples of each further kind of specimen begin at the next multiple of
this number."""
WARN_SECONDS = 60.0
"""Seconds of simulation above which a warning states the time before it
begins."""
REACH_SPREADS = 2.0
"""Standard deviations beyond all simulated onsets at which a peak is out
of reach."""


class Axis(NamedTuple):
    """Nodes of one simulated parameter.

    Interpolation is linear in `scale` of the parameter.
    """

    parameter: int  # place in the prior
    values: Array  # rising
    scale: Callable[[Array], Array]


def make_axes(
    prior: Prior, scaling: Scaling, box: Array, along: Mapping[int, int] = NODES
) -> tuple[Axis, ...]:
    """Place the nodes of the simulated parameters in a box of the prior (step 2)."""
    simulated = [i for i in range(prior.dimension) if i not in scaling.keys]
    if len(simulated) not in along:
        names = ", ".join(prior.names[i] for i in simulated)
        raise InputError(
            f"prior: {len(simulated)} parameters would have to be simulated on a grid,"
            f" {names}. At most {max(along)} are possible. Fix the best-known parameters"
        )
    axes, ends = [], prior.theta(box)
    for i in simulated:
        first, last = ends[:, i]
        # A range over several factors needs nodes at equal ratios.
        log = last >= LOG * first > 0.0
        space: Any = np.geomspace if log else np.linspace
        nodes = space(first, last, along[len(simulated)])
        axes.append(Axis(i, nodes, np.log if log else np.positive))
    return tuple(axes)


def nodes_of(axes: Sequence[Axis], reference: Array) -> Array:
    """Return the parameters (nodes, parameters).

    Scaling parameters are at `reference`.
    """
    steps = np.array(list(itertools.product(*(axis.values for axis in axes))))
    result = np.tile(reference, (len(steps), 1))
    result[:, [axis.parameter for axis in axes]] = steps
    return result


def corners(axes: Sequence[Axis], theta: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the nodes around points (points, parameters), and their weights (points, 2^axes)."""
    count = theta.shape[0]
    index, weight = np.zeros((count, 1), dtype=np.int64), np.ones((count, 1))
    for i, values, scale in axes:
        at = np.interp(scale(theta[:, i]), scale(values), np.arange(values.size))
        # Each axis doubles the number of corners.
        last = values.size - 1
        cell = np.minimum(at.astype(np.int64), max(last - 1, 0))[:, None]
        share = at[:, None] - cell
        ends = cell, np.minimum(cell + 1, last)
        index = np.concatenate([index * values.size + end for end in ends], axis=1)
        weight = np.concatenate([weight * (1.0 - share), weight * share], axis=1)
    return index, weight


def experiments_at(
    prior: Prior, thetas: Array, method: Any, length: float | None = None
) -> list[Experiment]:
    """Return the experiments at points (points, parameters), for specimens with a given length."""
    experiments = []
    for theta in np.atleast_2d(thetas):
        problem, random = prior.at(theta)
        with prior.named(theta):
            experiments.append(Experiment(of_length(problem, length), random, method))
    return experiments


def of_length(problem: Problem, length: float | None) -> Problem:
    """Return the problem for specimens with a length, m.

    None means the length of the problem.

    The node spacing is the spacing of the problem.
    """
    interface = problem.interface
    if length is not None and interface.is_plane:
        raise InputError("peaks: lengths of specimens apply to lines, not to a plane")
    if length is None or np.isclose(length, interface.measure, rtol=1e-9):
        return problem
    if problem.load.pressing_force is not None:
        raise InputError(
            "peaks: the pressure that a pressing force causes depends on the length of specimens."
            " Give Load(normal_pressure=...) in Pa"
        )
    nodes = 2 * max(4, round(0.5 * length / interface.spacing))
    return replace(problem, interface=replace(interface, length=length, nodes=nodes))


class Simulation(NamedTuple):
    """Settings for the simulation of onsets."""

    method: Any
    samples: int | None  # at each node; by default as many as the method needs
    seed: int
    workers: int | None = None  # threads; all cores by default
    meter: Meter = SILENT


def is_guided(prior: Prior, method: Any) -> bool:
    """Return whether the method is expensive, and the local criterion can guide it."""
    problem, random = prior.at(prior.middle)
    is_local = optional_member(method, "exact_method") is not None
    return not is_local and not LocalCriterion().unfit_as_guide(problem, random.varying)


def simulate(
    experiments: Sequence[Experiment], simulation: Simulation, first: int, variable: str
) -> Array:
    """Return onsets (experiments, samples) for samples first, first + 1, ... of experiments.

    Sample i has the same draws in each experiment (step 3).
    """
    samples: Any = simulation.samples
    peaks = np.empty((len(experiments), samples))
    seeded = [experiment.with_seed(simulation.seed) for experiment in experiments]
    # Batches begin at blocks of draws, because a part of a block costs
    # as much as the block.
    jobs = [
        (row, experiment, *span)
        for row, experiment in zip(peaks, seeded, strict=True)
        for span in experiment.batches(first, samples, max(SAMPLES_PER_BLOCK, experiment.batch))
    ]

    def work(job: tuple[Array, Experiment, int, int]) -> None:
        row, experiment, start, count = job
        row[start - first : start - first + count] = experiment.results(start, count)[variable]
        simulation.meter.advance(count)

    in_threads(work, jobs, simulation.workers or usable_cores())
    return peaks


def area_of(prior: Prior, method: Any, length: float | None) -> float:
    """Return the area, m², of specimens with a given length, m, or as in the problem if None."""
    at_ends = experiments_at(prior, prior.ends, method, length)
    least, most = (experiment.problem.area for experiment in at_ends)
    if least != most:
        raise InputError(
            f"peaks: the area varies over the prior, {least:g} to {most:g} m2. Give stresses (Pa)"
        )
    return least or math.nan


def variable_of(problem: Problem, random: Any, unit: str) -> str:
    """Return the variable that tests measure in a unit, if the problem defines this variable."""
    variable = VARIABLES[si_of(unit)]
    if variable == "critical_force" and problem.area is None:
        raise InputError("peaks: forces need Blocks(thickness=...) or Interface(width=...)")
    if variable == "critical_force":
        warn_of_weld(problem, "peaks")
    given = () if random is None else random.names
    pressed = problem.given_pressure is not None or "normal_pressure" in given
    if variable == "friction_coefficient" and not pressed:
        raise InputError(
            "peaks: are friction coefficients, which need a normal pressure. Give"
            " Load(normal_pressure=...) in Pa, or peaks as stresses with their unit"
        )
    return variable


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Simulated onsets and the likelihood of measured peaks.

    A force is an onset times an area.
    """

    prior: Prior
    method: Any
    scaling: Scaling
    axes: tuple[Axis, ...]  # of the simulated parameters
    error: float  # standard deviation of the load cell
    densities: Sequence[Densities]  # for each kind of specimen
    areas: Sequence[float]  # for each kind if peaks are forces, or else 1
    samples: float  # number of independent samples with the same information
    box: Array  # corners, as u, of the simulated part of the prior, (2, parameters)
    peaks: Sequence[Array] = ()

    def of(self, peaks: Sequence[Array], kinds: Sequence[int] | None = None) -> Self:
        """Return the likelihood for other peaks, and for all or some kinds of specimens."""
        kinds = range(len(self.densities)) if kinds is None else kinds
        densities, areas = [self.densities[k] for k in kinds], [self.areas[k] for k in kinds]
        return replace(self, peaks=peaks, densities=densities, areas=areas)

    def scales(self, kind: int, theta: Array) -> Array:
        """Return shift and stretch of the simulated onsets, with shape (2, points)."""
        return self.scaling.of(theta) * self.areas[kind]

    def parts(self, u: Array) -> Array:
        """Return the log likelihood (points, tests) of each test at points u."""
        theta, parts = self.prior.theta(u), []
        near = corners(self.axes, theta)
        for kind, (known, peaks) in enumerate(zip(self.densities, self.peaks, strict=True)):
            of_v, scales = known.between(*near), self.scales(kind, theta)
            out = np.empty((u.shape[0], peaks.size))
            log_likelihoods(known.table, *near, of_v, scales, self.error, peaks, out)
            parts.append(out)
        return np.concatenate(parts, axis=1)

    def __call__(self, u: Array) -> Array:
        """Return the log likelihood at points u (points, parameters).

        The result is -inf outside the simulated box.
        """
        inside = np.all((u >= self.box[0]) & (u <= self.box[1]), axis=1)
        result = np.full(u.shape[0], -np.inf)
        if inside.any():
            result[inside] = self.parts(u[inside]).sum(axis=1)
        return result

    def predicted(self, kind: int, u: Array, seed: int) -> Array:
        """Draw a peak for a specimen type at each point u (points, parameters)."""
        rng = np.random.default_rng([seed, 1, kind])
        theta = self.prior.theta(u)
        shift, stretch = self.scales(kind, theta)
        known = self.densities[kind]
        index, weight = corners(self.axes, theta)
        # A node in proportion to its weight, and one of its onsets.
        # Bound, mean and spread are interpolated, as in the likelihood.
        corner = (weight.cumsum(axis=1) < rng.random((u.shape[0], 1))).sum(axis=1)
        node = index[np.arange(u.shape[0]), np.minimum(corner, index.shape[1] - 1)]
        sample = rng.integers(known.onsets.shape[1], size=u.shape[0])
        bound, mean, spread = known.between(index, weight)
        onset = bound + np.exp(mean + spread * known.standardised()[node, sample])
        return shift + stretch * onset + self.error * rng.standard_normal(u.shape[0])

    def refusals(self) -> list[str]:
        """Return messages about peaks that no parameters in the prior can produce."""
        ends = self.prior.theta(self.box).T
        scaled = [Axis(i, ends[i], np.positive) for i in self.scaling.keys]
        points = nodes_of([*self.axes, *scaled], self.scaling.reference)
        texts = []
        for kind, (known, peaks) in enumerate(zip(self.densities, self.peaks, strict=True)):
            shift, stretch = self.scales(kind, points)
            # Further samples may lie a little beyond the simulated onsets.
            room = REACH_SPREADS * known.onsets.std(axis=1)
            lowest = np.maximum(known.onsets.min(axis=1) - room, known.bound)
            reach = np.stack([lowest, known.onsets.max(axis=1) + room])
            reach = shift + stretch * np.repeat(reach, 2 ** len(scaled), axis=1)
            texts += out_of_reach(self.prior, points, reach, self.error, peaks)
        return texts


def out_of_reach(
    prior: Prior, points: Array, reach: Array, error: float, peaks: Array
) -> list[str]:
    """Return a message about peaks outside the `reach` (2, points) of all points in the prior."""
    low, high = reach[0].min() - ERRORS * error, reach[1].max() + ERRORS * error
    far = (peaks < low) | (peaks > high)
    if not far.any():
        return []
    value = peaks[far][0]
    lowest, highest = (
        ", ".join(f"{n} = {v:.6g}" for n, v in zip(prior.names, point, strict=True))
        for point in points[[reach[0].argmin(), reach[1].argmax()]]
    )
    return [
        f"peaks: {far.sum()} of {far.size} are out of reach, such as {value:g}. The prior can reach"
        f" {low:g} ({lowest}) to {high:g} ({highest}). Widen the prior, or state the unit"
    ]


def make_likelihood(
    prior: Prior,
    simulation: Simulation,
    box: Array | None = None,
    *,
    lengths: Sequence[float | None],
    error: float,
    variable: str,
) -> Likelihood:
    """Simulate the onsets that the likelihood needs (steps 1 to 5).

    `lengths` holds the specimen length, m, for each kind, or None for
    the length in the problem. `variable` is the name of the peaks among
    the results, and `error` is the standard deviation of the load-cell
    error. `box` is the relevant part of the prior, in u with shape (2,
    parameters), and by default the whole prior.
    """
    box = prior.whole if box is None else box
    method, meter = simulation.method, simulation.meter
    forces = variable == "critical_force"
    variable = "critical_stress" if forces else variable
    # 1. and 2.
    scaling = find_scaling(prior, method, variable)
    axes = make_axes(prior, scaling, box)
    thetas = nodes_of(axes, scaling.reference)
    count = simulation.samples or optional_member(method, "samples_at_point")
    simulation = simulation._replace(samples=count)
    guided = is_guided(prior, method)
    few = make_axes(prior, scaling, box, COARSE) if guided else axes
    coarse, weights = nodes_of(few, scaling.reference), corners(few, thetas)
    total = len(coarse) * len(lengths) * count
    warn_if_long(experiments_at(prior, coarse[:1], method)[0], total, simulation.workers)
    meter.stage("simulated onsets", total)
    effective, densities = float(count), []
    for number, length in enumerate(lengths):
        experiments = experiments_at(prior, thetas, method, length)
        # A grid that suits both ends of the box suits all points between.
        for end in (experiments[0], experiments[-1]):
            end.random.members[0].warn_if_inaccurate(end.problem.interface)
        # 3.
        at_coarse = experiments_at(prior, coarse, method, length)
        first = number * SPECIMEN
        onsets = simulate(at_coarse, simulation, first, variable)
        # 4. The first `count` samples by both methods are the same.
        if guided:
            by_local = [one.by(LocalCriterion()) for one in at_coarse]
            known = simulate(by_local, simulation._replace(meter=SILENT), first, variable)
            by_local = [one.by(LocalCriterion()) for one in experiments]
            size = max(count, LocalCriterion.samples_at_point)
            meter.stage("onsets by the local criterion", len(thetas) * size)
            many = simulate(by_local, simulation._replace(samples=size), first, variable)
            pairs = zip(onsets, known, strict=True)
            alike = float(np.mean([np.corrcoef(*pair)[0, 1] for pair in pairs]))
            if alike > MIN_CORRELATION:
                onsets = moved(many, onsets, known, *weights)
                effective = effective_samples(alike, size, count)
            else:
                warn_if_long(experiments[0], len(thetas) * count, simulation.workers)
                meter.stage("simulated onsets", len(thetas) * count)
                onsets = simulate(experiments, simulation, first, variable)
        # 5.
        bounds = [bounds_of(own, variable)[0] for own in experiments]
        densities.append(densities_of(onsets, np.array(bounds)))
    areas = [area_of(prior, method, length) if forces else 1.0 for length in lengths]
    return Likelihood(prior, method, scaling, axes, error, densities, areas, effective, box)


def moved(
    many: Array, few: Array, known: Array, index: NDArray[np.int64], weight: Array
) -> Array:
    """Estimate onsets by an expensive method from many onsets by the local criterion (step 4).

    `many` are onsets by the local criterion, with shape (points, many).
    At coarse nodes, `few` are onsets by the method and `known` are
    onsets by the local criterion for the same samples, both with shape
    (nodes, few). The difference between their quantiles, divided by the
    standard deviation, changes little between nodes. The ratio is
    interpolated between the nodes `index` around each point, with
    weights `weight`.
    """
    mean, spread = known.mean(axis=1, keepdims=True), known.std(axis=1, keepdims=True)
    standardised = (np.sort(known) - mean) / spread
    away = (np.sort(few) - np.sort(known)) / spread
    result = np.empty_like(many)
    for row, values, nodes, share in zip(result, many, index, weight, strict=True):
        same = values[: few.shape[1]]
        # The samples that both methods solved give the scale, so that
        # their error cancels.
        z = (values - same.mean()) / same.std()
        shifts = [np.interp(z, standardised[node], away[node]) for node in nodes]
        row[:] = values + same.std() * (share @ np.stack(shifts))
    return result


def effective_samples(alike: float, many: int, few: int) -> float:
    """Count independent samples with as much information as the moved onsets."""
    return 1.0 / (alike**2 / many + (1.0 - alike**2) / few)


def warn_if_long(experiment: Experiment, samples: int, workers: int | None) -> None:
    """Warn if the simulation takes more than `WARN_SECONDS`."""
    seconds = samples * experiment.seconds / (workers or usable_cores())
    if seconds > WARN_SECONDS:
        warn_user(
            f"the likelihood takes about {duration(seconds)}: {samples:,} onsets of"
            f" {duration(experiment.seconds)}. Use fewer samples, nodes or unknown parameters",
            UserWarning,
        )


def bounds_of(
    experiment: Experiment, variable: str, negligible: float = 0.0
) -> tuple[float, float]:
    """Return the least and the greatest possible peak.

    A `negligible` fraction may lie outside.
    """
    low, high = LimitState(experiment).likely_bounds(negligible)
    if variable == "critical_force":
        area = experiment.problem.area or math.nan
        return low * area, high * area
    if variable != "friction_coefficient":
        return low, high
    if "normal_pressure" in experiment.random.varying:
        return -np.inf, np.inf
    return low / experiment.pressure, high / experiment.pressure
