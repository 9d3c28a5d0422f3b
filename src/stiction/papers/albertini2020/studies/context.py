"""What every study is given: the setting, how many samples, and whom to tell of progress."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr

from stiction.ensemble.monte_carlo import monte_carlo
from stiction.ensemble.scheduler import usable_cores
from stiction.papers.albertini2020.setting import Setting
from stiction.problem import Problem
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface

Item = TypeVar("Item")
Found = TypeVar("Found")

WORK = {"equilibrium": 6, "rupture": 900}
"""Cost of a sample by method, in samples by the local criterion (about 50 microseconds)."""


def work(method: Any, samples: int) -> int:
    """Cost of an ensemble, for progress."""
    return WORK.get(method.type, 1) * samples


def _unheard(count: int) -> None:
    pass


@dataclass
class Context:
    """How studies are run.

    Attributes
    ----------
    setting : Setting
    samples : int
        For each point of the main study; side studies take a quarter.
    seed : int
    workers : int, optional
        Threads; all cores by default.
    executor : Executor, optional
        Threads that studies side by side share; each has its own if it is left out.
    ruptures : int
        Elastodynamic runs at each of the setting's `simulated_ratios`.
    dynamic : int
        Samples of the Monte Carlo study by elastodynamics at each correlation length; 0 for none.
    folder : Path, optional
        Where results of studies are kept, so that an interrupted run goes on.
    report : callable
        Gets the work just finished, see `WORK`.
    warnings : dict of str to int
        Accuracy warnings that came up, with how often; the page shows them.
    results : dict of str to Dataset
        Of the studies that are done; a study may use those that it names in `needs`.
    """

    setting: Setting
    samples: int
    seed: int
    workers: int | None = None
    executor: Executor | None = None
    ruptures: int = 20
    dynamic: int = 0
    folder: Path | None = None
    report: Callable[[int], None] = _unheard
    warnings: dict[str, int] = field(default_factory=dict)
    results: dict[str, xr.Dataset] = field(default_factory=dict)

    @property
    def fewer(self) -> int:
        """Samples of a side study."""
        return max(self.samples // 4, min(self.samples, 250))

    def monte_carlo(
        self,
        problem: Problem,
        random: RandomInterface | RandomField,
        method: Any,
        samples: int,
        first: int = 0,
        weight: int = 1,
    ) -> xr.Dataset:
        """An ensemble of this seed.

        `weight` is how many times as dear as usual a sample is.
        """
        return self.listen(
            lambda tell: monte_carlo(
                problem,
                random,
                method=method,
                samples=samples,
                seed=self.seed,
                first=first,
                workers=self.workers,
                executor=self.executor,
                progress=tell,
            ),
            weight * work(method, 1),
        )

    def map(self, work: Callable[[Item], Found], items: Iterable[Item], each: int) -> list[Found]:
        """`work` of every item, in threads, in the order of the items; each counts as `each`."""
        found = []
        shared = nullcontext(self.executor) if self.executor else None
        with shared or ThreadPoolExecutor(self.workers or usable_cores()) as pool:
            for result in pool.map(work, items):
                found.append(result)
                self.report(each)
        return found

    def listen(
        self, compute: Callable[[Callable[[int, int], None]], xr.Dataset], each: int
    ) -> xr.Dataset:
        """The result of `compute(progress)`; a sample counts as `each` units of work."""
        seen = 0

        def tell(done: int, total: int) -> None:
            nonlocal seen
            self.report((done - seen) * each)
            seen = done

        return compute(tell)
