"""What every study is given: the setting, how many samples, and whom to tell of progress."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import xarray as xr

from stiction.ensemble.run import monte_carlo
from stiction.errors import AccuracyWarning
from stiction.fields.random_field import RandomField
from stiction.paper.setting import Setting
from stiction.problem import Problem

Progress = Callable[[str, int, int], None]
"""Called with what is being done, samples done and samples in all."""


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
    progress : callable, optional
        Gets (title, samples done, samples in all).
    warnings : dict of str to int
        Accuracy warnings that came up, with how often; the report shows them.
    """

    setting: Setting
    samples: int
    seed: int
    workers: int | None = None
    progress: Progress | None = None
    warnings: dict[str, int] = field(default_factory=dict)
    _title: str = ""
    _done: int = 0
    _total: int = 0

    @property
    def fewer(self) -> int:
        """Samples of a side study."""
        return max(self.samples // 4, min(self.samples, 250))

    def expect(self, total: int) -> None:
        """Set the number of samples that progress counts up to."""
        self._done, self._total = 0, total

    def begin(self, title: str) -> None:
        """Name what is being done."""
        self._title = title
        self._tell(0)

    def _tell(self, count: int) -> None:
        self._done += count
        if self.progress is not None:
            self.progress(self._title, self._done, max(self._total, self._done))

    def monte_carlo(
        self, problem: Problem, strength: RandomField, method: Any, samples: int
    ) -> xr.Dataset:
        """An ensemble of this seed, its accuracy warnings kept for the report."""
        seen = 0

        def report(done: int, total: int) -> None:
            nonlocal seen
            self._tell(done - seen)
            seen = done

        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = monte_carlo(
                problem,
                strength,
                method=method,
                samples=samples,
                seed=self.seed,
                workers=self.workers,
                progress=report,
            )
        for warning in caught:
            if issubclass(warning.category, AccuracyWarning):
                text = f"{self._title}: {warning.message}"
                self.warnings[text] = self.warnings.get(text, 0) + 1
            else:
                warnings.warn_explicit(
                    warning.message, warning.category, warning.filename, warning.lineno
                )
        return result
