"""A chunk: a table of samples, one row each, as a file and as a line of the list."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.files import Arrays, decode, digest, encode
from stiction.ensemble.manifest import identity
from stiction.ensemble.scheduler import Span
from stiction.ensemble.work import Outcome
from stiction.results import Variable

ROWS = {
    "point": Variable("1", "number of the point of the sweep", ("row",)),
    "sample": Variable("1", "sample number", ("row",)),
    "wide_point": Variable("1", "number of the point of the sweep", ("wide_row",)),
    "wide_sample": Variable("1", "sample number", ("wide_row",)),
}
"""The columns that say which samples are in the rows."""


Rows: TypeAlias = NDArray[np.int64]


class DamagedChunk(ValueError):
    """A chunk is not what was written; the message says what is wrong with it."""


def mark_of(study: Mapping[str, Any]) -> str:
    """What chunks of the same study have in common."""
    return digest(json.dumps(identity(study), sort_keys=True).encode())[:32]


@dataclass(frozen=True, eq=False)
class Chunk:
    """One line of the list.

    Attributes
    ----------
    file : str
        Name, relative to the folder of the run.
    sha256 : str
        Of its bytes.
    bytes : int
    seconds : float
        Computing time.
    level : int
        How often its samples were joined with others.
    done : (spans, 3) array
        Point, first sample and number of samples of each stretch, in ascending order.
    """

    file: str
    sha256: str
    bytes: int
    seconds: float
    level: int
    done: NDArray[np.int64]

    @classmethod
    def from_entry(cls, entry: Mapping[str, Any]) -> Chunk:
        """The chunk of an entry of the list."""
        done = np.array(entry["done"], dtype=np.int64).reshape(-1, 3)
        sizes = int(entry["bytes"]), float(entry["seconds"]), int(entry["level"])
        return cls(str(entry["file"]), str(entry["sha256"]), *sizes, done)

    def entry(self) -> dict[str, Any]:
        """As it stands in the list."""
        return {
            "file": self.file,
            "sha256": self.sha256,
            "bytes": self.bytes,
            "seconds": self.seconds,
            "level": self.level,
            "done": self.done.tolist(),
        }

    @property
    def samples(self) -> int:
        """Number of samples in it."""
        return int(self.done[:, 2].sum())

    def holds(self, point: int, sample: int) -> bool:
        """Whether a sample is in it."""
        points, firsts, counts = self.done.T
        return bool(((points == point) & (firsts <= sample) & (sample < firsts + counts)).any())

    def is_within(self, others: Sequence[Chunk]) -> bool:
        """Whether other chunks hold all its samples."""
        held = {tuple(span) for chunk in others for span in chunk.done.tolist()}
        if all(tuple(span) in held for span in self.done.tolist()):
            return True
        return all(
            any(chunk.holds(point, sample) for chunk in others)
            for point, first, count in self.done.tolist()
            for sample in range(first, first + count)
        )

    def agrees_with(self, table: Table) -> bool:
        """Whether a table has the samples of this line."""
        return np.array_equal(self.done, table.done)


@dataclass(frozen=True, eq=False)
class Table:
    """Samples of any points, with the numbers of point and sample in columns of their own.

    Attributes
    ----------
    values : dict of arrays
        The columns; the first axis is 'row' or 'wide_row'.
    variables : dict of Variable
        What they mean; none when read.
    seconds : float
    study : str
        Mark of the study, when read.
    level : int
    """

    values: Arrays
    variables: Mapping[str, Variable]
    seconds: float
    study: str = ""
    level: int = 0

    @property
    def done(self) -> NDArray[np.int64]:
        """Its samples in stretches, as in `Chunk.done`."""
        return _stretches(self.values["point"], self.values["sample"])

    def at(self, samples: Callable[[Rows, Rows], NDArray[np.bool_]]) -> Table:
        """The rows of some samples, told by their points and numbers."""
        point, sample, wide_point, wide_sample = self.rows
        narrow, wide = samples(point, sample), samples(wide_point, wide_sample)
        values = {
            name: value[narrow if value.shape[0] == point.size else wide]
            for name, value in self.values.items()
            if name not in ROWS
        }
        rows = (point[narrow], sample[narrow], wide_point[wide], wide_sample[wide])
        return replace(self, values=dict(zip(ROWS, rows, strict=True)) | values)

    @property
    def narrow(self) -> Arrays:
        """The columns with one row a sample, but for those that say which."""
        rows = self.values["point"].size
        return {
            name: value
            for name, value in self.values.items()
            if name not in ROWS and value.shape[0] == rows
        }

    @property
    def keys(self) -> list[tuple[int, int]]:
        """Point and sample of each row."""
        point, sample = self.rows[:2]
        return list(zip(point.tolist(), sample.tolist(), strict=True))

    @property
    def rows(self) -> tuple[Rows, Rows, Rows, Rows]:
        """Points and samples of the rows, points and samples of the wide rows."""
        point, sample, wide_point, wide_sample = (self.values[name] for name in ROWS)
        return point, sample, wide_point, wide_sample

    @classmethod
    def decode(cls, data: bytes) -> Table:
        """The table of the bytes of a chunk.

        Raises
        ------
        DamagedChunk
        """
        try:
            values, said = decode(data)
            rows = {name: values[name].size for name in ROWS}
            if rows["point"] != rows["sample"] or rows["wide_point"] != rows["wide_sample"]:
                raise ValueError("has columns of unequal length")
            return cls(values, {}, said["seconds"], said["study"], said["level"])
        except (ValueError, KeyError) as error:
            raise DamagedChunk(str(error)) from None

    def encode(self, version: int, study: str, level: int) -> bytes:
        """As the bytes of a chunk."""
        said = {"format": version, "study": study, "level": level, "seconds": self.seconds}
        return encode(self.values, self.variables or _plain_variables(self.values), said)

    def as_chunk(self, file: str, data: bytes, level: int | None = None) -> Chunk:
        """Its line in the list, once it is written."""
        level = self.level if level is None else level
        return Chunk(file, digest(data), len(data), self.seconds, level, self.done)


def _plain_variables(values: Arrays) -> dict[str, Variable]:
    """Names of dimensions for columns that were read: rows, and what lies along the interface."""
    result = dict(ROWS)
    rows = values["point"].size
    for name, value in values.items():
        if name not in ROWS:
            inner = tuple(f"{name}_{axis}" for axis in range(1, value.ndim))
            row = "row" if value.shape[0] == rows else "wide_row"
            result[name] = Variable("", "", (row, *inner))
    return result


def tables_of(outcomes: Sequence[Outcome], variables: Mapping[str, Variable]) -> Iterator[Table]:
    """Outcomes one below the other, a table for each shape of theirs."""
    groups: dict[Any, list[Outcome]] = {}
    for outcome in outcomes:
        if outcome.samples.size:
            shapes = tuple((name, v.shape[1:]) for name, v in outcome.values.items())
            groups.setdefault(shapes, []).append(outcome)
    for group in groups.values():
        samples = [outcome.samples for outcome in group]
        wide = [outcome.wide_samples for outcome in group]
        points = [outcome.point for outcome in group]
        values: Arrays = {
            "point": np.repeat(points, [part.size for part in samples]).astype(np.int64),
            "sample": np.concatenate(samples),
            "wide_point": np.repeat(points, [part.size for part in wide]).astype(np.int64),
            "wide_sample": np.concatenate(wide),
        }
        names = dict(ROWS)
        for name in group[0].values:
            variable = variables[name]
            row = "wide_row" if variable.wide else "row"
            names[name] = replace(variable, dims=(row, *variable.dims[1:]))
            values[name] = np.concatenate([outcome.values[name] for outcome in group])
        yield Table(values, names, round(sum(outcome.seconds for outcome in group), 3))


def joined(tables: Iterable[Table]) -> list[Table]:
    """Tables one below the other, one for each shape of theirs."""
    groups: dict[Any, list[Table]] = {}
    for table in tables:
        shapes = tuple((n, v.dtype.str, v.shape[1:]) for n, v in sorted(table.values.items()))
        groups.setdefault(shapes, []).append(table)
    return [
        Table(
            {name: np.concatenate([t.values[name] for t in group]) for name in group[0].values},
            {},
            round(sum(table.seconds for table in group), 3),
        )
        for group in groups.values()
    ]


def stored_samples(
    chunks: Iterable[Chunk], points: int, samples: int, first: int = 0
) -> NDArray[np.bool_]:
    """Which samples are in chunks, (points, samples)."""
    found = np.zeros((points, samples), dtype=np.bool_)
    for chunk in chunks:
        for point, start, count in chunk.done.tolist():
            if point < points:
                found[point, max(start - first, 0) : max(start + count - first, 0)] = True
    return found


def missing_spans(found: NDArray[np.bool_], first: int) -> list[Span]:
    """The stretches of samples that are not there, point after point."""
    points, samples = found.shape
    flags = np.zeros(points * (samples + 1) + 1, dtype=np.int8)  # a zero before each point
    flags[1:].reshape(points, samples + 1)[:, :-1] = ~found
    edges = np.diff(flags)
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [
        Span(start // (samples + 1), first + start % (samples + 1), stop - start)
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)
    ]


def _stretches(points: NDArray[Any], samples: NDArray[Any]) -> NDArray[np.int64]:
    """Point, first sample and number of samples of each run of consecutive samples."""
    order = np.lexsort((samples, points))
    points, samples = points[order], samples[order]
    cuts = np.flatnonzero((np.diff(points) != 0) | (np.diff(samples) != 1)) + 1
    begins = np.concatenate(([0], cuts)).astype(np.int64) if points.size else cuts
    counts = np.diff(np.concatenate((begins, [points.size])))
    return np.stack([points[begins], samples[begins], counts], axis=1).astype(np.int64)
