"""Running an ensemble into a folder: what is there stays, what is missing is computed."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor

from stiction.ensemble.monte_carlo import method_name, warn_of_fields
from stiction.ensemble.part import Part
from stiction.ensemble.plan import Plan
from stiction.ensemble.points import variables_in
from stiction.ensemble.scheduler import share_out, usable_cores
from stiction.ensemble.store_writer import StoreWriter
from stiction.ensemble.work import Failure, Outcome
from stiction.errors import InputError
from stiction.progress import Meter, Show

FLUSH_SECONDS = 1.0
FLUSH_BYTES = 32 * 2**20
HOPELESS = 16


def run_stored(
    store: StoreWriter,
    plans: Sequence[Plan],
    samples: int,
    *,
    first: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Show = True,
    retry: bool = False,
    time_limit: float | None = None,
    part: Part | None = None,
) -> list[Failure]:
    """Compute what is missing in a store, or in a part, and store it about once a second.

    Samples that fail are listed in the store and the others go on, unless all fail from the
    start. When the seconds of `time_limit` are over, it ends; what is missing stays missing.

    Returns
    -------
    list of Failure
        All samples of the run that have failed.

    Raises
    ------
    InputError
        If the first samples of a point all fail.
    StoreError
        If results cannot be written.
    WorkerError
        If workers are lost.
    """
    spans = store.missing(len(plans), samples, first, retry=retry, part=part)
    if spans:
        warn_of_fields(plans)
    to_do = sum(span.samples for span in spans)
    variables = variables_in(plans)
    alive = {point for chunk in store.chunks for point in chunk.done[:, 0].tolist()}
    lost: dict[int, int] = {}
    buffer: list[Outcome] = []
    flushed = time.monotonic()

    def flush() -> None:
        nonlocal flushed
        if buffer:
            outcomes = list(buffer)
            buffer.clear()
            store.add(outcomes, variables)
        flushed = time.monotonic()

    work = share_out(
        plans,
        spans,
        executor=executor,
        workers=usable_cores() if workers is None else workers,
        seconds=FLUSH_SECONDS,
    )
    with Meter(method_name(plans), to_do, progress, time_limit=time_limit) as meter:
        try:
            for outcome in work:
                if outcome is not None:
                    buffer.append(outcome)
                    meter.advance(outcome.count)
                    _give_up_if_hopeless(outcome, alive, lost)
                late = time.monotonic() - flushed >= FLUSH_SECONDS
                if late or sum(outcome.nbytes for outcome in buffer) >= FLUSH_BYTES:
                    flush()
                if meter.over:
                    break
        finally:  # also on Ctrl-C, and when workers are lost: what is done is kept
            work.close()
            flush()
    return list(store.failures.values())


def _give_up_if_hopeless(outcome: Outcome, alive: set[int], lost: dict[int, int]) -> None:
    point = outcome.point
    if outcome.samples.size:
        alive.add(point)
    if point in alive:
        return
    lost[point] = lost.get(point, 0) + len(outcome.failures)
    if lost[point] >= HOPELESS:
        raise InputError(
            f"the first {lost[point]} samples of point {point} all failed, such as"
            f" {outcome.failures[0]}"
        )
