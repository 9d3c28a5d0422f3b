"""One loop for what a run is made of: samples of an ensemble, repetitions of a failure curve."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, closing
from typing import Any

from stiction.base.errors import InputError, RunError, Warned, merge_warnings
from stiction.base.progress import Meter
from stiction.ensemble.batches import Span, Table, solve_spans
from stiction.ensemble.store import Store

HOPELESS = 16
"""Failed items, with none solved, after which the whole run is given up."""


def complete(
    items: Any,
    points: Sequence[Any],
    spans: Sequence[Span],
    solve: Callable[[Any, Span], Table],
    meter: Meter,
    *,
    store: Store | None,
    executor: Executor | None,
    workers: int,
) -> None:
    """Compute spans of items; each table goes to memory and to the store as it is done.

    `items` takes tables (`add`), and knows what is `done`, (points, items). `solve` returns the
    table of a span of a point. One warning stands for those of all tables.
    """
    lost, total = 0, sum(span.samples for span in spans)
    with ExitStack() as stack:
        if store:  # also on Ctrl-C, and when workers are lost: what is done is kept
            stack.callback(store.save)
        warned = stack.enter_context(merge_warnings())
        stack.enter_context(meter)
        work = solve_spans(points, spans, solve, executor=executor, workers=workers)
        for span, table in stack.enter_context(closing(work)):
            if store:
                store.add(table)
            items.add(table)
            warned += table.warned if len(points) == 1 else map(Warned.unnumbered, table.warned)
            meter.advance(span.samples)
            lost += len(table.failures)
            if lost >= min(HOPELESS, total) and not items.done.any():
                failure = table.failures[0]
                texts = [f"{failure.name}: {text}" for text in failure.error.splitlines()]
                raise InputError(texts) if failure.input else RunError("\n".join(texts))
