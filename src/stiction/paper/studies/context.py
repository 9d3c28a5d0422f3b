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
    report : callable
        Gets the number of samples just finished.
    warnings : dict of str to int
        Accuracy warnings that came up, with how often; the page shows them.
    title : str
        Of the study that is running.
    """

    setting: Setting
    samples: int
    seed: int
    workers: int | None = None
    report: Callable[[int], None] = _unheard
    warnings: dict[str, int] = field(default_factory=dict)
    title: str = ""

    @property
    def fewer(self) -> int:
        """Samples of a side study."""
        return max(self.samples // 4, min(self.samples, 250))

    def monte_carlo(
        self, problem: Problem, strength: RandomField, method: Any, samples: int
    ) -> xr.Dataset:
        """An ensemble of this seed, its accuracy warnings kept for the report."""
        seen = 0

        def tell(done: int, total: int) -> None:
            nonlocal seen
            self.report(done - seen)
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
                progress=tell,
            )
        for warning in caught:
            if issubclass(warning.category, AccuracyWarning):
                text = f"{self.title}: {warning.message}"
                self.warnings[text] = self.warnings.get(text, 0) + 1
            else:
                warnings.warn_explicit(
                    warning.message, warning.category, warning.filename, warning.lineno
                )
        return result
