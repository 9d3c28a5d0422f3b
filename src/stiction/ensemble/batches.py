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
        """Name of the sample, such as 'sample 3 of point 2 (seed 5)'.

        >>> Failure(2, 3, 5, "no root").name
        'sample 3 of point 2 (seed 5)'
        >>> print(Failure(0, 3, 5, "no\\nroot\\x1b"))
        sample 3 (seed 5): no / root\\x1b
        """
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
    """Return the values of consecutive samples at a point, with their numbers.

    >>> columns = _columns(2, 7, {"stress": np.array([5.0, 4.0, 6.0])})
    >>> [(name, values.tolist()) for name, values in columns.items()]
    [('_point', [2, 2, 2]), ('_sample', [7, 8, 9]), ('stress', [5.0, 4.0, 6.0])]
    >>> [values.tolist() for values in _columns(2, 7, {}).values()]
    [[], []]
    """
    count = len(next(iter(values.values()), ()))
    return {POINT: np.full(count, point), NUMBER: first + np.arange(count), **values}


def usable_cores() -> int:
    """Return how many cores this process may use.

    >>> 1 <= usable_cores() <= os.cpu_count()
    True
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_threads(function: Callable[[Any], Any], jobs: Sequence[Any], workers: int) -> list[Any]:
    """Return the results of all jobs.

    Each warning is issued once, at the line of the caller.

    >>> from stiction.base.errors import warn_of_samples
    >>> def square(number):
    ...     warn_of_samples("a doubt of {samples}", np.array([True]))
    ...     return number * number
    >>> with collect_warnings() as warned:
    ...     print(in_threads(square, [3, 1, 2], workers=2))
    [9, 1, 4]
    >>> [str(warning) for warning in warned]  # numbers of samples are valid in a job only
    ['a doubt of 3 of 3 samples']
    """
    with merge_warnings() as caught, ThreadPoolExecutor(workers) as pool:
        contexts = [copy_context() for _ in jobs]
        results = list(pool.map(Context.run, contexts, repeat(function), jobs))
        caught[:] = map(Warned.unnumbered, caught)
    return results


def on_executor(
    function: Callable[[Any], Table], jobs: Sequence[Any], executor: Executor, meter: Meter
) -> list[dict[str, NDArray[Any]]]:
    """Return the columns of all tables from an executor. Each warning is issued once.

    >>> from types import SimpleNamespace as Named
    >>> counts = []
    >>> meter = Named(advance=counts.append)
    >>> warning = Warned("a doubt of {samples}", UserWarning, 2, 1, (7,))
    >>> def square(job):
    ...     return Table({"square": np.array(job) ** 2}, (), 0.0, versions(), (warning,))
    >>> with ThreadPoolExecutor(2) as executor, collect_warnings() as warned:
    ...     columns = on_executor(square, [[3, 5], [4]], executor, meter)
    >>> counts, [column["square"].tolist() for column in columns]
    ([2, 1], [[9, 25], [16]])
    >>> [(warning.affected, warning.total, warning.numbers) for warning in warned]
    [(2, 4, ())]
    >>> def fails(job):
    ...     raise ValueError("no root")
    >>> with ThreadPoolExecutor(1) as executor:
    ...     on_executor(fails, [[3, 5], [4]], executor, meter)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.WorkerError: the worker that computed items 0 to 1 of point 0 was lost ...
    """
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
    """Solve a span of samples. A sample that fails does not stop the others.

    The batches 2 to 3 and 4 to 6 fail, so each of their samples is solved
    alone.

    >>> from types import SimpleNamespace as Named
    >>> def results(first, count):
    ...     if first <= 3 < first + count:
    ...         raise ArithmeticError("diverged")
    ...     if first <= 6 < first + count:
    ...         raise InputError("strength: must be positive")
    ...     return {"stress": 10.0 * np.arange(first, first + count)}
    >>> def batches(first, count):
    ...     return [(first, 2), (first + 2, count - 2)]
    >>> experiment = Named(batches=batches, results=results, seed=9)
    >>> table = solve_span(experiment, Span(3, 2, 5))
    >>> [(name, values.tolist()) for name, values in table.columns.items()]
    [('_point', [3, 3, 3]), ('_sample', [2, 4, 5]), ('stress', [20.0, 40.0, 50.0])]
    >>> [tuple(failure) for failure in table.failures]
    [(3, 3, 9, 'ArithmeticError: diverged', False), (3, 6, 9, 'strength: must be positive', True)]
    >>> table = solve_span(
    ...     Named(batches=lambda *span: [span], results=results, seed=9), Span(3, 3, 1)
    ... )
    >>> [(name, values.tolist()) for name, values in table.columns.items()]
    [('_point', []), ('_sample', [])]
    >>> from stiction.base.errors import warn_of_samples
    >>> def doubtful(first, count):
    ...     warn_of_samples("{samples}", np.arange(count) == 1)
    ...     return {"stress": np.zeros(count)}
    >>> table = solve_span(Named(batches=batches, results=doubtful, seed=9), Span(3, 2, 5))
    >>> [str(warning) for warning in table.warned], table.versions == versions()
    (['2 of 5 samples (3, 5)'], True)
    """
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
    """Return the number of samples for the next piece, from the pace in s per sample.

    A block of draws is 256 samples on a line. Pieces end with a block.

    >>> from types import SimpleNamespace as Named
    >>> def experiment(shape, batch=300, bytes=8.0):
    ...     problem = Named(interface=Named(shape=shape))
    ...     return Named(problem=problem, batch=batch, sample_bytes=bytes)
    >>> line, span = experiment((16,)), Span(0, 100, 9000)
    >>> piece_size(line, span, None, 10_000, 2)  # before a pace is known
    256
    >>> piece_size(
    ...     line, span, 0.001, 10_000, 2
    ... )  # 500 samples in half a second, up to sample 512
    412
    >>> piece_size(line, Span(0, 100, 500), 0.001, 10_000, 2)  # a whole span is not cut
    500
    >>> piece_size(line, span, 0.001, 2401, 2)  # a quarter of these is 601
    412
    >>> piece_size(line, span, 0.0001, 2401, 2)  # ... up to sample 512, not 701
    412
    >>> piece_size(line, span, 0.0001, 400, 2), piece_size(line, Span(0, 100, 3), None, 400, 2)
    (256, 3)
    >>> piece_size(experiment((16,), bytes=2.0**20), span, 0.001, 10_000, 2)  # 16 MiB
    16
    >>> plane = experiment((16, 16), batch=7)
    >>> piece_size(plane, span, None, 10_000, 2), piece_size(plane, span, 0.1, 10_000, 2)
    (7, 5)
    >>> piece_size(plane, span, 0.1, 9, 2), piece_size(plane, span, 9.0, 10_000, 2)
    (3, 1)
    """
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

    >>> from types import SimpleNamespace as Named
    >>> (
    ...     workers_of(Named(_max_workers=3), 5),
    ...     workers_of(Named(), 5),
    ...     workers_of(Named(_max_workers=0), 5),
    ... )
    (3, 5, 5)
    >>> client = Named(nthreads=lambda: {"first": 2, "second": 4})
    >>> workers_of(Named(_client=client, _max_workers=3), 5)
    6
    >>> workers_of(Named(_client=Named(nthreads=dict)), 5)
    1
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

    >>> from types import SimpleNamespace as Named
    >>> def experiment(factor):
    ...     def results(first, count):
    ...         return {"stress": factor * np.arange(first, first + count)}
    ...
    ...     problem = Named(interface=Named(shape=(16,)))
    ...     return Named(
    ...         problem=problem,
    ...         batch=300,
    ...         sample_bytes=8.0,
    ...         seed=9,
    ...         results=results,
    ...         batches=lambda first, count: [(first, count)],
    ...     )
    >>> points, spans = [experiment(2.0), experiment(3.0)], [Span(0, 100, 600), Span(1, 4, 5)]
    >>> for executor in (None, ThreadPoolExecutor(1)):
    ...     pieces = sorted(
    ...         solve_spans(points, spans, executor=executor), key=lambda piece: piece[0]
    ...     )
    ...     for point in (0, 1):
    ...         parts = [table.columns for span, table in pieces if span.point == point]
    ...         numbers = np.concatenate([part["_sample"] for part in parts])
    ...         stress = np.concatenate([part["stress"] for part in parts])
    ...         right = bool((stress == (2.0 + point) * numbers).all())
    ...         print(numbers[0], numbers[-1], numbers.size, np.unique(np.diff(numbers)), right)
    100 699 600 [1] True
    4 8 5 [1] True
    100 699 600 [1] True
    4 8 5 [1] True
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
    """Return the results from a finished piece as a table.

    >>> def result(given):
    ...     future = Future()
    ...     is_error = isinstance(given, Exception)
    ...     (future.set_exception if is_error else future.set_result)(given)
    ...     return _result(future, Span(2, 4, 3))
    >>> table = Table({}, (), 0.0, versions())
    >>> result(table) is table
    True
    >>> result(table._replace(versions="numpy 1"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.WorkerError: a worker has numpy 1, not stiction ... the same versions
    >>> result(InputError("strength: must be positive"))
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: strength: must be positive
    >>> result(AttributeError("cannot pickle f"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: executor: no part of the study can be sent to a process: ...
    >>> result(OSError("lost"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.WorkerError: ... items 4 to 6 of point 2 was lost (OSError: lost)...
    """
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
    """Return spans of missing samples, given a mask (points, samples).

    >>> mask = np.array([[1, 0, 1, 1], [0, 0, 0, 0], [0, 1, 1, 1]], dtype=bool)
    >>> [tuple(span) for span in spans_of(mask)]
    [(0, 0, 1), (0, 2, 2), (2, 1, 3)]
    """
    spans = []
    for point, row in enumerate(missing):
        # Missing samples begin and end where the mask changes.
        edges = np.flatnonzero(np.diff(row, prepend=False, append=False)).reshape(-1, 2)
        spans += [Span(point, start, stop - start) for start, stop in edges.tolist()]
    return spans
