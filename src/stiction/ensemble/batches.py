"""Samples computed in batches, by threads or any executor: the same numbers whoever computes."""

from __future__ import annotations

import os
import socket
import time
import uuid
from collections import deque
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from functools import cache, lru_cache
from typing import Annotated, Any, NamedTuple, TypeAlias

import numba
import numpy as np
from pydantic import BeforeValidator
from threadpoolctl import threadpool_limits

from stiction import __version__
from stiction.arrays import one_blas_thread
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.table import NONE, Failure, Table
from stiction.errors import InputError, WorkerError
from stiction.methods import Values
from stiction.random.synthesis import BLOCK, block_of

MOST_BYTES = 16 * 2**20
"""Of the values of a piece of work."""
RECENT = 4
TICK = 1.0
"""Seconds after which an iteration goes on although nothing is done."""
ASK = 2.0
"""Seconds after which a scheduler is asked again how many workers it has."""


def _executor(value: Any) -> Any:
    if not hasattr(value, "submit"):
        raise ValueError("must be a concurrent.futures executor")
    return value


AnyExecutor: TypeAlias = Annotated[Any, BeforeValidator(_executor)]
"""Anything that has `submit`: processes, a Dask client's executor, ..."""


class Span(NamedTuple):
    """Samples first .. first + samples - 1 of one point."""

    point: int
    first: int
    samples: int


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@cache
def versions() -> str:
    """Return the versions on which the last digits of a result depend, as one line of text."""
    return f"stiction {__version__}, numpy {np.__version__}, numba {numba.__version__}"


_TOKEN = uuid.uuid4().hex


def process_name() -> str:
    """Return a text that differs between a process and its workers, forked ones included."""
    return f"{_TOKEN}:{os.getpid()}"


@lru_cache(maxsize=1)
def _one_blas_thread_for_good(process: int) -> None:
    # A worker process has no use for BLAS threads of its own, and their number changes last bits.
    threadpool_limits(limits=1, user_api="blas")


def solve_span(experiment: Experiment, span: Span, parent: str = "", expected: str = "") -> Table:
    """Solve a span of samples; a sample that fails does not stop the others.

    A plain function, for any executor.

    Parameters
    ----------
    experiment : Experiment
    span : Span
    parent : str
        `process_name` of the process that hands out the work.
    expected : str
        `versions` of that process.

    Raises
    ------
    WorkerError
        If the versions of this process are others.
    """
    if expected and expected != versions():
        raise WorkerError(
            f"a worker on {socket.gethostname()} has {versions()}, the run has {expected}; install"
            " the same versions there, or end that worker"
        )
    if parent and parent != process_name():
        _one_blas_thread_for_good(os.getpid())
    begin = time.perf_counter()
    solved: list[tuple[int, Values]] = []
    failures: list[Failure] = []
    waiting = deque(experiment.batches(span.first, span.samples))
    while waiting:
        first, count = waiting.popleft()
        try:
            solved.append((first, experiment.results(experiment.seed, first, count)))
        except Exception as error:
            if count > 1:  # find out which sample it is
                waiting.extendleft((first + i, 1) for i in reversed(range(count)))
                continue
            known = isinstance(error, InputError)
            text = str(error) if known else f"{type(error).__name__}: {error}"
            text = " / ".join(text.split("\n"))
            failures.append(Failure(span.point, first, experiment.seed, text, known))
    return _table(experiment, span.point, solved, failures, time.perf_counter() - begin)


def _table(
    experiment: Experiment,
    point: int,
    solved: Sequence[tuple[int, Values]],
    failures: Sequence[Failure],
    seconds: float,
) -> Table:
    """Batches of one point as a table."""
    names = list(solved[0][1]) if solved else []
    joined = {name: np.concatenate([values[name] for _, values in solved]) for name in names}
    numbers = [first + np.arange(values[names[0]].shape[0]) for first, values in solved]
    samples = np.concatenate(numbers) if numbers else NONE
    kept, wide = experiment.keeps(samples), experiment.wide if solved else ()
    chosen = samples[kept] if wide else NONE
    return Table(
        point=np.full(samples.size, point),
        sample=samples,
        values={name: array for name, array in joined.items() if name not in wide},
        wide_point=np.full(chosen.size, point),
        wide_sample=chosen,
        wide={name: joined[name][kept] for name in names if name in wide},
        failures=tuple(failures),
        seconds=seconds,
    )


