"""Repetitions of subset simulation by number: each depends on (seed, number) only, as a table."""

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import one_blas_thread
from stiction.base.errors import collect_warnings, merged
from stiction.ensemble.batches import NUMBER, POINT, Span, Table, versions
from stiction.ensemble.limit_state import LimitState
from stiction.reliability.subset import Descent, Population, descend
from stiction.reliability.tail import DEEPER
from stiction.reliability.uncertainty import generator

SAMPLES = 2_000
"""Samples of a level."""
STREAM = 4
"""First key of the generators; `tail` has others."""
OF_ALL = ("samples", "threshold", "evaluations", "complete")
OF_LEVEL = ("ceiling", "log_probability")
ROW = np.dtype(
    [
        (POINT, np.int64),
        (NUMBER, np.int64),
        ("samples", np.int64),
        ("threshold", np.float64),
        ("evaluations", np.int64),
        ("complete", np.bool_),
        ("level", np.int64),
        ("ceiling", np.float64),
        ("log_probability", np.float64),
        ("value", np.float64),
        ("ancestor", np.int64),
        ("member", np.int64),
    ]
)
"""A sample of a level, with what its level and its repetition share."""


def repetition(
    state: LimitState,
    number: int,
    smallest: float,
    samples: int = SAMPLES,
    max_evaluations: float = math.inf,
) -> Descent:
    """Return a repetition that goes down to a probability."""
    with one_blas_thread():  # their number changes last bits
        return descend(
            state,
            state.dimension,
            rng=generator(state.experiment.seed, STREAM, number),
            samples=samples,
            max_evaluations=max_evaluations,
            probability=DEEPER * smallest,
            floor=state.bounds[0],
            label=state.member,
        )


def solve_repetition(smallest: float, state: LimitState, span: Span) -> Table:
    """Return the repetition that is the first of a span, as a table of a store."""
    begin, (point, number, _) = time.perf_counter(), span
    with collect_warnings() as warned:
        found = repetition(state, number, smallest)
    rows = np.empty(sum(one.values.size for one in found.populations), ROW)
    rows[POINT], rows[NUMBER] = point, number
    for name in OF_ALL:
        rows[name] = getattr(found, name)
    first = 0
    for level, one in enumerate(found.populations):
        own = rows[first : first + one.values.size]
        own["level"], own["value"], own["ancestor"] = level, one.values, one.ancestors
        own["member"] = one.members
        for name in OF_LEVEL:
            own[name] = getattr(one, name)
        first += one.values.size
    seconds = time.perf_counter() - begin
    return Table(rows, (), seconds, versions(), tuple(merged(warned)))


def repetitions_in(rows: NDArray[Any]) -> Iterator[tuple[int, int, Descent]]:
    """Yield point, number and content of the repetitions in a table, without draws."""
    for group in np.split(rows, _changes(rows, POINT, NUMBER)):
        populations = [
            Population(
                level[0]["ceiling"].item(),
                level[0]["log_probability"].item(),
                level["value"],
                level["ancestor"],
                level["member"],
                np.empty((0, 0)),
            )
            for level in np.split(group, _changes(group, "level"))
        ]
        samples, threshold, evaluations, complete = (group[0][name].item() for name in OF_ALL)
        found = Descent(samples, populations, threshold, evaluations, complete)
        yield int(group[0][POINT]), int(group[0][NUMBER]), found


def _changes(rows: NDArray[Any], *names: str) -> NDArray[np.int64]:
    changed = [np.flatnonzero(np.diff(rows[name])) + 1 for name in names]
    return np.unique(np.concatenate(changed))
