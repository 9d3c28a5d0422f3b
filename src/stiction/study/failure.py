"""Failure curves as runs on disk: the store of a study holds their repetitions."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from stiction.base.errors import (
    InputError,
    collect_warnings,
    merge_warnings,
    merged,
    texts_of,
    warn_accuracy,
)
from stiction.base.progress import Meter, Show
from stiction.base.variables import Variable
from stiction.ensemble.batches import (
    NUMBER,
    POINT,
    SerialExecutor,
    Span,
    Table,
    usable_cores,
    versions,
)
from stiction.ensemble.dataset import GridAxes, over_axes, within
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, weakest_first
from stiction.ensemble.monte_carlo import check_fields, complete
from stiction.ensemble.store import Store
from stiction.methods.onset import exact_counterpart
from stiction.methods.protocol import optional_member
from stiction.problem.results import to_dataset
from stiction.reliability.curve import CURVE, chances, curve_doubts, curve_of
from stiction.reliability.subset import Descent, Population
from stiction.reliability.tail import OF_CURVES, Goal, Tail, TailPoint, repetition

VARIABLES = CURVE | {
    "lower_bound": Variable("Pa", "stress below which no interface slides", ())
}


ROW = np.dtype(
    [(name, np.int64) for name in (POINT, NUMBER, "level", "ancestor", "member")]
    + [(name, np.float64) for name in ("ceiling", "log_probability", "value", "threshold")]
    + [("samples", np.int64), ("evaluations", np.int64), ("complete", np.bool_)]
)
"""A sample of a level, with what its level and its repetition share."""
OF_ALL = ("samples", "threshold", "evaluations", "complete")
OF_LEVEL, OF_SAMPLE = ("ceiling", "log_probability"), ("value", "ancestor", "member")


def repetition_of(state: LimitState, smallest: float, number: int) -> Descent:
    """Return the repetition with a given number, down to the smallest probability of a curve."""
    goal = Goal(0.0, probability=smallest)
    return repetition(state, goal, None, OF_CURVES.key, OF_CURVES.first, number)


def solve_repetition(smallest: float, state: LimitState, span: Span) -> Table:
    """Return the first repetition of a span as a table for the store."""
    begin, (point, number, _) = time.perf_counter(), span
    with collect_warnings() as warned:
        descent = repetition_of(state, smallest, number)
    parts = []
    for level, population in enumerate(descent.populations):
        rows = np.empty(population.values.size, ROW)
        rows[POINT], rows[NUMBER], rows["level"] = point, number, level
        for name in OF_ALL:
            rows[name] = getattr(descent, name)
        for name in OF_LEVEL:
            rows[name] = getattr(population, name)
        for name in OF_SAMPLE:
            rows[name] = getattr(population, f"{name}s")
        parts.append(rows)
    seconds = time.perf_counter() - begin
    return Table(np.concatenate(parts), (), seconds, versions(), tuple(merged(warned)))


def repetitions_in(rows: NDArray[Any]) -> Iterator[tuple[int, int, Descent]]:
    """Yield the point, number and content of each repetition in a table, without draws."""
    for (point, number), table in pd.DataFrame(rows).groupby([POINT, NUMBER]):
        populations = []
        for _, level in table.groupby("level"):
            ceiling, chance = (level[name].iloc[0].item() for name in OF_LEVEL)
            values, ancestors, members = (level[name].to_numpy() for name in OF_SAMPLE)
            populations.append(Population(ceiling, chance, values, ancestors, members))
        samples, threshold, evaluations, complete = (
            table[name].iloc[0].item() for name in OF_ALL
        )
        yield point, number, Descent(samples, populations, threshold, evaluations, complete)


class Repetitions:
    """The stored repetitions at all points of a sweep, and their curves."""

    failed = ()  # a repetition does not fail

    def __init__(
        self,
        points: Sequence[Experiment],
        count: int,
        settings: Mapping[str, Any],
        only: Sequence[str] | None = None,
    ) -> None:
        if any(optional_member(point.method, "counted_only") for point in points):
            raise InputError(
                "method: failures of st.Rupture can only be counted. Use st.Equilibrium(),"
                " st.LocalCriterion() or failure_probability(..., algorithm='plain')"
            )
        self.smallest, self._only = settings["smallest"], only
        self.states = [LimitState(point, settings["event"]) for point in points]
        self.done = np.zeros((len(points), count), dtype=np.bool_)
        self._descents: list[dict[int, Descent]] = [{} for _ in points]

    def misfit(self, table: Table) -> str:
        """Return why a table cannot hold repetitions for these points, or ''."""
        rows = table.rows
        if rows.dtype != ROW or table.failures or not rows.size:
            return "it holds no repetitions"
        members = [len(state.experiment.random.members) for state in self.states]
        if not within(rows[POINT], len(self.states)) or rows[NUMBER].min() < 0:
            return "a point or a repetition is not in the study"
        inside = all(within(rows[name], rows["samples"]) for name in ("ancestor", "level"))
        if not inside or not within(rows["member"], np.array(members)[rows[POINT]]):
            return "a level, a sample or a member is not in the repetition"
        return ""

    def add(self, table: Table) -> None:
        """Add the repetitions in a table, but leave out numbers beyond the count."""
        for point, number, descent in repetitions_in(table.rows):
            if number < self.done.shape[1]:
                self._descents[point][number] = descent
                self.done[point, number] = True

    def tail(self, point: int) -> Tail | None:
        """Return the tail at a point from all repetitions there, or None without repetitions."""
        descents = [descent for _, descent in sorted(self._descents[point].items())]
        spent = sum(descent.evaluations for descent in descents)
        return Tail(descents, spent=spent) if descents else None

    def curves(self, attributes: Mapping[str, Any]) -> list[xr.Dataset]:
        """Return the curve at each point of the sweep, or NaN at a point without repetitions."""
        wanted = chances(self.smallest)
        tails = [self.tail(point) for point in range(len(self.states))]
        curves = [
            curve_of(tail, state, wanted, attributes) if tail else None
            for tail, state in zip(tails, self.states, strict=True)
        ]
        known = next((curve for curve in curves if curve is not None), None)
        if known is None:
            raise InputError("run: no repetition is stored yet")
        empty = known.where(False).assign_attrs(lower_bound=np.nan)
        return [empty if curve is None else curve for curve in curves]

    def dataset(self, attributes: Mapping[str, Any], axes: GridAxes) -> xr.Dataset:
        """Return curves as `stiction.failure_curve` does, with the axes of a sweep."""
        curves = self.curves(attributes)
        result = curves[0]
        if axes:
            shared = {
                name: value
                for name, value in result.attrs.items()
                if all(curve.attrs[name] == value for curve in curves)
            }
            values = {str(name): np.stack([curve[name] for curve in curves]) for name in result}
            values["lower_bound"] = np.array([curve.attrs["lower_bound"] for curve in curves])
            result = to_dataset(*over_axes(values, VARIABLES, axes), shared)
        return result[list(self._only)] if self._only else result


def complete_curves(
    rows: Repetitions,
    store: Store,
    *,
    elsewhere: NDArray[Any] | bool,
    workers: int | None,
    executor: Executor | None,
    progress: Show,
    pilot: bool,
) -> None:
    """Compute missing repetitions, except in the mask `elsewhere` (points, repetitions)."""
    store.resume(rows)
    missing, states, cores = ~(rows.done | elsewhere), rows.states, workers or usable_cores()
    with merge_warnings():
        if missing.any():
            check_fields([state.experiment for state in states])
            threads = cores if executor is None else 1
            states = [replace(weakest_first(state), workers=threads) for state in states]
        complete(
            rows,
            states,
            [Span(point, number, 1) for number, point in np.argwhere(missing.T).tolist()],
            partial(solve_repetition, rows.smallest),
            Meter("failure curve", int(missing.sum()), progress, unit="repetitions"),
            store=store,
            executor=executor or SerialExecutor(),
            workers=cores,
        )
        if store.pilot is None and pilot:
            with merge_warnings() as warned:
                for point, state in enumerate(states):
                    tail = rows.tail(point)
                    experiment = state.experiment
                    if exact_counterpart(experiment.problem, experiment.method):
                        # Stored repetitions have no draws.
                        tail = Tail([repetition_of(state, rows.smallest, 0)])
                    if tail is None:
                        continue
                    end = TailPoint(state, tail, tail.quantile(rows.smallest))
                    for text in curve_doubts(end, rows.smallest):
                        warn_accuracy(text)
            store.note_pilot({"doubts": texts_of(warned)})
