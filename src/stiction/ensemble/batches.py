"""Compute samples in batches, in threads or any executor, with the same results.

Problem. Solve spans of samples in bounded memory, on workers that come
and go. Results must not depend on the workers.

Steps:

1. While a worker is free, cut a piece from the first waiting span. It
   should take about half a second at the pace of the latest piece
   (`piece_size`).
2. Submit the piece. An executor that runs it at once returns a finished
   future. In this case, yield its table before the next piece begins.
3. Wait for the first futures, but at most a second, because workers
   come and go.
4. Yield each table, and measure its pace.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from contextvars import Context, copy_context
from functools import cache
from importlib.metadata import version
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction import __version__
from stiction.base.arrays import one_blas_thread
from stiction.base.errors import (
    InputError,
    Warned,
    WorkerError,
    collect_warnings,
    merge_warnings,
    merged,
    printable,
)
from stiction.base.progress import Meter
from stiction.ensemble.experiment import Experiment
from stiction.random.synthesis import SAMPLES_PER_BLOCK, block_of

POINT: str = "_point"
NUMBER: str = "_sample"
"""Names of the columns with the numbers of the point and of the sample."""
PIECE_SECONDS = 0.5
"""Duration of a piece of work, s."""
MAX_PIECE_BYTES = 16 * 2**20
"""Largest size of the values of a piece of work, bytes."""
WORKER_COUNT_SECONDS = 1.0
"""Seconds between counts of the workers. A longer wait cannot be
interrupted on Windows."""


class Span(NamedTuple):
    """Samples `first` to `first` + `samples` - 1 at a sweep point."""

    point: int
    first: int
    samples: int


class Failure(NamedTuple):
    """A sample that could not be solved."""

    point: int  # of a sweep, or 0
    sample: int
    seed: int
    error: str  # message of the solver
    input: bool = False  # whether the sample does not fit the method or the grid (`InputError`)

    @property
    def name(self) -> str:
        """Name of the sample, such as 'sample 3 of point 2 (seed 5)'."""
        where = f" of point {self.point}" if self.point else ""
        return f"sample {self.sample}{where} (seed {self.seed})"

    def __str__(self) -> str:
        return printable(f"{self.name}: {' / '.join(self.error.splitlines())}")


class Table(NamedTuple):
    """Samples at any sweep points, and the failures among them.

    The columns are `POINT`, `NUMBER` and the variables of the method,
    with an entry for each solved sample.
    """

    columns: dict[str, NDArray[Any]]
    failures: tuple[Failure, ...]
    seconds: float  # of one core
    versions: str  # of the packages that computed the samples
    warned: tuple[Warned, ...] = ()  # not stored


def _columns(
    point: int, first: int, values: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """Return the values of consecutive samples at a point, with their numbers."""
    count = len(next(iter(values.values()), ()))
    return {POINT: np.full(count, point), NUMBER: first + np.arange(count), **values}


def usable_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_threads(function: Callable[[Any], Any], jobs: Sequence[Any], workers: int) -> list[Any]:
    """Return the results of all jobs.

    Each warning is issued once, at the line of the caller.
    """
    with merge_warnings() as caught, ThreadPoolExecutor(workers) as pool:
        contexts = [copy_context() for _ in jobs]
        results = list(pool.map(Context.run, contexts, repeat(function), jobs))
        caught[:] = map(Warned.unnumbered, caught)
    return results


def on_executor(
    function: Callable[[Any], Table], jobs: Sequence[Any], executor: Executor, meter: Meter
) -> list[dict[str, NDArray[Any]]]:
    """Return the columns of all tables from an executor. Each warning is issued once."""
    futures = [executor.submit(function, job) for job in jobs]
    with merge_warnings() as caught:
        try:
            tables = []
            for job, future in zip(jobs, futures, strict=True):
                tables.append(_result(future, Span(0, 0, len(job))))
                meter.advance(len(job))
        finally:
            for future in futures:
                future.cancel()
        caught += [warning.unnumbered() for table in tables for warning in table.warned]
    return [table.columns for table in tables]


@cache
def versions() -> str:
    """Return the software versions on which the last digits depend."""
    return f"stiction {__version__}, numpy {version('numpy')}, numba {version('numba')}"


def solve_span(experiment: Experiment, span: Span) -> Table:
    """Solve a span of samples. A sample that fails does not stop the others."""
    begin = time.perf_counter()
    parts: list[dict[str, NDArray[Any]]] = []
    failures: list[Failure] = []
    warned: list[Warned] = []
    waiting = deque(experiment.batches(span.first, span.samples))
    while waiting:
        first, count = waiting.popleft()
        try:
            # The number of BLAS threads changes the last bits.
            with one_blas_thread(), collect_warnings() as caught:
                parts.append(_columns(span.point, first, experiment.results(first, count)))
        except Exception as error:
            # One bad sample makes its batch fail. Solve each sample of
            # the batch alone.
            if count > 1:  # find the sample that failed
                waiting.extendleft((first + i, 1) for i in reversed(range(count)))
                continue
            known = isinstance(error, InputError)
            text = str(error) if known else f"{type(error).__name__}: {error}"
            failures.append(Failure(span.point, first, experiment.seed, text, known))
            continue
        warned += (warning.after(first) for warning in caught)
    parts = parts or [_columns(span.point, 0, {})]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    seconds = time.perf_counter() - begin
    return Table(columns, tuple(failures), seconds, versions(), tuple(merged(warned)))


def piece_size(
    experiment: Experiment, span: Span, pace: float | None, left: int, workers: int
) -> int:
    """Return the number of samples for the next piece, from the pace in s per sample."""
    block = block_of(len(experiment.problem.interface.shape))
    # The first piece is short, because it measures the pace.
    size = min(experiment.batch, SAMPLES_PER_BLOCK)
    if pace:
        size = int(PIECE_SECONDS / max(pace, 1e-9))
    # An equal part of the remaining samples, but at least a block, which
    # is drawn as a whole.
    size = min(size, max(-(-left // (2 * workers)), block))
    size = max(1, min(size, int(MAX_PIECE_BYTES / experiment.sample_bytes), span.samples))
    end = span.first + size
    if size > block and size < span.samples:  # do not cut a block of draws in two
        end -= end % block
    return end - span.first


def workers_of(executor: Executor, workers: int) -> int:
    """Return the current number of workers in an executor.

    Workers of Dask come and go.
    """
    client = getattr(executor, "_client", None)
    if client is not None:
        return max(1, sum(client.nthreads().values()))
    return int(getattr(executor, "_max_workers", 0) or workers)


def solve_spans(
    points: Sequence[Experiment],
    spans: Sequence[Span],
    *,
    executor: Executor | None = None,
    workers: int = 1,
) -> Generator[tuple[Span, Table], None, None]:
    """Solve spans of samples.

    Yield their pieces with their tables (steps 1 to 4).

    At most two pieces per worker are in progress, so that
    memory stays bounded. Closing the generator cancels the
    pieces that have not begun. A lost worker, or a worker
    with different versions, raises a `WorkerError`.
    """
    waiting = deque(spans)
    left = sum(span.samples for span in spans)
    pace: float | None = None  # of the latest piece, in s per sample
    running: dict[Future[Table], Span] = {}
    with ExitStack() as stack:
        stack.enter_context(one_blas_thread())
        if executor is None:
            executor = stack.enter_context(ThreadPoolExecutor(workers))
        try:
            while waiting or running:
                # 1.
                slots = workers_of(executor, workers)
                while waiting and len(running) < 2 * slots:
                    point, first, samples = whole = waiting.popleft()
                    size = piece_size(points[point], whole, pace, left, slots)
                    if size < samples:
                        waiting.appendleft(Span(point, first + size, samples - size))
                    left -= size
                    # 2.
                    span = Span(point, first, size)
                    future = executor.submit(solve_span, points[point], span)
                    running[future] = span
                    if future.done():
                        break
                # 3.
                done, _ = wait(
                    running, timeout=WORKER_COUNT_SECONDS, return_when=FIRST_COMPLETED
                )
                # 4.
                for future in done:
                    span = running.pop(future)
                    table = _result(future, span)
                    pace = table.seconds / span.samples
                    yield span, table
        finally:
            for future in running:
                future.cancel()


def _result(future: Future[Table], span: Span) -> Table:
    """Return the results from a finished piece as a table."""
    try:
        table = future.result()
    except InputError:
        raise
    except Exception as error:
        if "pickle" in str(error):  # a PicklingError, AttributeError or TypeError
            raise InputError(
                f"executor: no part of the study can be sent to a process: {error}. Define"
                " functions with def at the top of a module, or leave out the executor"
            ) from error
        last = span.first + span.samples - 1
        raise WorkerError(
            f"the worker that computed items {span.first} to {last} of point {span.point} was lost"
            f" ({type(error).__name__}: {error}). Run again, with fewer workers if memory is short"
        ) from error
    if table.versions != versions():
        raise WorkerError(
            f"a worker has {table.versions}, not {versions()}. Install the same versions"
        )
    return table


def spans_of(missing: NDArray[np.bool_]) -> list[Span]:
    """Return spans of missing samples, given a mask (points, samples)."""
    spans = []
    for point, row in enumerate(missing):
        # Missing samples begin and end where the mask changes.
        edges = np.flatnonzero(np.diff(row, prepend=False, append=False)).reshape(-1, 2)
        spans += [Span(point, start, stop - start) for start, stop in edges.tolist()]
    return spans