class Sizer:
    """How many samples go into the next piece of work.

    About `seconds` of work by what the last pieces took, not more than a fair share of what is
    left, and bounded in bytes. The numbers do not depend on it.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._rates: dict[int, deque[float]] = {}
        self._last: float | None = None
        self._bytes = 0.0

    def learn(self, point: int, table: Table) -> None:
        """Take note of the time and the size of a piece."""
        if table.count:
            rates = self._rates.setdefault(point, deque(maxlen=RECENT))
            rates.append(table.seconds / table.count)
            # The fastest of the last few: the first ones may have compiled kernels.
            self._last = min(rates)
            self._bytes = max(self._bytes, table.nbytes / table.count)

    def next(self, experiment: Experiment, span: Span, left: int, slots: int) -> int:
        """Return the samples of the next piece of `span`, of `left` samples for `slots` workers."""
        rates = self._rates.get(span.point)
        rate = min(rates) if rates else self._last
        interface = experiment.problem.interface
        block = block_of(len(interface.shape))
        size = int(self.seconds / max(rate, 1e-9)) if rate else min(experiment.batch, BLOCK)
        # A fair share of what is left, but not so small that drawing blocks in parts costs more.
        size = min(size, max(-(-left // (2 * slots)), block))
        if experiment.wide:
            each = max(self._bytes, 8.0 * interface.size * len(experiment.wide))
            size = min(size, int(MOST_BYTES / each))
        size = max(1, min(size, span.samples))
        end = span.first + size
        if size > block and size < span.samples:  # draws come in blocks: do not cut one in two
            end -= end % block
        return end - span.first


class Slots:
    """Workers that an executor has now; those of a Dask scheduler come and go."""

    def __init__(self, executor: Executor, workers: int) -> None:
        self._count = int(getattr(executor, "_max_workers", 0) or workers)
        self._client = getattr(executor, "_client", None)
        self._asked = float("-inf")

    def __call__(self) -> int:
        if self._client is not None and time.monotonic() - self._asked > ASK:
            self._asked = time.monotonic()
            self._count = max(1, sum(self._client.nthreads().values()))
        return self._count


def solve_spans(
    points: Sequence[Experiment],
    spans: Iterable[Span],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    seconds: float = 0.25,
) -> Generator[Table | None, None, None]:
    """Solve spans of samples, and yield tables as they are done.

    At most two pieces of work a worker are under way at once, so that memory stays bounded whatever
    the number of samples. None is yielded about every second while nothing is done. Closing the
    generator cancels what has not begun.

    Parameters
    ----------
    points : sequence of Experiment
    spans : iterable of Span
    executor : concurrent.futures.Executor, optional
        Threads if left out.
    workers : int
        Threads, or how many workers the executor has if it does not say.
    seconds : float
        About how long a piece of work takes.

    Raises
    ------
    WorkerError
        If a worker is lost, or has other versions.
    """
    waiting = deque(spans)
    left = sum(span.samples for span in waiting)
    sizer = Sizer(seconds)

    def cut(slots: int) -> Span:
        nonlocal left
        span = waiting.popleft()
        size = sizer.next(points[span.point], span, left, slots)
        if size < span.samples:
            waiting.appendleft(Span(span.point, span.first + size, span.samples - size))
        left -= size
        return Span(span.point, span.first, size)

    with ExitStack() as stack:
        # The kernels are the parallel part; threads of BLAS below them only get in the way.
        stack.enter_context(one_blas_thread())
        if executor is None and workers == 1:
            while waiting:
                span = cut(1)
                table = solve_span(points[span.point], span)
                sizer.learn(span.point, table)
                yield table
            return
        if executor is None:
            executor = stack.enter_context(ThreadPoolExecutor(workers))
        slots, parent = Slots(executor, workers), process_name()
        running: dict[Future[Table], Span] = {}
        try:
            while waiting or running:
                while waiting and len(running) < 2 * slots():
                    span = cut(slots())
                    future = executor.submit(
                        solve_span, points[span.point], span, parent, versions()
                    )
                    running[future] = span
                done, _ = wait(running, timeout=TICK, return_when=FIRST_COMPLETED)
                for future in done:
                    span = running.pop(future)
                    table = _result(future, span, points[span.point].seed)
                    sizer.learn(span.point, table)
                    yield table
                if not done:
                    yield None
        finally:
            for future in running:
                future.cancel()


def _result(future: Future[Table], span: Span, seed: int) -> Table:
    try:
        return future.result()
    except WorkerError:  # it was refused, and says why
        raise
    except Exception as error:
        last = span.first + span.samples - 1
        raise WorkerError(
            f"the worker on samples {span.first} to {last} of point {span.point} (seed {seed}) was"
            f" lost: {type(error).__name__}: {error}"
        ) from error


def missing_spans(done: Any, first: int) -> list[Span]:
    """Return the stretches of samples that are not done, point after point.

    Parameters
    ----------
    done : (points, samples) array of bool
    first : int
        Number of the first sample.
    """
    points, samples = done.shape
    flags = np.zeros(points * (samples + 1) + 1, dtype=np.int8)  # a zero before each point
    flags[1:].reshape(points, samples + 1)[:, :-1] = ~done
    edges = np.diff(flags)
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [
        Span(start // (samples + 1), first + start % (samples + 1), stop - start)
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)
    ]
