"""What an ensemble is, and what sample i of it is, whoever computes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.fields.random_field import RandomField
from stiction.methods import Method, Values, solve
from stiction.problem import Problem

STREAMS = {"residual_strength": 1, "initial_stress": 2, "weakening_rate": 3}
"""What may be random besides the strength (stream 0); streams are independent of each other."""


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
    """

    problem: Problem
    strength: RandomField
    method: Any
    seed: int
    fields: tuple[tuple[str, RandomField], ...] = field(default=())
    keep: tuple[str, ...] = ()

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


@lru_cache(maxsize=8)
def _solver(problem: Problem, method: Method) -> Any:
    return method.prepare(problem)


def compute(plan: Plan, first: int, samples: int) -> Values:
    """Results of samples first .. first + samples - 1; a plain function, for any executor."""
    profiles = plan.profiles(first, samples)
    extras: Mapping[str, Any] = {name: profiles[name] for name, _ in plan.fields}
    rows = plan.problem.rows(profiles["strength"], **extras)
    solver = _solver(plan.problem, plan.method)
    values = solve(plan.problem, plan.method, solver, rows)
    return values | {name: profiles[name] for name in plan.keep}


def chunks(samples: int, size: int, first: int = 0) -> Iterator[tuple[int, int]]:
    """Cut samples first .. first + samples - 1 into (first, samples), at multiples of `size`."""
    start, end = first, first + samples
    while start < end:
        stop = min(end, (start // size + 1) * size)
        yield start, stop - start
        start = stop
