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
    """Place the nodes of the simulated parameters in a box of the prior (step 2).

    The second parameter scales. The first ranges from 2 to 5, and the third
    over a factor of three, from 1 to 3, which needs equal ratios:

    >>> from scipy.stats import uniform
    >>> prior = Prior(None, None, {"a": uniform(2, 3), "b": uniform(0, 1), "c": uniform(1, 2)})
    >>> first, third = make_axes(prior, Scaling((1,), None, None), prior.whole, {2: 3})
    >>> first.parameter, first.values.tolist(), first.scale is np.positive
    (0, [2.0, 3.5, 5.0], True)
    >>> third.parameter, third.values.round(4).tolist(), third.scale is np.log
    (2, [1.0, 1.7321, 3.0], True)
    >>> half = np.array([[0.5, 0.0, 0.5], [1.0, 1.0, 1.0]])
    >>> axes = make_axes(prior, Scaling((1,), None, None), half, {2: 3})
    >>> [float(axis.values[0]) for axis in axes]
    [3.5, 2.0]
    >>> make_axes(prior, Scaling((), None, None), prior.whole, {1: 25, 2: 11})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: prior: 3 parameters ... a, b, c. At most 2 are possible. ...
    """
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

    >>> third, first = np.array([1.0, 4.0]), np.array([2.0, 3.0])
    >>> axes = [Axis(2, third, np.positive), Axis(0, first, np.positive)]
    >>> nodes_of(axes, np.array([7.0, 8.0, 7.0])).tolist()
    [[2.0, 8.0, 1.0], [3.0, 8.0, 1.0], [2.0, 8.0, 4.0], [3.0, 8.0, 4.0]]
    >>> nodes_of([], np.array([7.0, 8.0])).tolist()
    [[7.0, 8.0]]
    """
    steps = np.array(list(itertools.product(*(axis.values for axis in axes))))
    result = np.tile(reference, (len(steps), 1))
    result[:, [axis.parameter for axis in axes]] = steps
    return result


def corners(axes: Sequence[Axis], theta: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the nodes around points (points, parameters), and their weights (points, 2^axes).

    Node number 2 i + j has values i = 1, 2, 4 of the second parameter, in its
    logarithm, and j = 0, 10 of the first. The point (2.5, sqrt(8)) lies halfway
    between 2 and 4, and at a quarter between 0 and 10:

    >>> second, first = np.array([1.0, 2.0, 4.0]), np.array([0.0, 10.0])
    >>> axes = [Axis(1, second, np.log), Axis(0, first, np.positive)]
    >>> index, weight = corners(axes, np.array([[2.5, math.sqrt(8.0)], [10.0, 4.0], [-1.0, 9.0]]))
    >>> index.tolist()
    [[2, 4, 3, 5], [2, 4, 3, 5], [2, 4, 3, 5]]
    >>> weight.round(6).tolist()
    [[0.375, 0.375, 0.125, 0.125], [0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]
    >>> [part.tolist() for part in corners([], np.zeros((2, 3)))]
    [[[0], [0]], [[1.0], [1.0]]]
    """
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
    """Return the experiments at points (points, parameters), for specimens with a given length.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> prior = Prior(problem, st.RandomInterface(strength=st.paper.strength(problem)),
    ...               {"problem.solid.density": None, "marginal.low": None})
    >>> thetas = np.array([[1100.0, 5e5], [1200.0, 6e5]])
    >>> for experiment in experiments_at(prior, thetas, st.LocalCriterion(), 0.05):
    ...     problem, field = experiment.problem, experiment.random.members[0].strength
    ...     print(float(problem.solid.density), float(field.marginal.low), problem.interface.nodes)
    1100.0 500000.0 128
    1200.0 600000.0 128
    >>> len(experiments_at(prior, thetas[1], st.LocalCriterion()))
    1
    """
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

    The spacing is 0.1 m/256. A length of 51.1 mm is 130.8 spacings, and half of
    it is rounded:

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> of_length(problem, None) is problem, of_length(problem, 0.1 + 1e-12) is problem
    (True, True)
    >>> interface = of_length(problem, 0.0511).interface
    >>> interface.nodes, interface.length
    (130, 0.0511)
    >>> pressed = replace(problem, load=st.Load(pressing_force=1e3),
    ...                   interface=st.Interface(0.1, 256, width=0.01))
    >>> of_length(pressed, 0.1) is pressed
    True
    >>> of_length(pressed, 0.05)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: peaks: the pressure that a pressing force causes depends on ...
    >>> plane = replace(st.paper.problem(nodes=256, plane="strain"),
    ...                 interface=st.Interface((0.1, 0.1), (256, 256)))
    >>> of_length(plane, None) is plane
    True
    >>> of_length(plane, 0.1)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: peaks: lengths of specimens apply to lines, not to a plane
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
    """Return whether the method is expensive, and the local criterion can guide it.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> random = st.RandomInterface(strength=st.paper.strength(problem))
    >>> from scipy.stats import uniform
    >>> prior = Prior(problem, random, {"marginal.low": uniform(5e5, 1e5)})
    >>> is_guided(prior, st.LocalCriterion()), is_guided(prior, st.Equilibrium())
    (False, True)
    """
    problem, random = prior.at(prior.middle)
    is_local = optional_member(method, "exact_method") is not None
    return not is_local and not LocalCriterion().unfit_as_guide(problem, random.varying)


