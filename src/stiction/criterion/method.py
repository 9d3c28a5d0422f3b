"""The local criterion as a method."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from stiction._model import model
from stiction._typing import Array
from stiction.criterion.moving_average import minimum_rows
from stiction.criterion.nucleation import (
    Weights,
    excess_of,
    multiplier_of,
    uniform_rates,
    warn_if_coarse,
)
from stiction.problem import Problem
from stiction.results import ONSET_VARIABLES, Variable
from stiction.rows import Rows


@model(kw_only=True)
class LocalCriterion:
    """Onset at the minimum of the nucleation stress: each patch on its own, in microseconds.

    An upper bound of the exact equilibrium onset (up to discretisation): patches that interact
    only let go earlier. Nothing is assumed to be arrested, so `first_instability` and
    `critical_stress` are equal.

    Parameters
    ----------
    weights : {"exact", "rounded"}
        The exact eigenfunction, or the rounded one printed by Albertini et al. (2020, Eq. 9).

    Notes
    -----
    The weights of the average are never negative, so the result lies between the least and the
    greatest strength also where the strength jumps. The minimum is taken between the nodes.
    """

    weights: Weights = "exact"
    type: Literal["local_criterion"] = "local_criterion"

    @property
    def chunk_size(self) -> int:
        """Samples that make a good piece of work in an ensemble."""
        return 1024

    @property
    def variables(self) -> dict[str, Variable]:
        """What the solver returns for each sample."""
        return dict(ONSET_VARIABLES)

    def prepare(self, problem: Problem) -> Callable[[Rows], dict[str, Array]]:
        """A solver for rows of this problem.

        Raises
        ------
        InputError
            From the solver: if the weakening rate varies along the interface, or h_n is longer
            than the interface.
        """
        multipliers: dict[float, tuple[Array, int]] = {}

        def multiplier(rate: float) -> tuple[Array, int]:
            found = multipliers.get(rate)
            if found is None:
                length = problem.nucleation_length_of(rate)
                reach = math.ceil(0.5 * length / problem.interface.spacing) + 2
                found = multiplier_of(problem, length, self.weights), reach
                if len(multipliers) < 64:  # random rates: every sample has its own
                    multipliers[rate] = found
            return found

        def solve(rows: Rows) -> dict[str, Array]:
            warn_if_coarse(problem, rows)
            rates = uniform_rates(rows)
            excess = excess_of(rows)
            load, place = np.empty(rows.count), np.empty(rows.count)
            for rate in np.unique(rates):
                same = rates == rate
                table, reach = multiplier(float(rate))
                lowest, where = np.empty(np.sum(same)), np.empty(np.sum(same))
                some = excess if same.all() else excess[same]
                minimum_rows(some, rows.load_profile, table, reach, lowest, where)
                load[same], place[same] = lowest, where
            stress = rows.mean_stress(load)
            return {
                "critical_load": load,
                "critical_stress": stress,
                "first_instability": stress.copy(),
                "critical_position": place * rows.spacing,
            }

        return solve
