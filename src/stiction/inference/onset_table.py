"""Simulated onsets on a grid of those parameters that need simulation, with the same draws."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError
from stiction.inference.prior import Prior
from stiction.inference.scaling import Scaling
from stiction.interface import Interface
from stiction.progress import SILENT, Meter
from stiction.random.synthesis import BLOCK

NODES = {0: 1, 1: 25, 2: 11, 3: 7, 4: 5}
"""Nodes along each simulated parameter, by the number of these parameters."""
LOG = 3.0
"""Ratio of the ends of a prior from which a parameter is interpolated in its logarithm."""


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
