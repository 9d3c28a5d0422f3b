"""Samples as rows of a table."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

POINT, NUMBER = "_point", "_sample"
"""Names of the columns that hold the numbers of the point and of the sample."""


class Failure(NamedTuple):
    """A sample that could not be solved.

    Attributes
    ----------
    point : int
        Number of the point of a sweep; 0 without a sweep.
    sample, seed : int
    error : str
        The message of the solver.
    input : bool
        Whether it was an `InputError`: the sample itself does not fit the method or the grid.
    """

    point: int
    sample: int
    seed: int
    error: str
    input: bool = False

    def __str__(self) -> str:
        where = f" of point {self.point}" if self.point else ""
        return f"sample {self.sample}{where} (seed {self.seed}): {self.error}"


@dataclass(frozen=True, eq=False)
class Table:
    """Samples of any points of a sweep.

    Attributes
    ----------
    rows : structured array
        One row a sample: `POINT`, `NUMBER` and the variables of the method.
    failures : tuple of Failure
        Samples that have no row.
    seconds : float
        Computing time.
    """

    rows: NDArray[Any]
    failures: tuple[Failure, ...] = ()
    seconds: float = 0.0

    @property
    def count(self) -> int:
        """Samples dealt with, failed ones included."""
        return self.rows.size + len(self.failures)


def rows_of(point: int, first: int, values: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """Return the values of consecutive samples of a point, the number of the first given."""
    count = len(next(iter(values.values()), ()))
    columns = {POINT: np.full(count, point), NUMBER: first + np.arange(count), **values}
    types = [(name, array.dtype, array.shape[1:]) for name, array in columns.items()]
    rows = np.empty(count, dtype=types)
    for name, array in columns.items():
        rows[name] = array
    return rows


def joined(tables: Iterable[Table]) -> list[Table]:
    """Join tables one below the other, into one table for each set of columns."""
    groups: dict[Any, list[Table]] = {}
    for table in tables:
        groups.setdefault(table.rows.dtype, []).append(table)
    return [
        Table(
            np.concatenate([table.rows for table in group]),
            tuple(failure for table in group for failure in table.failures),
            round(sum(table.seconds for table in group), 3),
        )
        for group in groups.values()
    ]
