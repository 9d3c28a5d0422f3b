"""Samples as rows of a table, and a table as the bytes of a file."""

import hashlib
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.errors import InputError
from stiction.files import UNREADABLE
from stiction.methods import Values


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

    def exception(self) -> Exception:
        """Return the error with which an ensemble ends if nothing but failures come of it."""
        return InputError(str(self)) if self.input else RuntimeError(str(self))


@dataclass(frozen=True, eq=False)
class Table:
    """Samples of any points of a sweep, one row each.

    Attributes
    ----------
    point, sample : (rows,) arrays
    values : dict of arrays
        One row for each of these samples.
    failures : tuple of Failure
        Samples that have no rows.
    seconds : float
        Computing time.
    """

    point: NDArray[np.int64]
    sample: NDArray[np.int64]
    values: Values
    failures: tuple[Failure, ...] = ()
    seconds: float = 0.0

    @property
    def count(self) -> int:
        """Samples dealt with, failed ones included."""
        return self.sample.size + len(self.failures)

    @property
    def nbytes(self) -> int:
        """Size of the values."""
        return sum(int(array.nbytes) for array in self.values.values())


def joined(tables: Iterable[Table]) -> list[Table]:
    """Join tables one below the other, into one table for each set and shape of variables."""
    groups: dict[Any, list[Table]] = {}
    for table in tables:
        columns = table.values.items()
        shape = tuple((name, array.dtype.str, array.shape[1:]) for name, array in columns)
        groups.setdefault(shape, []).append(table)
    return [
        Table(
            point=np.concatenate([table.point for table in group]),
            sample=np.concatenate([table.sample for table in group]),
            values={n: np.concatenate([t.values[n] for t in group]) for n in group[0].values},
            failures=tuple(failure for table in group for failure in table.failures),
            seconds=round(sum(table.seconds for table in group), 3),
        )
        for group in groups.values()
    ]


def encode(table: Table, about: Mapping[str, Any]) -> bytes:
    """Return a table as the bytes of an .npz archive, with a few words about it as JSON."""
    said = {**about, "seconds": table.seconds, "failures": table.failures}
    text = np.frombuffer(json.dumps(said).encode(), dtype=np.uint8)
    arrays: dict[str, Any] = {"about": text, "point": table.point, "sample": table.sample}
    arrays |= {f"value/{name}": array for name, array in table.values.items()}
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def decode(data: bytes) -> tuple[Table, dict[str, Any]]:
    """Return the table and the words of `encode`; a ValueError if it is no such archive."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            about = json.loads(archive["about"].tobytes())
            names = [key.removeprefix("value/") for key in archive.files if "/" in key]
            table = Table(
                point=archive["point"],
                sample=archive["sample"],
                values={name: archive[f"value/{name}"] for name in names},
                failures=tuple(Failure(*item) for item in about["failures"]),
                seconds=float(about["seconds"]),
            )
    except (*UNREADABLE, AttributeError, TypeError) as error:
        raise ValueError(f"cannot be read: {error}") from None
    return table, about


def digest(data: bytes) -> str:
    """Return the SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()
