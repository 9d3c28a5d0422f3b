"""One piece of work: samples of one plan, where a sample that fails does not stop the others."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from stiction.ensemble.plan import Plan, chunks, compute
from stiction.ensemble.versions import refuse_other_versions
from stiction.errors import InputError
from stiction.methods import Values


class Failure(NamedTuple):
    """A sample that could not be computed.

    Attributes
    ----------
    point : int
        Number of the sweep's point; 0 without a sweep.
    sample, seed : int
    error : str
        What the solver said.
    input : bool
        Whether it was an `InputError`.
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
class Outcome:
    """What came out of a piece of work.

    Attributes
    ----------
    point : int
    samples : (done,) array
        Numbers of the samples that were computed, ascending.
    wide_samples : (wide,) array
        Those of them whose wide variables are kept.
    values : dict of arrays
        First axis as `samples`, of wide variables as `wide_samples`.
    failures : tuple of Failure
    seconds : float
        Time it took.
    """

    point: int
    samples: NDArray[np.int64]
    wide_samples: NDArray[np.int64]
    values: Values
    failures: tuple[Failure, ...] = field(default=())
    seconds: float = 0.0

    @property
    def count(self) -> int:
        """Samples dealt with, failed ones included."""
        return self.samples.size + len(self.failures)

    @property
    def nbytes(self) -> int:
        """Size of the values."""
        return sum(int(value.nbytes) for value in self.values.values())


_TOKEN = uuid.uuid4().hex


def process_mark() -> str:
    """Tells the parent process from its workers, forked ones included."""
    return f"{_TOKEN}:{os.getpid()}"


@lru_cache(maxsize=1)
def _calm_blas(process: int) -> None:
    # A worker process has no use for BLAS threads of its own, and their number changes last bits.
    threadpool_limits(limits=1, user_api="blas")


def do_work(
    plan: Plan, point: int, first: int, samples: int, parent: str = "", expected: str = ""
) -> Outcome:
    """Compute samples first .. first + samples - 1 of a plan; a plain function, for any executor.

    Parameters
    ----------
    plan : Plan
    point, first, samples : int
    parent : str
        `process_mark` of the process that hands out the work.
    expected : str
        `versions` there. Every piece is checked, because workers of a cluster come and go.

    Raises
    ------
    WorkerError
        If the versions here are others.
    """
    if expected:
        refuse_other_versions(expected)
    if parent and parent != process_mark():
        _calm_blas(os.getpid())
    begin = time.perf_counter()
    parts: list[tuple[int, int, Values]] = []
    failures: list[Failure] = []
    for start, count in chunks(samples, plan.piece, first):
        try:
            parts.append((start, count, compute(plan, start, count)))
        except Exception as error:
            if count == 1:
                failures.append(_failure(plan, point, start, error))
                continue
            for sample in range(start, start + count):
                try:
                    parts.append((sample, 1, compute(plan, sample, 1)))
                except Exception as own_error:
                    failures.append(_failure(plan, point, sample, own_error))
    done = [np.arange(start, start + count, dtype=np.int64) for start, count, _ in parts]
    numbers = np.concatenate(done) if done else np.empty(0, dtype=np.int64)
    wide = plan.wide_rows(numbers)
    names = plan.wide
    values = {
        name: joined[wide] if name in names and not wide.all() else joined
        for name, joined in _joined([values for _, _, values in parts]).items()
    }
    seconds = time.perf_counter() - begin
    return Outcome(point, numbers, numbers[wide], values, tuple(failures), seconds)


def _joined(parts: Sequence[Values]) -> Values:
    if len(parts) == 1:
        return dict(parts[0])
    names = parts[0] if parts else {}
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _failure(plan: Plan, point: int, sample: int, error: Exception) -> Failure:
    known = isinstance(error, InputError)
    text = str(error) if known else f"{type(error).__name__}: {error}"
    return Failure(point, sample, plan.seed, " / ".join(text.split("\n")), known)


def raise_failure(failure: Failure) -> Any:
    """Turn a failure into the exception that a run in memory ends with."""
    if failure.input:
        raise InputError(str(failure))
    raise RuntimeError(str(failure))
