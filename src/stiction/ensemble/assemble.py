"""Gathering: outcomes in any order become one labelled dataset over sweep, sample and x."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._checks import check_memory
from stiction.ensemble.plan import Plan
from stiction.ensemble.points import differing_in, variables_in
from stiction.ensemble.work import Outcome
from stiction.results import SAMPLE, Variable, coordinate, to_dataset

KEPT_SAMPLE = Variable("1", "number of the sample whose profiles are kept", ("kept_sample",))


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
    """Room for the results of all samples of one or several plans.

    Parameters
    ----------
    plans : sequence of Plan
        One for each point, in the order of the points.
    samples, first : int
        Samples of each point.
    only : sequence of str, optional
        Names of the variables to gather; all if left out.
    """

    def __init__(
        self, plans: Sequence[Plan], samples: int, first: int = 0, only: Sequence[str] | None = None
    ) -> None:
        self.plans, self.samples, self.first, self.only = plans, samples, first, only
        self.variables: dict[str, Variable] = {}
        self.kept = plans[0].keep_samples
        for name, variable in variables_in(plans).items():
            if only is None or name in only:
                wide = variable.wide and self.kept is not None
                dims = ("kept_sample", *variable.dims[1:]) if wide else variable.dims
                self.variables[name] = replace(variable, dims=dims)
        if self.kept is not None:
            inside = [s for s in self.kept if first <= s < first + samples]
            self._kept = np.array(sorted(inside), dtype=np.int64)
        narrow = sum(not variable.wide for variable in self.variables.values())
        check_memory("samples", 9.0 * len(plans) * samples * narrow)
        self._arrays: dict[str, NDArray[Any]] = {}
        self._seen: dict[str, NDArray[np.bool_]] = {}

    def add(self, outcome: Outcome) -> None:
        """Put the values of an outcome in their places."""
        points = np.full(outcome.samples.size, outcome.point)
        wide_points = np.full(outcome.wide_samples.size, outcome.point)
        self.put(points, outcome.samples, wide_points, outcome.wide_samples, outcome.values)

    def put(
        self,
        points: NDArray[np.int64],
        samples: NDArray[np.int64],
        wide_points: NDArray[np.int64],
        wide_samples: NDArray[np.int64],
        values: Mapping[str, NDArray[Any]],
    ) -> None:
        """Put values of samples of any points in their places.

        Parameters
        ----------
        points, samples : (rows,) arrays
        wide_points, wide_samples : (wide_rows,) arrays
            Those whose wide variables are in `values`.
        values : dict of arrays
            First axis as `samples`, of wide variables as `wide_samples`.
        """
        rows = samples - self.first
        inside = (rows >= 0) & (rows < self.samples)
        narrow = points[inside], rows[inside]
        if self.kept is not None:
            wide_inside = np.isin(wide_samples, self._kept)
            wide_rows = np.searchsorted(self._kept, wide_samples[wide_inside])
            wide = wide_points[wide_inside], wide_rows
        for name, value in values.items():
            if name not in self.variables:
                continue
            if self.variables[name].dims[0] == "kept_sample":
                self._put(name, wide, value[wide_inside], self._kept.size)
            else:
                self._put(name, narrow, value[inside], self.samples)

    def _put(self, name: str, where: tuple[Any, Any], value: NDArray[Any], length: int) -> None:
        if name not in self._arrays:
            shape = (len(self.plans), length)
            self._arrays[name] = np.zeros((*shape, *value.shape[1:]), dtype=value.dtype)
            self._seen[name] = np.zeros(shape, dtype=np.bool_)
        self._arrays[name][where] = value
        self._seen[name][where] = True

    def _filled(self, name: str) -> NDArray[Any]:
        """The array of a variable, NaN where nothing was put."""
        array, seen = self._arrays[name], self._seen[name]
        if not seen.all():
            if array.dtype.kind != "f":
                array = array.astype(np.float64)
            array[~seen] = np.nan
        return array

    def dataset(self, attributes: Mapping[str, Any], axes: Sequence[GridAxis] = ()) -> xr.Dataset:
        """All that was gathered, in the order in which the first plan's method names it.

        Parameters
        ----------
        attributes : mapping
        axes : sequence of GridAxis
            Of the sweep; the product of their sizes is the number of plans.
        """
        shape = tuple(axis.size for axis in axes)
        dims = tuple(axis.dim for axis in axes)
        values, variables = {}, {}
        for name, variable in self.variables.items():
            if name in self._arrays:
                array = self._filled(name)
                values[name] = array.reshape(shape + array.shape[1:])
                variables[name] = replace(variable, dims=dims + variable.dims)
        coordinates: dict[str, tuple[NDArray[Any], Variable]] = {}
        for axis in axes:
            coordinates |= axis.coordinates
        coordinates["sample"] = (self.first + np.arange(self.samples), SAMPLE)
        used = {dim for variable in variables.values() for dim in variable.dims}
        if "kept_sample" in used:
            coordinates["kept_sample"] = (self._kept, KEPT_SAMPLE)
        some = differing_in(self.plans, "problem.interface")
        for dim in sorted(used & {"x", "y", "direction"}):
            places = [coordinate(plan.problem.interface, dim) for plan in some]
            values_of, meaning = places[0]
            if all(np.array_equal(place, values_of) for place, _ in places):
                coordinates[dim] = places[0]
            else:  # the length is swept: every point has positions of its own
                places = [coordinate(plan.problem.interface, dim) for plan in self.plans]
                name = "position" if dim == "x" else f"position_{dim}"
                each = replace(meaning, dims=(*dims, dim))
                stacked = np.reshape([place for place, _ in places], (*shape, -1))
                coordinates[name] = (stacked, each)
        return to_dataset(values, variables, coordinates, attributes)
