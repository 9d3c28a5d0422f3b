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
    """Return one experiment for each distinct combination of the named parts.

    >>> from types import SimpleNamespace as Named
    >>> problem, a, b = Named(), Named(), Named()
    >>> points = [
    ...     Named(number=i, problem=problem, method=m) for i, m in enumerate((a, a, b, a))
    ... ]
    >>> [point.number for point in distinct(points, "problem", "method")]
    [0, 2]
    >>> [point.number for point in distinct(points, "problem")]
    [0]
    """
    first: dict[Any, Experiment] = {}
    for point in points:
        first.setdefault(tuple(id(getattr(point, part)) for part in parts), point)
    return list(first.values())


def variables_in(points: Sequence[Experiment]) -> dict[str, Variable]:
    """Return all variables that any point has, in the order of the methods.

    >>> from types import SimpleNamespace as Named
    >>> def point(**variables):
    ...     return Named(problem=0, random=0, method=object(), variables=variables)
    >>> variables_in([point(a=1, b=2), point(b=2, c=3)])
    {'a': 1, 'b': 2, 'c': 3}
    """
    some = distinct(points, "problem", "random", "method")
    return {name: variable for point in some for name, variable in point.variables.items()}


class Gathered:
    """The results of all samples in one or more experiments, in memory.

    `only` names the variables to gather. `done`, with shape (points,
    samples), marks the gathered samples.

    Examples
    --------
    Two points have the samples 0 to 2. Two samples fail, and sample 3 does
    not belong to this call.

    >>> from types import SimpleNamespace as Named
    >>> import stiction as st
    >>> variables = {
    ...     "critical_stress": Variable("Pa", "stress"),
    ...     "events": Variable("1", "events"),
    ...     "slip": Variable("m", "slip", ("sample", "x")),
    ... }
    >>> point = Named(
    ...     problem=Named(interface=st.Interface(0.1, 8)),
    ...     random=0,
    ...     method=0,
    ...     sample_bytes=80.0,
    ...     variables=variables,
    ... )
    >>> rows = Gathered([point, point], 3)
    >>> columns = {
    ...     POINT: np.array([1, 0, 1]),
    ...     NUMBER: np.array([2, 0, 3]),
    ...     "critical_stress": np.array([7.0, 4.0, 9.0]),
    ...     "events": np.array([3, 1, 2]),
    ... }
    >>> failures = (
    ...     Failure(1, 1, 9, "no root"),
    ...     Failure(0, 1, 9, "late"),
    ...     Failure(1, 3, 9, "far"),
    ... )
    >>> rows.add(Table(columns, failures, 0.0, ""))
    >>> rows.done.astype(int).tolist(), rows.onsets.tolist()
    ([[1, 0, 0], [0, 0, 1]], [[4.0, nan, nan], [nan, nan, 7.0]])
    >>> [failure.error for failure in rows.failed]  # in the order of points
    ['late', 'no root']

    A later run may solve a sample that failed.

    >>> again = {
    ...     POINT: np.array([0]),
    ...     NUMBER: np.array([1]),
    ...     "critical_stress": np.array([5.0]),
    ... }
    >>> rows.add(Table(again, (), 0.0, ""))
    >>> [failure.error for failure in rows.failed], rows.onsets[0].tolist()
    (['no root'], [4.0, 5.0, nan])
    >>> axes = {
    ...     "length": {"length": (np.array([0.3, 0.1]), Variable("m", "length", ("length",)))}
    ... }
    >>> found = rows.dataset({"seed": 9}, axes)
    >>> found.critical_stress.dims, found.critical_stress.values.tolist()
    (('length', 'sample'), [[4.0, 5.0, nan], [nan, nan, 7.0]])
    >>> found.events.dtype.kind, found.length.values.tolist(), found.sample.values.tolist()
    ('f', [0.3, 0.1], [0, 1, 2])
    >>> found.attrs["cut_short"], found.attrs["failed_samples"], found.attrs["seed"]
    ('3 of 6 samples are done', '[[1, 1, 9, "no root", false]]', 9)

    A whole number stays one if no sample is missing:

    >>> rows = Gathered([point], 1, only=["events"])
    >>> rows.add(Table({name: values[1:2] for name, values in columns.items()}, (), 0.0, ""))
    >>> found = rows.dataset({})
    >>> (
    ...     found.events.values.tolist(),
    ...     found.events.dtype.kind,
    ...     [*found],
    ...     "cut_short" in found.attrs,
    ... )
    ([1], 'i', ['events'], False)

    A sample that failed is not cut short:

    >>> rows = Gathered([point], 2, only=["events"])
    >>> rows.add(
    ...     Table(
    ...         {name: values[1:2] for name, values in columns.items()}, failures[1:2], 0.0, ""
    ...     )
    ... )
    >>> "failed_samples" in rows.dataset({}).attrs, "cut_short" in rows.dataset({}).attrs
    (True, False)
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
        """Return a message about a table that cannot belong to these points, or ''.

        >>> from types import SimpleNamespace as Named
        >>> import stiction as st
        >>> variables = {
        ...     "stress": Variable("Pa", "stress"),
        ...     "slip": Variable("m", "slip", ("sample", "x")),
        ... }
        >>> variables["events"] = Variable("1", "event", ("sample", "event"))
        >>> point = Named(
        ...     problem=Named(interface=st.Interface(0.1, 8)),
        ...     random=0,
        ...     method=0,
        ...     sample_bytes=80.0,
        ...     variables=variables,
        ... )
        >>> rows = Gathered([point, point], 3)
        >>> def misfit(number, sample, failures=(), **columns):
        ...     columns = {name: np.zeros(shape) for name, shape in columns.items()}
        ...     columns |= {POINT: np.array([number]), NUMBER: np.array([sample])}
        ...     return rows.misfit(Table(columns, failures, 0.0, ""))
        >>> (
        ...     misfit(1, 9, stress=1, slip=(1, 8), events=(1, 5)),
        ...     misfit(0, 0, [Failure(1, 0, 9, "")]),
        ... )
        ('', '')
        >>> {misfit(2, 0), misfit(-1, 0), misfit(0, -1), misfit(0, 0, [Failure(2, 0, 9, "")])}
        {'a point or a sample is not in the study'}
        >>> misfit(0, 0, load=1), misfit(0, 0, slip=(1, 7))
        ("'load' is not a variable of the study", 'slip has shape (7,) for each sample')
        >>> misfit(0, 0, stress=(1, 8)), misfit(0, 0, events=1)
        ('stress has shape (8,) for each sample', 'events has shape () for each sample')
        """
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
