"""Tables of samples, in any order, gathered to one labelled dataset over sweep, sample and x."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.batches import NUMBER, POINT, Failure, Table
from stiction.ensemble.experiment import Experiment
from stiction.model import check_memory
from stiction.results import coordinate, to_dataset
from stiction.variables import SAMPLE, Variable

if TYPE_CHECKING:
    import xarray as xr

FAILED = "failed_samples"
Coordinates = dict[str, tuple[NDArray[Any], Variable]]
"""Values and variables of coordinates by name."""


class GridAxis(NamedTuple):
    """One axis of a sweep as a dimension of the result, and what is swept along it."""

    dim: str
    size: int
    coordinates: Coordinates


def distinct(points: Sequence[Experiment], *parts: str) -> list[Experiment]:
    """Return one of the experiments for each combination of these parts, which they share."""
    found: dict[Any, Experiment] = {}
    for one in points:
        found.setdefault(tuple(id(getattr(one, part)) for part in parts), one)
    return list(found.values())


def variables_in(points: Sequence[Experiment]) -> dict[str, Variable]:
    """Return all variables of any point, in the order in which the first method names them."""
    some = distinct(points, "problem", "random", "method")
    return {name: variable for one in some for name, variable in one.variables.items()}


class Gathered:
    """The results of all samples of one or several experiments, in memory.

    `only` names the variables that are gathered. `done`, of shape (points, samples),
    marks the samples that are there.
    """

    def __init__(
        self,
        points: Sequence[Experiment],
        samples: int,
        first: int = 0,
        only: Sequence[str] | None = None,
    ) -> None:
        if only is None:
            largest = max(one.sample_bytes for one in distinct(points, "problem", "method"))
            check_memory("samples", largest * len(points) * samples)
        self.points, self.first, self._only = points, first, only
        self.done = np.zeros((len(points), samples), dtype=np.bool_)
        self._failures: dict[tuple[int, int], Failure] = {}
        self._arrays: dict[str, NDArray[Any]] = {}
        self._offered: dict[str, NDArray[np.bool_]] = {}  # points that have a variable

    def add(self, table: Table) -> None:
        """Put the rows of a table in their places; those of other samples are left out."""
        samples = self.done.shape[1]
        for failure in table.failures:
            if 0 <= failure.sample - self.first < samples:
                self._failures[failure.point, failure.sample - self.first] = failure
        point, sample = table.rows[POINT], table.rows[NUMBER] - self.first
        inside = (sample >= 0) & (sample < samples)
        where = point[inside], sample[inside]
        self.done[where] = True
        for name in {*(table.rows.dtype.names or ())} - {POINT, NUMBER}:
            if self._only is None or name in self._only:
                values = table.rows[name][inside]
                if name not in self._arrays:
                    shape = self.done.shape + values.shape[1:]
                    self._arrays[name] = np.zeros(shape, dtype=values.dtype)
                    self._offered[name] = np.zeros(len(self.points), dtype=np.bool_)
                self._arrays[name][where] = values
                self._offered[name][where[0]] = True

    @property
    def failed(self) -> list[Failure]:
        """Samples that failed and are not there, in the order of points and samples."""
        return [self._failures[at] for at in sorted(self._failures) if not self.done[at]]

    @property
    def dealt_with(self) -> NDArray[np.bool_]:
        """Mask of the samples that are there or have failed, (points, samples)."""
        found = self.done.copy()
        for at in self._failures:
            found[at] = True
        return found

    def dataset(
        self, attributes: Mapping[str, Any], axes: Sequence[GridAxis] = ()
    ) -> xr.Dataset:
        """Return everything as a dataset over the axes of a sweep, the samples and the nodes.

        Samples that failed are NaN, and listed in the attribute 'failed_samples'. If others are
        missing too, the attribute 'cut_short' gives the number that are done.
        """
        shape = tuple(axis.size for axis in axes)
        dims = tuple(axis.dim for axis in axes)
        values, variables = {}, {}
        for name, variable in variables_in(self.points).items():
            if name in self._arrays:
                array = self._arrays[name]
                seen = self.done & self._offered[name][:, None]
                if not seen.all():
                    if array.dtype.kind != "f":
                        array = array.astype(np.float64)
                    array[~seen] = np.nan
                values[name] = array.reshape(shape + array.shape[1:])
                variables[name] = replace(variable, dims=dims + variable.dims)
        coordinates: Coordinates = {}
        for axis in axes:
            coordinates |= axis.coordinates
        samples = self.first + np.arange(self.done.shape[1])
        coordinates["sample"] = (samples, SAMPLE)
        used = {dim for variable in variables.values() for dim in variable.dims}
        for dim in sorted(used & {"x", "y", "direction"}):
            coordinates |= self._places(dim, dims, shape)
        attributes, failed = dict(attributes), self.failed
        made, total = int(self.done.sum()), self.done.size
        if failed:
            attributes[FAILED] = [list(failure) for failure in failed]
        if made + len(failed) < total:
            attributes["cut_short"] = f"{made} of {total} samples are done"
        return to_dataset(values, variables, coordinates, attributes)

    def _places(self, dim: str, dims: tuple[str, ...], shape: tuple[int, ...]) -> Coordinates:
        """Positions along a dimension; if the length is swept, those of each point."""
        values, meaning = coordinate(self.points[0].problem.interface, dim)
        found = [coordinate(point.problem.interface, dim)[0] for point in self.points]
        if all(np.array_equal(places, values) for places in found):
            return {dim: (values, meaning)}
        name = "position" if dim == "x" else f"position_{dim}"
        own = replace(meaning, dims=(*dims, dim))
        return {name: (np.reshape(found, (*shape, -1)), own)}
