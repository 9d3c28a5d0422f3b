"""The experiments at all points of a sweep: made on demand, each part of them once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, overload

from stiction.ensemble.experiment import Experiment
from stiction.results import Variable

PARTS_KEPT = 2048


class Points(Sequence[Experiment]):
    """One experiment for each point of a sweep, none of them kept: a sweep may have 1e5 points.

    Parameters
    ----------
    keys : sequence of tuples of str
        The dotted keys that vary along each axis.
    sizes : sequence of int
        Steps of each axis; the last one runs fastest.
    names : sequence of str
        Parts of a study: what dotted keys begin with.
    part : callable
        Gets the name of a part and the steps of the axes (that touch no other part at all: 0) and
        returns the part there.
    make : callable
        Gets all parts by name and returns the experiment.
    """

    def __init__(
        self,
        keys: Sequence[Sequence[str]],
        sizes: Sequence[int],
        names: Sequence[str],
        part: Callable[[str, tuple[int, ...]], Any],
        make: Callable[[Mapping[str, Any]], Experiment],
    ) -> None:
        self._keys, self._sizes, self._names, self._make = keys, sizes, names, make
        self._touching = {name: self._axes_of((name,)) for name in names}
        self._part = lru_cache(maxsize=PARTS_KEPT)(part)

    def _axes_of(self, prefixes: Sequence[str]) -> list[int]:
        """Axes with a key that lies in one of these parts, or contains it."""

        def touches(key: str, prefix: str) -> bool:
            return f"{key}.".startswith(f"{prefix}.") or f"{prefix}.".startswith(f"{key}.")

        return [
            axis
            for axis, keys in enumerate(self._keys)
            if any(touches(key, prefix) for key in keys for prefix in prefixes)
        ]

    def __len__(self) -> int:
        return math.prod(self._sizes)

    @overload
    def __getitem__(self, number: int) -> Experiment: ...
    @overload
    def __getitem__(self, number: slice) -> list[Experiment]: ...
    def __getitem__(self, number: int | slice) -> Experiment | list[Experiment]:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        if not -len(self) <= number < len(self):
            raise IndexError(number)
        return self._make(self.parts(int(number) % len(self)))

    def parts(self, number: int) -> dict[str, Any]:
        """The parts of a point."""
        steps = [0] * len(self._sizes)
        for axis in range(len(self._sizes) - 1, -1, -1):
            number, steps[axis] = divmod(number, self._sizes[axis])
        return {
            name: self._part(
                name, tuple(s if axis in touching else 0 for axis, s in enumerate(steps))
            )
            for name, touching in self._touching.items()
        }

    def differing_in(self, *prefixes: str) -> list[Experiment]:
        """Return one experiment for each combination of what is swept in these parts."""
        axes = self._axes_of(prefixes)
        numbers = [0]
        for axis in axes:
            stride = math.prod(self._sizes[axis + 1 :])
            numbers = [n + step * stride for n in numbers for step in range(self._sizes[axis])]
        return [self[number] for number in numbers]


def differing_in(points: Sequence[Experiment], *prefixes: str) -> Sequence[Experiment]:
    """Points among which everything occurs that these parts of a study are at any point."""
    return points.differing_in(*prefixes) if isinstance(points, Points) else points


def variables_in(points: Sequence[Experiment]) -> dict[str, Variable]:
    """All variables of any point, in the order in which the first one's method names them."""
    some = differing_in(points, "method", "problem.load")
    return {name: variable for point in some for name, variable in point.variables.items()}
