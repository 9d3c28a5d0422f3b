"""Sharing out: samples in pieces of about a second, through any executor, few in flight at once."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, suppress
from typing import Any, NamedTuple

from stiction.arrays import one_blas_thread
from stiction.ensemble.plan import Plan
from stiction.ensemble.versions import versions
from stiction.ensemble.work import Outcome, do_work, process_mark
from stiction.errors import WorkerError
from stiction.random.draws import BLOCK, block_of

MOST_BYTES = 16 * 2**20
RECENT = 4
TICK = 1.0


class Span(NamedTuple):
    """Samples first .. first + samples - 1 of one point."""

    point: int
    first: int
    samples: int


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Sizer:
    """How many samples go into the next piece.

    About `seconds` of work by what the last pieces took, not more than a fair share of what is
    left, and bounded in bytes. What the pieces are does not touch the numbers.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._rates: dict[int, deque[float]] = {}
        self._last: float | None = None
        self._bytes = 0.0

    def learn(self, outcome: Outcome) -> None:
        """Take note of the time and the size of a piece."""
        if outcome.count:
            rates = self._rates.setdefault(outcome.point, deque(maxlen=RECENT))
            rates.append(outcome.seconds / outcome.count)
            # The fastest of the last few: the first ones may have compiled kernels.
            self._last = min(rates)
            self._bytes = max(self._bytes, outcome.nbytes / outcome.count)

    def next(self, plan: Plan, span: Span, left: int, slots: int) -> int:
        """Samples of the next piece of `span`, of `left` samples in all, for `slots` workers."""
        rates = self._rates.get(span.point)
        rate = min(rates) if rates else self._last
        block = block_of(len(plan.problem.interface.shape))
        size = min(plan.piece, BLOCK) if rate is None else int(self.seconds / max(rate, 1e-9))
        # A fair share of what is left, but not so small that drawing blocks in parts costs more.
        size = min(size, max(-(-left // (2 * slots)), block))
        if plan.wide:
            nodes = plan.problem.interface.size
            bytes_each = max(self._bytes, 8.0 * nodes * len(plan.wide))
            size = min(size, int(MOST_BYTES / bytes_each))
        size = max(1, min(size, span.samples))
        end = span.first + size
        if size > block and size < span.samples:  # draws come in blocks: do not cut one in two
            end -= end % block
        return end - span.first


class Slots:
    """Workers that an executor has now; those of a cluster come and go."""

    def __init__(self, executor: Executor | None, workers: int) -> None:
        self._fixed = int(getattr(executor, "_max_workers", 0) or workers)
        self._client = getattr(executor, "_client", None)
        self._asked = float("-inf")

    def __call__(self) -> int:
        if self._client is not None and time.monotonic() - self._asked > 2.0:
            self._asked = time.monotonic()
            with suppress(OSError):  # a scheduler that is gone: its pieces of work say so
                self._fixed = max(1, sum(self._client.nthreads().values()))
        return self._fixed


def share_out(
    plans: Sequence[Plan],
    spans: Iterable[Span],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    seconds: float = 0.25,
) -> Generator[Outcome | None, None, None]:
    """Compute spans of samples and yield outcomes as they are done.

    No more than two pieces a worker are under way at once, so that memory stays bounded whatever
    the number of samples. None is yielded about every second while nothing is done. Leaving the
    iteration early cancels what has not begun.
    """
    waiting = deque(spans)
    left = sum(span.samples for span in waiting)
    sizer = Sizer(seconds)

    def cut(slots: int) -> Span:
        nonlocal left
        span = waiting.popleft()
        size = sizer.next(plans[span.point], span, left, slots)
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
                outcome = do_work(plans[span.point], *span)
                sizer.learn(outcome)
                yield outcome
            return
        if executor is None:
            executor = stack.enter_context(ThreadPoolExecutor(workers))
        slots, mark = Slots(executor, workers), process_mark()
        watch = getattr(executor, "watch", lambda: None)  # raises when nobody is left to wait for
        running: dict[Future[Outcome], Span] = {}
        try:
            while waiting or running:
                limit = 2 * slots()
                while waiting and len(running) < limit:
                    span = cut(slots())
                    future = executor.submit(do_work, plans[span.point], *span, mark, versions())
                    running[future] = span
                done, _ = wait(running, timeout=TICK, return_when=FIRST_COMPLETED)
                for future in done:
                    outcome = _result(future, running.pop(future), plans)
                    sizer.learn(outcome)
                    yield outcome
                if not done:
                    watch()
                    yield None
        finally:
            for future in running:
                future.cancel()


def _result(future: Future[Any], span: Span, plans: Sequence[Plan]) -> Outcome:
    try:
        outcome: Outcome = future.result()
    except WorkerError:  # it was refused, and says why
        raise
    except Exception as error:
        last = span.first + span.samples - 1
        raise WorkerError(
            f"the worker on samples {span.first} to {last} of point {span.point}"
            f" (seed {plans[span.point].seed}) was lost: {type(error).__name__}: {error}"
        ) from error
    return outcome
