"""The local criterion with what the Monte Carlo figure needs besides the onset of each sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from stiction._jit import jit
from stiction._model import model
from stiction._typing import Array
from stiction.criterion.method import LocalCriterion
from stiction.criterion.moving_average import average_rows
from stiction.criterion.nucleation import multiplier_of
from stiction.problem import Problem
from stiction.results import Variable
from stiction.sample import Sample

STATIONS = 64


@model(kw_only=True)
class CriterionWithMoments:
    """Local criterion that also keeps minimum strength and moments of the nucleation stress.

    Parameters
    ----------
    reference : float
        Pa; moments of tau_n are taken about it, to keep their digits.
    """

    reference: float
    type: Literal["criterion_with_moments"] = "criterion_with_moments"

    @property
    def label(self) -> str:
        """Its name in figures and tables."""
        return "local criterion"

    @property
    def chunk_size(self) -> int:
        """Samples that make a good piece of work in an ensemble."""
        return 1024

    def seconds_per_sample(self, problem: Problem) -> float:
        """About how long a sample takes on one core, s."""
        return LocalCriterion().seconds_per_sample(problem)

    def supports(self, problem: Problem) -> list[str]:
        """Reasons why it cannot take a problem; none if it can."""
        return LocalCriterion().supports(problem)

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Those of the local criterion and what is kept besides."""
        return {
            **LocalCriterion().variables(problem),
            "weakest_strength": Variable("Pa", "smallest peak strength of the sample"),
            "weakest_position": Variable("m", "position of the weakest node"),
            "largest_nucleation_stress": Variable("Pa", "largest nucleation stress of the sample"),
            "nucleation_moments": Variable(
                "1",
                "mean over x of (tau_n/reference - 1)^m, m = 1, 2, 3",
                ("sample", "order"),
            ),
            "nucleation_stress": Variable(
                "Pa", "nucleation stress at evenly spaced stations", ("sample", "station")
            ),
        }

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, Array]]:
        """A solver for rows of this problem, without initial stress and with a uniform load."""
        onset = LocalCriterion().prepare(problem)
        multiplier = multiplier_of(problem, problem.nucleation_length)
        every = max(problem.interface.size // STATIONS, 1)

        def solve(rows: Sample) -> dict[str, Array]:
            tau_n = np.empty((rows.samples, problem.interface.size))
            strength = np.ascontiguousarray(rows.strength)
            average_rows(strength, multiplier, tau_n)
            numbers = np.empty((rows.samples, 6))
            _observe(strength, tau_n, self.reference, numbers)
            return {
                **onset(rows),
                "weakest_strength": numbers[:, 0],
                "weakest_position": numbers[:, 1] * problem.interface.spacing,
                "largest_nucleation_stress": numbers[:, 2],
                "nucleation_moments": numbers[:, 3:],
                "nucleation_stress": tau_n[:, ::every],
            }

        return solve


@jit
def _observe(strength: Array, tau_n: Array, reference: float, out: Array) -> None:
    """Of each row: weakest strength and its node, largest tau_n, and three moments of tau_n."""
    nodes = strength.shape[1]
    for row in range(strength.shape[0]):
        weakest, where, largest = strength[row, 0], 0, tau_n[row, 0]
        first, second, third = 0.0, 0.0, 0.0
        for i in range(nodes):
            if strength[row, i] < weakest:
                weakest, where = strength[row, i], i
            largest = max(largest, tau_n[row, i])
            d = tau_n[row, i] / reference - 1.0
            first += d
            second += d * d
            third += d * d * d
        out[row, 0], out[row, 1], out[row, 2] = weakest, where, largest
        out[row, 3], out[row, 4], out[row, 5] = first / nodes, second / nodes, third / nodes
