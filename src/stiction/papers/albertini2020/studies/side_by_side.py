"""Studies side by side: each begins when those that it needs are done, the costliest first."""

from __future__ import annotations

import contextvars
import dataclasses
import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any, TypeVar

import xarray as xr

from stiction._blas import one_blas_thread
from stiction.ensemble.scheduler import usable_cores
from stiction.errors import AccuracyWarning, Warned, collect_warnings, warn_user
from stiction.papers.albertini2020.registry import Study
from stiction.papers.albertini2020.studies.context import Context

Result = TypeVar("Result")

_TICK = 0.1  # s between two words of progress


class Abandoned(Exception):
    """Nobody waits for the result any more."""


class _Share(Executor):
    """The common threads as one study sees them: adds up the processor time that it takes there."""

    def __init__(self, threads: ThreadPoolExecutor) -> None:
        self._threads = threads
        self._max_workers = threads._max_workers
        self._lock = threading.Lock()
        self.seconds = 0.0

    def submit(self, fn: Callable[..., Result], /, *args: Any, **options: Any) -> Future[Result]:
        """As usual, in the context of the caller, so that its warnings are collected with it."""

        def work() -> Result:
            begin = time.thread_time()
            try:
                return fn(*args, **options)
            finally:
                took = time.thread_time() - begin
                with self._lock:
                    self.seconds += took

        return self._threads.submit(contextvars.copy_context().run, work)


def side_by_side(studies: Iterable[Study], context: Context) -> Iterator[tuple[Study, xr.Dataset]]:
    """Results as they are done; the attribute 'seconds' is the processor time that each took.

    Every study has a thread that leads it, and all share the threads that compute samples, so
    that no core is idle while one study only assembles its result. Results do not depend on what
    runs beside them. What the studies report is passed on from the thread that asks for results.
    After a failure nothing more begins, and what is under way is finished before it is raised.
    Leaving the iteration early abandons the rest.
    """
    waiting = {study.name: study for study in studies}
    done = context.results
    cores = context.workers or usable_cores()
    running: dict[Future[tuple[xr.Dataset, list[Warned]]], tuple[Study, Context]] = {}
    reported: queue.SimpleQueue[int] = queue.SimpleQueue()
    abandoned = threading.Event()
    failures: list[BaseException] = []

    def report(work: int) -> None:
        if abandoned.is_set():
            raise Abandoned
        reported.put(work)

    def begin() -> None:
        ready = [s for s in waiting.values() if done.keys() >= set(getattr(s, "needs", ()))]
        for study in sorted(ready, key=lambda study: -study.cost(context)):
            if len(running) == cores:
                return
            own = dataclasses.replace(
                context,
                executor=_Share(threads),
                report=report,
                warnings={},
                results=dict(done),
            )
            running[leaders.submit(_compute, waiting.pop(study.name), own)] = study, own

    # BLAS has no threads of its own meanwhile: their number would change last bits.
    with (
        one_blas_thread(),
        ThreadPoolExecutor(cores) as threads,
        ThreadPoolExecutor(cores) as leaders,
    ):
        try:
            begin()
            while running:
                ended, _ = wait(running, _TICK, FIRST_COMPLETED)
                while not reported.empty():
                    context.report(reported.get())
                for future in ended:
                    study, own = running.pop(future)
                    if failure := future.exception():
                        failures.append(failure)
                        waiting.clear()
                        continue
                    dataset, others = future.result()
                    done[study.name] = dataset
                    context.warnings.update(own.warnings)
                    for warned in others:  # from here: its thread knows no line of the caller
                        warn_user(*warned)
                    begin()
                    yield study, dataset
            if failures:
                raise failures[0]
        finally:
            abandoned.set()


def _compute(study: Study, context: Context) -> tuple[xr.Dataset, list[Warned]]:
    """The result, and warnings that are not about its accuracy, which the context keeps."""
    begin = time.thread_time()
    with collect_warnings() as caught:
        dataset = study.compute(context)
    others = []
    for warned in caught:
        if issubclass(warned.category, AccuracyWarning):
            text = f"{study.title}: {warned.message}"
            context.warnings[text] = context.warnings.get(text, 0) + 1
        else:
            others.append(warned)
    seconds = time.thread_time() - begin
    if isinstance(context.executor, _Share):
        seconds += context.executor.seconds
    return dataset.assign_attrs(title=study.title, seconds=seconds), others