def simulate(
    experiments: Sequence[Experiment], simulation: Simulation, first: int, variable: str
) -> Array:
    """Return onsets (experiments, samples) for samples first, first + 1, ... of experiments.

    Sample i has the same draws in each experiment (step 3).

    A lower bound at 0.6 instead of 0.5 MPa, with the upper bound at 1.66 MPa,
    shifts and stretches the onset of each sample:

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=520)
    >>> prior = Prior(problem, st.RandomInterface(strength=st.paper.strength(problem)),
    ...               {"marginal.low": None})
    >>> method = st.LocalCriterion()
    >>> experiments = experiments_at(prior, np.array([[5e5], [6e5]]), method)
    >>> low, high = simulate(experiments, Simulation(method, 5, 3), 0, "critical_stress")
    >>> ratio = (1.66e6 - 6e5) / (1.66e6 - 5e5)
    >>> low.size, bool(np.allclose(high, 6e5 + ratio * (low - 5e5)))
    (5, True)
    >>> later = simulate(experiments, Simulation(method, 3, 3), 2, "critical_stress")
    >>> bool(np.allclose(later[1], high[2:]))
    True
    >>> other = simulate(experiments, Simulation(method, 3, 4), 0, "critical_stress")  # seed 4
    >>> bool(np.allclose(other[1], high[:3]))
    False
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
    """Return the area, m², of specimens with a given length, m, or as in the problem if None.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> problem = replace(problem, interface=st.Interface(0.1, 256, width=0.02))
    >>> random = st.RandomInterface(strength=st.paper.strength(problem))
    >>> from scipy.stats import uniform
    >>> prior = Prior(problem, random, {"marginal.low": uniform(5e5, 1e5)})
    >>> [round(area_of(prior, st.LocalCriterion(), length), 9) for length in (None, 0.05)]
    [0.002, 0.001]
    >>> prior = Prior(problem, random, {"problem.interface.width": uniform(0.02, 0.01)})
    >>> area_of(prior, st.LocalCriterion(), None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: peaks: the area varies over the prior, 0.002 to ...
    """
    at_ends = experiments_at(prior, prior.ends, method, length)
    least, most = (experiment.problem.area for experiment in at_ends)
    if least != most:
        raise InputError(
            f"peaks: the area varies over the prior, {least:g} to {most:g} m2. Give stresses (Pa)"
        )
    return least or math.nan


def variable_of(problem: Problem, random: Any, unit: str) -> str:
    """Return the variable that tests measure in a unit, if the problem defines this variable.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> random = st.RandomInterface(strength=st.paper.strength(problem))
    >>> variable_of(problem, random, "MPa")
    'critical_stress'
    >>> variable_of(problem, random, "kN")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: peaks: forces need Blocks(thickness=...)...
    >>> wide = replace(problem, interface=st.Interface(0.1, 256, width=0.02))
    >>> variable_of(wide, random, "kN")
    'critical_force'
    >>> pressed = replace(problem, load=st.Load(normal_pressure=1e6))
    >>> variable_of(pressed, random, "-"), variable_of(pressed, None, "-")
    ('friction_coefficient', 'friction_coefficient')
    >>> pressure = replace(random.strength, marginal=st.Lognormal(mean=1e6, cv=0.1))
    >>> variable_of(problem, replace(random, normal_pressure=pressure), "1")
    'friction_coefficient'
    >>> variable_of(problem, random, "1")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: peaks: are friction coefficients, which need a ...
    """
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
        """Return the likelihood for other peaks, and for all or some kinds of specimens.

        >>> kinds, areas = ["a", "b", "c"], [1.0, 2.0, 3.0]
        >>> likelihood = Likelihood(None, None, None, (), 0.0, kinds, areas, 9.0, None)
        >>> some = likelihood.of(["y", "z"], [2, 0])
        >>> some.densities, some.areas, some.peaks, likelihood.of(["x", "y", "z"]).areas
        (['c', 'a'], [3.0, 1.0], ['y', 'z'], [1.0, 2.0, 3.0])
        """
        kinds = range(len(self.densities)) if kinds is None else kinds
        densities, areas = [self.densities[k] for k in kinds], [self.areas[k] for k in kinds]
        return replace(self, peaks=peaks, densities=densities, areas=areas)

    def scales(self, kind: int, theta: Array) -> Array:
        """Return shift and stretch of the simulated onsets, with shape (2, points).

        >>> scaling = Scaling((1,), np.array([7.0, 2.0]), np.array([[10.0, 0.5]]))
        >>> likelihood = Likelihood(None, None, scaling, (), 0.0, [], [1.0, 3.0], 9.0, None)
        >>> likelihood.scales(1, np.array([[7.0, 2.0], [8.0, 5.0]])).tolist()
        [[0.0, 90.0], [3.0, 7.5]]
        """
        return self.scaling.of(theta) * self.areas[kind]

    def parts(self, u: Array) -> Array:
        """Return the log likelihood (points, tests) of each test at points u.

        Onsets of two kinds, with areas 1 and 2, are lognormal with ln T = 0 +- 0.1
        and 1 +- 0.2. A parameter stretches them by 1 to 3, at its middle by 2:

        >>> from scipy.stats import lognorm, norm, uniform
        >>> z = norm.ppf((np.arange(4000) + 0.5) / 4000)[None]
        >>> onsets = np.exp(0.1 * z), np.exp(1.0 + 0.2 * z)
        >>> kinds = [densities_of(part, np.zeros(1)) for part in onsets]
        >>> scaling = Scaling((0,), np.array([1.0]), np.array([[0.0, 1.0]]))
        >>> prior = Prior(None, None, {"a": uniform(1, 2)})
        >>> peaks = [np.array([1.9, 2.3]), np.array([9.0])]
        >>> box = np.array([[0.2], [0.5]])
        >>> areas = [1.0, 2.0]
        >>> likelihood = Likelihood(prior, None, scaling, (), 0.0, kinds, areas, 9.0, box, peaks)
        >>> first, second = lognorm(0.1, 0.0, 2.0), lognorm(0.2, 0.0, 4.0 * math.e)
        >>> expected = [*first.logpdf(peaks[0]), *second.logpdf(peaks[1])]
        >>> parts = likelihood.parts(np.array([[0.1], [0.5]]))
        >>> parts.shape, np.abs(parts[1] - expected).round(1).tolist()
        ((2, 3), [0.0, 0.0, 0.0])

        The likelihood is the product of all parts, and 0 outside the box:

        >>> values = likelihood(np.array([[0.1], [0.5], [0.51], [0.2]]))
        >>> values[[0, 2]].tolist(), round(float(values[1] - parts[1].sum()), 9)
        ([-inf, -inf], 0.0)
        >>> bool(np.isfinite(values[3]))  # at the lower end of the box
        True
        """
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
        """Draw a peak for a specimen type at each point u (points, parameters).

        Without an error of the load cell, peaks are stretched onsets:

        >>> from scipy.stats import uniform
        >>> kinds = [None, densities_of(np.array([[1.0, 2.0, 4.0]]), np.zeros(1))]
        >>> scaling = Scaling((0,), np.array([1.0]), np.array([[0.5, 1.0]]))
        >>> prior = Prior(None, None, {"a": uniform(1, 2)})
        >>> likelihood = Likelihood(prior, None, scaling, (), 0.0, kinds, [1.0, 2.0], 9.0, None)
        >>> drawn = likelihood.predicted(1, np.full((90, 1), 0.5), 0)  # 2 (0.5 + 2 T)
        >>> sorted({round(peak, 6) for peak in drawn.tolist()})
        [5.0, 9.0, 17.0]
        >>> noisy = replace(likelihood, error=0.01).predicted(1, np.full((4000, 1), 0.5), 0)
        >>> away = noisy - np.array([5.0, 9.0, 17.0])[np.searchsorted([7.0, 13.0], noisy)]
        >>> round(float(away.std()), 3)
        0.01

        Between nodes the logarithms of onsets are interpolated. At a quarter
        between onsets T and 16 T they are 2 T:

        >>> known = densities_of(np.array([[1.0, 2.0, 4.0], [16.0, 32.0, 64.0]]), np.zeros(2))
        >>> likelihood = replace(
        ...     likelihood, scaling=Scaling((), np.ones(1), np.zeros((0, 2))), densities=[known],
        ...     axes=(Axis(0, np.array([1.0, 3.0]), np.positive),))
        >>> drawn = likelihood.predicted(0, np.full((90, 1), 0.25), 0)
        >>> sorted({round(peak, 6) for peak in drawn.tolist()})
        [2.0, 4.0, 8.0]

        The sample belongs to the first node with the probability 3/4. If all
        onsets at the second node are the least, the least has 3/4 x 1/3 + 1/4:

        >>> known = known._replace(onsets=np.array([[1.0, 2.0, 4.0], [16.0, 16.0, 16.0]]))
        >>> likelihood = replace(likelihood, densities=[known])
        >>> drawn = likelihood.predicted(0, np.full((4000, 1), 0.25), 0)
        >>> bool(0.45 < np.mean(drawn < 2.1) < 0.55)
        True
        """
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
        """Return messages about peaks that no parameters in the prior can produce.

        Onsets 3 to 7 have the standard deviation 2, and further onsets lie up to 4
        beyond them, but not below the bound 1. The stretch of 1 to 3 reaches 33:

        >>> from scipy.stats import uniform
        >>> kinds = [densities_of(np.array([[3.0, 7.0]]), np.ones(1))]
        >>> scaling = Scaling((0,), np.array([1.0]), np.array([[0.0, 1.0]]))
        >>> prior = Prior(None, None, {"a": uniform(1, 2)})
        >>> likelihood = Likelihood(prior, None, scaling, (), 0.0, kinds, [1.0], 9.0, prior.whole)
        >>> given = [[np.array([peak])] for peak in (0.9, 1.1, 32.0, 34.0)]
        >>> [len(replace(likelihood, peaks=peaks).refusals()) for peaks in given]
        [1, 0, 0, 1]
        """
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
    """Return a message about peaks outside the `reach` (2, points) of all points in the prior.

    The error of the load cell reaches 4 x 0.5 farther:

    >>> from scipy.stats import uniform
    >>> prior = Prior(None, None, {"a": uniform(1, 2), "b": uniform(3, 4)})
    >>> points = np.array([[1.0, 3.0], [3.0, 3.0], [1.0, 7.0]])
    >>> reach = np.array([[6.0, 5.0, 7.0], [8.0, 10.0, 11.0]])
    >>> out_of_reach(prior, points, reach, 0.5, np.array([3.0, 13.0]))
    []
    >>> (text,) = out_of_reach(prior, points, reach, 0.5, np.array([7.0, 13.1, 2.9]))
    >>> text[:45], text[63:103]
    ('peaks: 2 of 3 are out of reach, such as 13.1.', 'ch 3 (a = 3, b = 3) to 13 (a = 1, b = 7)')
    """
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

    The local criterion gives 1, 3, 2, and the method 5, 9, 6. If a further
    onset by the local criterion is 2.5, the method is expected to give 7.5:

    >>> few, known = np.array([[5.0, 9.0, 6.0]]), np.array([[1.0, 3.0, 2.0]])
    >>> many, one = np.array([[1.0, 3.0, 2.0, 2.5]]), np.ones((1, 1))
    >>> moved(many, few, known, np.zeros((1, 1), dtype=int), one).round(6).tolist()
    [[5.0, 9.0, 6.0, 7.5]]

    At another node onsets are ten times as large, and differ by 10, 5 and 0,
    which is 1, 0.5 and 0 on this scale. With the weights 1/4 and 3/4 the
    differences are 4/4 + 3/4, 4/4 + 1.5/4 and 6/4:

    >>> few = np.append(few, [[20.0, 30.0, 25.0]], 0)
    >>> known = np.append(known, [[10.0, 30.0, 20.0]], 0)
    >>> moved(many, few, known, np.array([[0, 1]]), np.array([[0.25, 0.75]])).round(6).tolist()
    [[2.75, 4.5, 3.375, 3.9375]]
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
    """Count independent samples with as much information as the moved onsets.

    >>> round(effective_samples(0.6, 1000, 100), 6), round(1.0 / (0.36 / 1000 + 0.64 / 100), 6)
    (147.928994, 147.928994)
    """
    return 1.0 / (alike**2 / many + (1.0 - alike**2) / few)


def warn_if_long(experiment: Experiment, samples: int, workers: int | None) -> None:
    """Warn if the simulation takes more than `WARN_SECONDS`.

    >>> import warnings
    >>> from types import SimpleNamespace
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_if_long(SimpleNamespace(seconds=2.0), 60, 2)  # 60 s in two threads
    ...     warn_if_long(SimpleNamespace(seconds=2.0), 3600, 2)
    >>> [str(warning.message)[:46] for warning in caught]
    ['the likelihood takes about 60 min: 3,600 onset']
    """
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

    Strengths lie between 0.66 and 1.66 MPa:

    >>> import stiction as st
    >>> problem = replace(st.paper.problem(nodes=256), load=st.Load(normal_pressure=2e6),
    ...                   interface=st.Interface(0.1, 256, width=0.02))
    >>> field = st.paper.strength(problem)
    >>> experiment = Experiment(problem, st.RandomInterface(strength=field), st.LocalCriterion())
    >>> for variable in ("critical_stress", "critical_force", "friction_coefficient"):
    ...     print([round(bound, 9) for bound in bounds_of(experiment, variable)])
    [660000.0, 1660000.0]
    [1320.0, 3320.0]
    [0.33, 0.83]
    >>> low, high = bounds_of(experiment, "critical_stress", 0.1)
    >>> 660000.0 < low < high < 1660000.0
    True
    >>> pressure = replace(field, marginal=st.Lognormal(mean=1e6, cv=0.1))
    >>> random = st.RandomInterface(strength=field, normal_pressure=pressure)
    >>> varying = replace(problem, load=st.Load())
    >>> bounds_of(Experiment(varying, random, st.LocalCriterion()), "friction_coefficient")
    (-inf, inf)
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
