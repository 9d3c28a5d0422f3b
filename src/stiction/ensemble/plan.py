"""What an ensemble is, and what sample i of it is, whoever computes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.methods import Method, Values, accepted, solve, variables_of
from stiction.problem import Problem
from stiction.random.coefficients import profiles_in_stress
from stiction.random.draws import block_of
from stiction.random.random_interface import RandomInterface
from stiction.results import Variable, along
from stiction.sample import PROFILES, Sample

SLOW = 32
MOST_NODES = 1 << 20
"""Nodes of all samples of planes that are solved at once: 8 MiB for each profile."""


@dataclass(frozen=True)
class Plan:
    """An ensemble: the numbers of sample i follow from this and i alone.

    Attributes
    ----------
    problem, random, method
    seed : int
    keep : tuple of str
        What is kept along the interface: sampled profiles by name, and what the method adds.
    keep_samples : tuple of int, optional
        Samples whose profiles are kept; all if None.
    """

    problem: Problem
    random: RandomInterface
    method: Any
    seed: int
    keep: tuple[str, ...] = ()
    keep_samples: tuple[int, ...] | None = None

    @property
    def variables(self) -> dict[str, Variable]:
        """All that `compute` returns."""
        interface, names = self.problem.interface, self.random.names
        kept = {name: along(interface, PROFILES[name]) for name in self.keep if name in names}
        return variables_of(self.problem, self.method, "normal_pressure" in names) | kept

    @property
    def wide(self) -> tuple[str, ...]:
        """The variables that have a number at each node."""
        return tuple(name for name, v in self.variables.items() if v.wide)

    @property
    def piece(self) -> int:
        """Samples solved at once, as the method likes it; of planes no more than memory likes."""
        interface, size = self.problem.interface, int(self.method.chunk_size)
        block = block_of(len(interface.shape))
        if block == 1:
            return max(1, min(size, MOST_NODES // interface.size))
        # Draws come in blocks: a part of one costs as much as the whole, which fast methods feel.
        return size if size < SLOW else max(size, block)

    def profiles(self, first: int, samples: int) -> dict[str, Array]:
        """The random profiles of samples first .. first + samples - 1, by name."""
        found = self.random.profiles(
            self.problem.interface, samples=samples, seed=self.seed, first=first
        )
        return profiles_in_stress(self.problem, self.random, found)

    def wide_rows(self, samples: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of these samples keep their wide variables."""
        if self.keep_samples is None:
            return np.ones(samples.size, dtype=np.bool_)
        return np.isin(samples, self.keep_samples)


@lru_cache(maxsize=8)
def _solver(problem: Problem, method: Method) -> Any:
    return method.prepare(problem)


def sample_of(problem: Problem, method: Method, profiles: Mapping[str, Array]) -> Sample:
    """Random profiles as a method takes them."""
    # `check_residual` has warned of nodes of constant strength.
    return problem.sample(profiles, accept=(*accepted(method), "constant"))


def compute(plan: Plan, first: int, samples: int) -> Values:
    """Results of samples first .. first + samples - 1; a plain function, for any executor."""
    profiles = plan.profiles(first, samples)
    sample = sample_of(plan.problem, plan.method, profiles)
    values = solve(_solver(plan.problem, plan.method), sample)
    return values | {name: profiles[name] for name in plan.keep if name in profiles}


def chunks(samples: int, size: int, first: int = 0) -> Iterator[tuple[int, int]]:
    """Cut samples first .. first + samples - 1 into (first, samples), at multiples of `size`."""
    start, end = first, first + samples
    while start < end:
        stop = min(end, (start // size + 1) * size)
        yield start, stop - start
        start = stop
