"""The local criterion as a method."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from stiction.arrays import Array
from stiction.criterion.assumptions import excess_of, refused_laws, uniform_rates, warn_if_coarse
from stiction.criterion.moving_average import minimum_rows
from stiction.criterion.nucleation import Weights, multiplier_of
from stiction.criterion.plane import PlaneSolver, own_variables
from stiction.model import model
from stiction.problem import Problem
from stiction.results import Variable, onset_variables
from stiction.sample import Sample


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
    Of a friction law that is not linear the weakening rate at zero slip counts, with an
    `AccuracyWarning`: strength that falls ever less steeply lets go later. A law that steepens
    is refused.

    On a plane the average is over critical ellipses of five shapes, each the smallest on which the
    stiffness K - W of the discrete problem is unstable, with its eigenvector as the weight; the
    minimum is taken over nodes and shapes. Beside the variables of every method there are then
    `critical_aspect`, `critical_patch_extent` (m, along x and y) and `critical_patch_area` (m²) of
    the ellipse that decided.

    Examples
    --------
    >>> import stiction as st
    >>> st.LocalCriterion().supports(st.paper.problem(nodes=512))  # nothing speaks against it
    []
    """

    weights: Weights = "exact"
    type: Literal["local_criterion"] = "local_criterion"

    @property
    def chunk_size(self) -> int:
        """Samples that make a good piece of work in an ensemble."""
        return 1024

    @property
    def label(self) -> str:
        """Its name in figures and tables."""
        return "local criterion"

    def seconds_per_sample(self, problem: Problem) -> float:
        """About how long a sample takes on one core, s."""
        return (3e-8 if not problem.interface.is_plane else 6e-8) * problem.interface.size

    def supports(self, problem: Problem) -> list[str]:
        """Reasons why it cannot take a problem; none if it can."""
        reasons = refused_laws(problem)
        if problem.interface.is_plane and self.weights != "exact":
            reasons.append(
                f"weights = {self.weights!r} are those of a line; on a plane leave them 'exact'"
            )
        rate = problem.friction.weakening_rate
        if rate is not None and problem.uniform_rate is None:
            reasons.append(
                "friction.weakening_rate varies along the interface, so there is no one"
                " nucleation length; use st.Equilibrium() or st.Rupture()"
            )
        return reasons

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """What the solver returns for each sample."""
        own = own_variables(problem) if problem.interface.is_plane else {}
        return onset_variables(problem.interface) | own

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, Array]]:
        """A solver for rows of this problem.

        Raises
        ------
        InputError
            From the solver: if the weakening rate varies along the interface, or h_n is longer
            than the interface, or a critical ellipse does not fit on the plane.
        """
        if problem.interface.is_plane:
            return PlaneSolver(problem)
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

        def solve(rows: Sample) -> dict[str, Array]:
            warn_if_coarse(problem, rows)
            rates = uniform_rates(rows)
            excess = excess_of(rows)
            load, place = np.empty(rows.samples), np.empty(rows.samples)
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
                "critical_position": place * problem.interface.spacing,
            }

        return solve
