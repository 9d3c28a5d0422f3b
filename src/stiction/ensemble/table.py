"""Samples as rows of a table, and a table as the bytes of a file."""

from __future__ import annotations

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

Numbers = NDArray[np.int64]
NONE = np.empty(0, dtype=np.int64)
ROWS = ("point", "sample", "wide_point", "wide_sample")


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
    wide_point, wide_sample : (wide_rows,) arrays
        Samples whose variables along the interface are kept.
    wide : dict of arrays
        One row for each of these.
    failures : tuple of Failure
        Samples that have no rows.
    seconds : float
        Computing time.
    """

    point: Numbers
    sample: Numbers
    values: Values
    wide_point: Numbers
    wide_sample: Numbers
    wide: Values
    failures: tuple[Failure, ...] = ()
    seconds: float = 0.0

    @property
    def count(self) -> int:
        """Samples dealt with, failed ones included."""
        return self.sample.size + len(self.failures)

    @property
    def nbytes(self) -> int:
        """Size of the values."""
        arrays = (*self.values.values(), *self.wide.values())
        return sum(int(array.nbytes) for array in arrays)


def joined(tables: Iterable[Table]) -> list[Table]:
    """Join tables one below the other, into one table for each set and shape of variables."""
    groups: dict[Any, list[Table]] = {}
    failures: list[Failure] = []
    for table in tables:
        failures += table.failures
        columns = [*table.values.items(), *table.wide.items()]
        shape = tuple((name, array.dtype.str, array.shape[1:]) for name, array in columns)
        groups.setdefault(shape, []).append(table)
    found = []
    for group in groups.values():
        rows = {name: np.concatenate([getattr(table, name) for table in group]) for name in ROWS}
        values = {n: np.concatenate([t.values[n] for t in group]) for n in group[0].values}
        wide = {n: np.concatenate([t.wide[n] for t in group]) for n in group[0].wide}
        seconds = round(sum(table.seconds for table in group), 3)
        mine, failures = tuple(failures), []
        found.append(Table(**rows, values=values, wide=wide, failures=mine, seconds=seconds))
    return found


def encode(table: Table, about: Mapping[str, Any]) -> bytes:
    """Return a table as the bytes of an .npz archive, with a few words about it as JSON."""
    said = {**about, "seconds": table.seconds, "failures": table.failures}
    arrays = {name: getattr(table, name) for name in ROWS}
    arrays |= {f"value/{name}": array for name, array in table.values.items()}
    arrays |= {f"wide/{name}": array for name, array in table.wide.items()}
    text = np.frombuffer(json.dumps(said).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, about=text, **arrays)
    return file.getvalue()


def decode(data: bytes | Any, *, rows_only: bool = False) -> tuple[Table, dict[str, Any]]:
    """Return the table and the words of `encode`.

    Parameters
    ----------
    data : bytes or path
    rows_only : bool
        Read only which samples it holds; `values` and `wide` are empty.

    Raises
    ------
    ValueError
        If it is no such archive.
    FileNotFoundError
    """
    source = io.BytesIO(data) if isinstance(data, bytes) else data
    try:
        with np.load(source, allow_pickle=False) as archive:
            about = json.loads(archive["about"].tobytes())
            rows = {name: archive[name] for name in ROWS}
            parts: dict[str, Values] = {"value": {}, "wide": {}}
            for key in archive.files:
                part, _, name = key.partition("/")
                if name and not rows_only:
                    parts[part][name] = archive[key]
        failures = tuple(Failure(*item) for item in about["failures"])
        seconds = float(about["seconds"])
    except FileNotFoundError:
        raise
    except (*UNREADABLE, AttributeError, TypeError) as error:
        raise ValueError(f"cannot be read: {error}") from None
    found: dict[str, Any] = {"values": parts["value"], "wide": parts["wide"]}
    return Table(**rows, **found, failures=failures, seconds=seconds), about


def digest(data: bytes) -> str:
    """Return the SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()
