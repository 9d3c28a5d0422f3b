"""Gather tables of samples, in any order, into a dataset over sweep, sample and x."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stiction.base.model import check_memory, describe
from stiction.base.variables import DIRECTION, SAMPLE, Variable
from stiction.ensemble.batches import NUMBER, POINT, Failure, Table
from stiction.ensemble.experiment import Experiment
from stiction.problem.results import to_dataset

if TYPE_CHECKING:
    import xarray as xr

Coordinates: TypeAlias = dict[str, tuple[NDArray[Any], Variable]]
"""Values and variables of coordinates by name."""
GridAxes: TypeAlias = Mapping[str, Coordinates]
"""Coordinates of each dimension of a sweep. The first has the name of
the dimension."""


def distinct(points: Sequence[Experiment], *parts: str) -> list[Experiment]:
    """Return one experiment for each distinct combination of the named parts."""
    first: dict[Any, Experiment] = {}
    for point in points:
        first.setdefault(tuple(id(getattr(point, part)) for part in parts), point)
    return list(first.values())


def variables_in(points: Sequence[Experiment]) -> dict[str, Variable]:
    """Return all variables that any point has, in the order of the methods."""
    some = distinct(points, "problem", "random", "method")
    return {name: variable for point in some for name, variable in point.variables.items()}


class Gathered:
    """The results of all samples in one or more experiments, in memory.

    `only` names the variables to gather. `done`, with shape (points,
    samples), marks the gathered samples.
    """

    def __init__(
        self, points: Sequence[Experiment], samples: int, only: Sequence[str] | None = None
    ) -> None:
        if only is None:
            largest = max(point.sample_bytes for point in distinct(points, "problem", "method"))
            check_memory("samples", largest * len(points) * samples)
        self.points, self._only = points, only
        self.done = np.zeros((len(points), samples), dtype=np.bool_)
        self._failures: dict[tuple[int, int], Failure] = {}
        self._arrays: dict[str, NDArray[Any]] = {}  # floats, NaN without a value
        self._types: dict[str, np.dtype[Any]] = {}

    def misfit(self, table: Table) -> str:
        """Return a message about a table that cannot belong to these points, or ''."""
        pairs = [failure[:2] for failure in table.failures]
        failed = np.array(pairs, dtype=object).reshape(-1, 2)
        # Numbers of failures may be anything in a stranger's file, so
        # they are objects.
        for points, samples in ((table.columns[POINT], table.columns[NUMBER]), failed.T):
            known = (points >= 0) & (points < len(self.points)) & (samples >= 0)
            if not np.all(known):
                return "a point or a sample is not in the study"
        variables, interface = variables_in(self.points), self.points[0].problem.interface
        sizes = dict(zip(interface.dims, interface.shape, strict=True))
        sizes[DIRECTION] = len(interface.dims)
        for name in table.columns.keys() - {POINT, NUMBER}:
            if name not in variables:
                return f"{describe(name)} is not a variable of the study"
            dims, shape = variables[name].dims[1:], table.columns[name].shape[1:]
            right = [sizes.get(dim, size) for dim, size in zip(dims, shape, strict=False)]
            if len(shape) != len(dims) or [*shape] != right:
                return f"{name} has shape {shape} for each sample"
        return ""

    def add(self, table: Table) -> None:
        """Put each row of a table in its place. Ignore other samples."""
        # The folder of a run may hold more samples than are gathered.
        for failure in table.failures:
            if failure.sample < self.done.shape[1]:
                self._failures[failure.point, failure.sample] = failure
        point, sample = table.columns[POINT], table.columns[NUMBER]
        inside = sample < self.done.shape[1]
        where = point[inside], sample[inside]
        self.done[where] = True
        for name in table.columns.keys() - {POINT, NUMBER}:
            if self._only is None or name in self._only:
                values = table.columns[name][inside]
                # The type and the shape of a variable are known from
                # its first table.
                if name not in self._arrays:
                    self._types[name] = values.dtype
                    self._arrays[name] = np.full(self.done.shape + values.shape[1:], np.nan)
                self._arrays[name][where] = values

    @property
    def onsets(self) -> NDArray[Any]:
        """Critical stress, Pa, with shape (points, samples), or NaN without a value."""
        return self._arrays.get("critical_stress", np.full(self.done.shape, np.nan))

    @property
    def failed(self) -> list[Failure]:
        """Missing samples that failed, in the order of points and samples."""
        return [self._failures[at] for at in sorted(self._failures) if not self.done[at]]

    def dataset(
        self, attributes: Mapping[str, Any], axes: GridAxes = MappingProxyType({})
    ) -> xr.Dataset:
        """Return a dataset over the sweep axes, the samples and the nodes.

        Missing values are NaN. The attributes 'failed_samples' and
        'cut_short' state the cause.
        """
        variables, values, dims = variables_in(self.points), {}, tuple(axes)
        shape = tuple(len(axes[dim][dim][0]) for dim in dims)
        for name in [name for name in variables if name in self._arrays]:
            array, kind = self._arrays[name], self._types[name]
            # Whole numbers and flags cannot be NaN. They remain
            # floats if any is missing.
            if kind.kind == "f" or not np.isnan(array).any():
                array = array.astype(kind, copy=False)
            values[name] = array.reshape(shape + array.shape[1:])
        swept = {name: replace(v, dims=dims + v.dims) for name, v in variables.items()}
        coordinates = {k: v for of_dim in axes.values() for k, v in of_dim.items()}
        coordinates["sample"] = np.arange(self.done.shape[1]), SAMPLE
        attributes, failed, made = dict(attributes), self.failed, int(self.done.sum())
        if failed:
            attributes["failed_samples"] = failed
        if made + len(failed) < self.done.size:
            attributes["cut_short"] = f"{made} of {self.done.size} samples are done"
        interface = self.points[0].problem.interface
        return to_dataset(values, swept, coordinates, attributes, interface)
