"""Simulated onsets on a grid of those parameters that need simulation, with the same draws."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.monte_carlo import check_fields
from stiction.errors import InputError
from stiction.inference.affine import Affine
from stiction.inference.prior import Prior
from stiction.interface import Interface
from stiction.methods import refusals
from stiction.progress import Meter
from stiction.random.synthesis import BLOCK

NODES = {0: 1, 1: 25, 2: 11, 3: 7, 4: 5}
"""Nodes along each parameter that is simulated, by how many there are."""
LOG = 3.0
"""Parameters whose prior spans this ratio or more are interpolated in their logarithm."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Nodes of one simulated parameter.

    Attributes
    ----------
    parameter : int
        Its place in the prior.
    values : (nodes,) array
        Of the parameter, rising.
    log : bool
        Whether to interpolate in the logarithm.
    """

    parameter: int
    values: Array
    log: bool

    def place(self, theta: Array) -> tuple[NDArray[np.int64], Array]:
        """The node below each value (points,), and the share of the way to the next."""
        if self.values.size == 1:
            return np.zeros(theta.size, dtype=np.int64), np.zeros(theta.size)
        nodes, at = (np.log(self.values), np.log(theta)) if self.log else (self.values, theta)
        cell = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, nodes.size - 2)
        share = (at - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
        return cell, np.clip(share, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class OnsetTable:
    """Onsets of the same samples at every node.

    Attributes
    ----------
    axes : tuple of Axis
    peaks : (nodes, samples) array
        Stress (Pa) or coefficient of friction; nodes in C order of the axes.
    places : (nodes, samples) array
        Critical position, m.
    """

    axes: tuple[Axis, ...]
    peaks: Array
    places: Array

    def corners(self, theta: Array) -> tuple[NDArray[np.int64], Array]:
        """Nodes around points (points, parameters) and their weights, (points, 2^axes) each."""
        count = theta.shape[0]
        index, weight = np.zeros((count, 1), dtype=np.int64), np.ones((count, 1))
        for axis in self.axes:
            cell, share = axis.place(theta[:, axis.parameter])
            size = axis.values.size
            upper = np.minimum(cell + 1, size - 1)
            index = np.concatenate([index * size + cell[:, None], index * size + upper[:, None]], 1)
            weight = np.concatenate([weight * (1.0 - share)[:, None], weight * share[:, None]], 1)
        return index, weight


def make_axes(prior: Prior, affine: Affine, low: Array, high: Array) -> tuple[Axis, ...]:
    """Nodes of the parameters that need simulation, between two corners `low`, `high` (as u).

    Raises
    ------
    InputError
        If there are too many of them.
    """
    simulated = [i for i in range(prior.dimension) if i not in affine.keys]
    if len(simulated) not in NODES:
        names = ", ".join(prior.names[i] for i in simulated)
        why = f" ({affine.reason})" if affine.reason else ""
        raise InputError(
            f"prior: {len(simulated)} parameters would have to be simulated on a grid, {names}"
            f"{why}; at most {max(NODES)} are possible: give the best known a value"
        )
    ends = prior.theta(np.array([low, high]))
    axes = []
    for i in simulated:
        first, last = ends[:, i]
        log = bool(first > 0.0 and last >= LOG * first)
        space = np.geomspace if log else np.linspace
        axes.append(Axis(i, space(first, last, NODES[len(simulated)]), log))
    return tuple(axes)


def thetas_of(axes: Sequence[Axis], reference: Array) -> Array:
    """Parameters at all nodes, (nodes, parameters); affine ones are at their reference."""
    steps = list(itertools.product(*(axis.values for axis in axes)))
    result = np.tile(reference, (len(steps), 1))
    for row, step in zip(result, steps, strict=True):
        for axis, value in zip(axes, step, strict=True):
            row[axis.parameter] = value
    return result


def with_length(problem: Any, length: float) -> Any:
    """The problem of a specimen of another length, m, with the same distance of nodes.

    Raises
    ------
    InputError
        If it is a plane, or has profiles, which belong to its own length.
    """
    own = problem.interface
    if not own.is_plane and np.isclose(length, own.extent, rtol=1e-9):
        return problem
    if own.is_plane:
        raise InputError("peaks: lengths of specimens are of lines; the interface is a plane")
    nodes = 2 * max(4, round(0.5 * length / own.spacing))
    try:
        return replace(problem, interface=Interface(length, nodes))
    except InputError as error:
        raise InputError(
            [f"peaks: a specimen of {length:g} m: {t}" for t in error.problems]
        ) from None


def simulate(
    prior: Prior,
    thetas: Array,
    *,
    method: Any,
    length: float | None,
    samples: int,
    first: int,
    seed: int,
    variable: str,
    meter: Meter,
) -> tuple[Array, Array]:
    """Onset and position of samples first, ... at some points, (points, samples) each.

    Sample i has the same draws at every point.
    """
    plans = []
    for theta in thetas:
        problem, random = prior.at(theta)
        problem = problem if length is None else with_length(problem, length)
        plans.append(Experiment(problem, random, method, seed=seed))
    check_points(prior, thetas, plans)
    peaks = np.empty((len(plans), samples))
    places = np.full((len(plans), samples), np.nan)
    jobs = [
        (point, start, count)
        for point, plan in enumerate(plans)
        for start, count in plan.batches(first, samples, max(BLOCK, plan.batch))
    ]

    def work(job: tuple[int, int, int]) -> None:
        point, start, count = job
        values = plans[point].results(seed, start, count)
        part = slice(start - first, start - first + count)
        peaks[point, part] = values[variable]
        position = np.asarray(values["critical_position"])
        if position.ndim == 1:
            places[point, part] = position
        meter.advance(count)

    with ThreadPoolExecutor(usable_cores()) as pool:
        list(pool.map(work, jobs))
    return peaks, places


def check_points(prior: Prior, thetas: Array, plans: Sequence[Experiment]) -> None:
    """Refuse points that the method cannot take, and warn of what is inaccurate at the ends."""
    for theta, plan in zip(thetas, plans, strict=True):
        try:
            plan.random.dimension(plan.problem.interface)
            refused = refusals(plan.problem, plan.method)
        except InputError as error:
            refused = list(error.problems)
        if refused:
            raise InputError([f"prior: at {prior.text(theta)}: {text}" for text in refused])
    check_fields([plans[0], plans[-1]])
