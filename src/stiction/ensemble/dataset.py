"""Tables of samples, in any order, gathered to one labelled dataset over sweep, sample and x."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.ensemble.experiment import Experiment
from stiction.ensemble.points import differing_in, variables_in
from stiction.ensemble.table import Failure, Table
from stiction.errors import warn_accuracy
from stiction.model import check_memory
from stiction.results import SAMPLE, Variable, coordinate, to_dataset

FAILED = "failed_samples"
KEPT_SAMPLE = Variable("1", "number of the sample whose profiles are kept", ("kept_sample",))
SHOWN = 3


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
    failures : dict of Failure
        By point and sample.
    """

    def __init__(
        self,
        points: Sequence[Experiment],
        samples: int,
        first: int = 0,
        only: Sequence[str] | None = None,
    ) -> None:
        self.points, self.samples, self.first = points, samples, first
        self.done = np.zeros((len(points), samples), dtype=np.bool_)
        self.failures: dict[tuple[int, int], Failure] = {}
        kept = points[0].keep_samples
        self._kept = None
        if kept is not None:
            inside = [sample for sample in kept if first <= sample < first + samples]
            self._kept = np.array(sorted(inside), dtype=np.int64)
        self._variables: dict[str, Variable] = {}
        for name, variable in variables_in(points).items():
            if only is None or name in only:
                wide = variable.wide and kept is not None
                dims = ("kept_sample", *variable.dims[1:]) if wide else variable.dims
                self._variables[name] = replace(variable, dims=dims)
        narrow = sum(not variable.wide for variable in self._variables.values())
        check_memory("samples", 9.0 * len(points) * samples * narrow)
        self._arrays: dict[str, NDArray[Any]] = {}
        self._seen: dict[str, NDArray[np.bool_]] = {}

    def add(self, table: Table) -> None:
        """Put the rows of a table in their places."""
        rows = table.sample - self.first
        inside = (rows >= 0) & (rows < self.samples)
        where = table.point[inside], rows[inside]
        self.done[where] = True
        for failure in table.failures:
            self.failures[failure.point, failure.sample] = failure
        for name, array in table.values.items():
            self._put(name, where, array[inside], self.samples)
        rows = table.wide_sample - self.first
        inside = (rows >= 0) & (rows < self.samples)
        length = self.samples
        if self._kept is not None:
            inside = np.isin(table.wide_sample, self._kept)
            rows = np.searchsorted(self._kept, table.wide_sample)
            length = self._kept.size
        where = table.wide_point[inside], rows[inside]
        for name, array in table.wide.items():
            self._put(name, where, array[inside], length)

    def save(self, *, now: bool = False) -> None:
        """Do nothing: everything is in memory."""

    def _put(self, name: str, where: tuple[Any, Any], array: NDArray[Any], length: int) -> None:
        if name not in self._variables:
            return
        if name not in self._arrays:
            shape = (len(self.points), length)
            self._arrays[name] = np.zeros((*shape, *array.shape[1:]), dtype=array.dtype)
            self._seen[name] = np.zeros(shape, dtype=np.bool_)
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
    def failed(self) -> list[Failure]:
        """Samples that failed and are not there, in the order of points and samples."""
        found = [self.failures[key] for key in sorted(self.failures)]
        return [f for f in found if not self.done[f.point, f.sample - self.first]]

    def dataset(self, attributes: Mapping[str, Any], axes: Sequence[GridAxis] = ()) -> xr.Dataset:
        """Return everything as a dataset, in the order in which the method names it.

        Samples that failed are NaN, and listed in the attribute 'failed_samples'.

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
        if "kept_sample" in used and self._kept is not None:
            coordinates["kept_sample"] = (self._kept, KEPT_SAMPLE)
        for dim in sorted(used & {"x", "y", "direction"}):
            coordinates |= self._places(dim, dims, shape)
        failed = self.failed
        if failed:
            attributes = {**attributes, FAILED: [list(failure) for failure in failed]}
        return to_dataset(values, variables, coordinates, attributes)

    def _places(
        self, dim: str, dims: tuple[str, ...], shape: tuple[int, ...]
    ) -> dict[str, tuple[NDArray[Any], Variable]]:
        """Positions along a dimension; if the length is swept, those of each point."""
        some = differing_in(self.points, "problem.interface")
        found = [coordinate(point.problem.interface, dim) for point in some]
        values, meaning = found[0]
        if all(np.array_equal(places, values) for places, _ in found):
            return {dim: found[0]}
        each = [coordinate(point.problem.interface, dim)[0] for point in self.points]
        name = "position" if dim == "x" else f"position_{dim}"
        own = replace(meaning, dims=(*dims, dim))
        return {name: (np.reshape(each, (*shape, -1)), own)}


def warn_of_failures(failed: Sequence[Failure], samples: int) -> None:
    """Warn of samples that failed, of `samples` in all."""
    if failed:
        some = "; ".join(str(failure) for failure in failed[:SHOWN])
        more = f"; and {len(failed) - SHOWN} more" if len(failed) > SHOWN else ""
        warn_accuracy(
            f"{len(failed)} of {samples} samples could not be solved and are NaN (the attribute"
            f" {FAILED!r} lists them): {some}{more}"
        )
