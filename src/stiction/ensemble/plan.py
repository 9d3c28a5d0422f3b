"""What an ensemble is, and what sample i of it is, whoever computes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.fields.draws import BLOCK
from stiction.fields.random_field import RandomField
from stiction.methods import Method, Values, accepted, solve, variables_of
from stiction.problem import Problem
from stiction.results import Variable

STREAMS = {"residual_strength": 1, "initial_stress": 2, "weakening_rate": 3}
"""What may be random besides the strength (stream 0); streams are independent of each other."""

PROFILES: dict[str, Variable] = {
    "strength": Variable("Pa", "peak strength", ("sample", "x")),
    "residual_strength": Variable("Pa", "residual strength", ("sample", "x")),
    "initial_stress": Variable("Pa", "initial stress", ("sample", "x")),
    "weakening_rate": Variable("Pa m-1", "weakening rate", ("sample", "x")),
}
"""Sampled profiles that may be kept."""

SLOW = 32


@dataclass(frozen=True)
class Plan:
    """An ensemble: the numbers of sample i follow from this and i alone.

    Attributes
    ----------
    problem, strength, method
    seed : int
    fields : tuple of (str, RandomField)
        What is random besides the strength, by keyword.
    keep : tuple of str
        Fields whose sampled profiles are kept beside the results; 'strength' among them.
    keep_samples : tuple of int, optional
        Samples whose profiles are kept; all if None.
    """

    problem: Problem
    strength: RandomField
    method: Any
    seed: int
    fields: tuple[tuple[str, RandomField], ...] = field(default=())
    keep: tuple[str, ...] = ()
    keep_samples: tuple[int, ...] | None = None

    @property
    def variables(self) -> dict[str, Variable]:
        """All that `compute` returns."""
        kept = {name: PROFILES[name] for name in self.keep if name in PROFILES}
        return variables_of(self.problem, self.method) | kept

    @property
    def wide(self) -> tuple[str, ...]:
        """The variables that have more than one number a sample."""
        return tuple(name for name, v in self.variables.items() if len(v.dims) > 1)

    @property
    def piece(self) -> int:
        """Samples solved at once, as the method likes it."""
        size = int(getattr(self.method, "chunk_size", BLOCK))
        # Draws come in blocks: a part of one costs as much as the whole, which fast methods feel.
        return size if size < SLOW else max(size, BLOCK)

    def profiles(self, first: int, samples: int) -> dict[str, NDArray[np.float64]]:
        """The random profiles of samples first .. first + samples - 1, by name."""
        interface = self.problem.interface
        named = {"strength": self.strength, **dict(self.fields)}
        return {
            name: field.profiles(
                interface,
                field.draws(interface, samples, self.seed, first, stream=STREAMS.get(name, 0)),
            )
            for name, field in named.items()
        }

    def wide_rows(self, samples: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of these samples keep their wide variables."""
        if self.keep_samples is None:
            return np.ones(samples.size, dtype=np.bool_)
        return np.isin(samples, self.keep_samples)


@lru_cache(maxsize=8)
def _solver(problem: Problem, method: Method) -> Any:
    return method.prepare(problem)


def compute(plan: Plan, first: int, samples: int) -> Values:
    """Results of samples first .. first + samples - 1; a plain function, for any executor."""
    profiles = plan.profiles(first, samples)
    extras: Mapping[str, Any] = {name: profiles[name] for name, _ in plan.fields}
    accept = (*accepted(plan.method), "constant")  # of which `check_residual` has warned
    rows = plan.problem.rows(profiles["strength"], **extras, accept=accept)
    solver = _solver(plan.problem, plan.method)
    values = solve(plan.problem, plan.method, solver, rows)
    return values | {name: profiles[name] for name in plan.keep if name in PROFILES}


def chunks(samples: int, size: int, first: int = 0) -> Iterator[tuple[int, int]]:
    """Cut samples first .. first + samples - 1 into (first, samples), at multiples of `size`."""
    start, end = first, first + samples
    while start < end:
        stop = min(end, (start // size + 1) * size)
        yield start, stop - start
        start = stop
