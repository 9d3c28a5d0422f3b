"""Tables of samples, in any order, gathered to one labelled dataset over sweep, sample and x."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.ensemble.experiment import Experiment
from stiction.ensemble.table import Failure, Table
from stiction.model import check_memory
from stiction.results import SAMPLE, Variable, coordinate, to_dataset

FAILED = "failed_samples"


@dataclass(frozen=True)
class GridAxis:
    """One axis of a sweep as a dimension of the result.

    Attributes
    ----------
    dim : str
        Its name.
    size : int
    coordinates : mapping of (values, Variable)
        What is swept along it, by name.
    """

    dim: str
    size: int
    coordinates: Mapping[str, tuple[NDArray[Any], Variable]]


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

    Parameters
    ----------
    points : sequence of Experiment
        One for each point, in their order.
    samples, first : int
        Samples of each point.
    only : sequence of str, optional
        Names of the variables to gather; all if left out.

    Attributes
    ----------
    done : (points, samples) array of bool
        Which samples are there.
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
        self.points, self.samples, self.first = points, samples, first
        self.done = np.zeros((len(points), samples), dtype=np.bool_)
        self._failures: dict[tuple[int, int], Failure] = {}
        known = variables_in(points).items()
        self._variables = {name: v for name, v in known if only is None or name in only}
        self._arrays: dict[str, NDArray[Any]] = {}
        self._seen: dict[str, NDArray[np.bool_]] = {}

    def add(self, tables: Sequence[Table]) -> None:
        """Put the rows of tables in their places."""
        for table in tables:
            rows = table.sample - self.first
            inside = (rows >= 0) & (rows < self.samples)
            where = table.point[inside], rows[inside]
            self.done[where] = True
            for failure in table.failures:
                if 0 <= failure.sample - self.first < self.samples:
                    self._failures[failure.point, failure.sample] = failure
            for name in self._variables.keys() & table.values.keys():
                self._put(name, where, table.values[name][inside])

    def _put(self, name: str, where: tuple[Any, Any], array: NDArray[Any]) -> None:
        if name not in self._arrays:
            self._arrays[name] = np.zeros(self.done.shape + array.shape[1:], dtype=array.dtype)
            self._seen[name] = np.zeros(self.done.shape, dtype=np.bool_)
        self._arrays[name][where] = array
        self._seen[name][where] = True

    def _filled(self, name: str) -> NDArray[Any]:
        """The array of a variable, NaN where nothing was put."""
        array, seen = self._arrays[name], self._seen[name]
        if not seen.all():
            if array.dtype.kind != "f":
                array = array.astype(np.float64)
            array[~seen] = np.nan
        return array

    @property
    def dealt_with(self) -> NDArray[np.bool_]:
        """Which samples are there or have failed, (points, samples)."""
        found = self.done.copy()
        for failure in self.failed:
            found[failure.point, failure.sample - self.first] = True
        return found

    @property
    def failed(self) -> list[Failure]:
        """Samples that failed and are not there, in the order of points and samples."""
        found = [self._failures[key] for key in sorted(self._failures)]
        return [f for f in found if not self.done[f.point, f.sample - self.first]]

    def dataset(
        self, attributes: Mapping[str, Any], axes: Sequence[GridAxis] = ()
    ) -> xr.Dataset:
        """Return everything as a dataset, in the order in which the method names it.

        Samples that failed are NaN, and listed in the attribute 'failed_samples'. If others are
        missing too, the attribute 'cut_short' says how many are done.

        Parameters
        ----------
        attributes : mapping
        axes : sequence of GridAxis
            Of the sweep; the product of their sizes is the number of points.
        """
        shape = tuple(axis.size for axis in axes)
        dims = tuple(axis.dim for axis in axes)
        values, variables = {}, {}
        for name, variable in self._variables.items():
            if name in self._arrays:
                array = self._filled(name)
                values[name] = array.reshape(shape + array.shape[1:])
                variables[name] = replace(variable, dims=dims + variable.dims)
        coordinates: dict[str, tuple[NDArray[Any], Variable]] = {}
        for axis in axes:
            coordinates |= axis.coordinates
        coordinates["sample"] = (self.first + np.arange(self.samples), SAMPLE)
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

    def _places(
        self, dim: str, dims: tuple[str, ...], shape: tuple[int, ...]
    ) -> dict[str, tuple[NDArray[Any], Variable]]:
        """Positions along a dimension; if the length is swept, those of each point."""
        found = [coordinate(point.problem.interface, dim) for point in self.points]
        values, meaning = found[0]
        if all(np.array_equal(places, values) for places, _ in found):
            return {dim: found[0]}
        name = "position" if dim == "x" else f"position_{dim}"
        own = replace(meaning, dims=(*dims, dim))
        return {name: (np.reshape([places for places, _ in found], (*shape, -1)), own)}
