"""What a failure probability is reported with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.errors import warn_accuracy
from stiction.methods import label, study_attributes
from stiction.problem import PROFILES
from stiction.reliability.limit_state import LimitState
from stiction.reliability.subset import Level
from stiction.results import ONSET_VARIABLES, along


@dataclass(frozen=True, eq=False)
class FailureProbability:
    """Probability that an interface slides below a stress, with how far it can be trusted.

    Attributes
    ----------
    probability : float
        Of an onset stress below `stress`.
    coefficient_of_variation : float
        Estimated standard error over the estimate; infinite if no failure was seen, zero if exact.
    interval : tuple of float
        Confidence interval of the probability.
    evaluations : int
        Samples that the method was asked for.
    first_stage_evaluations : int
        Samples that only the local criterion, as a cheap first stage, was asked for.
    stress : float
        Pa.
    lower_bound, stress_above_bound : float
        Pa; no sample slides below `lower_bound`, so that a rare failure is told by how little
        `stress` is above it.
    algorithm : str
        'plain', 'subset', 'importance', 'two_level', 'exact' (nothing had to be sampled) or
        'none' (the time was over before anything was known; `probability` is NaN).
    reason : str
        Why this algorithm.
    confidence : float
        Of `interval`.
    levels : tuple of Level
        Of the first subset run; empty for other algorithms.
    failing_profiles : xarray.Dataset
        Some samples from the failure set over ('sample', 'x'), as likely as they are there:
        `strength` (and what else is random), `critical_stress`, `critical_position`, ...
    diagnostics : dict
        Numbers that belong to the algorithm, by name.
    cut_short : bool
        Whether `time_limit` ended it before `target_cv` was reached.
    warnings : tuple of str
        Why the estimate is not to be trusted; empty if it is.
    normal_pressure : float
        Mean over the interface, Pa; NaN if the problem has none.
    """

    probability: float
    coefficient_of_variation: float
    interval: tuple[float, float]
    evaluations: int
    stress: float
    lower_bound: float
    algorithm: str
    reason: str
    confidence: float
    first_stage_evaluations: int = 0
    levels: tuple[Level, ...] = ()
    failing_profiles: xr.Dataset = field(default_factory=xr.Dataset, repr=False)
    diagnostics: Mapping[str, float] = field(default_factory=dict, repr=False)
    cut_short: bool = False
    warnings: tuple[str, ...] = ()
    normal_pressure: float = math.nan

    @property
    def friction_coefficient(self) -> float:
        """`stress` over the mean normal pressure; NaN without one."""
        return self.stress / self.normal_pressure

    @property
    def stress_above_bound(self) -> float:
        """`stress` less `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"P = {self.probability:.3g} ({100 * self.confidence:g} %: {low:.3g} to {high:.3g},"
            f" c.o.v. {self.coefficient_of_variation:.2g}) below {self.stress / 1e6:.6g} MPa"
            f"{as_coefficient(self.friction_coefficient)}"
            f"{above_bound(self.stress, self.lower_bound)};"
            f" {self.algorithm}, {self.evaluations} evaluations"
            f"{', cut short' if self.cut_short else ''}"
        )


def as_coefficient(value: float) -> str:
    """A coefficient in words; nothing where there is none."""
    return f" (friction coefficient {value:.4g})" if math.isfinite(value) else ""


def bounded(lowest: float) -> bool:
    """Whether a least possible stress says anything: zero or none is no bound worth naming."""
    return bool(np.isfinite(lowest) and lowest > 0.0)


def above_bound(stress: float, lowest: float) -> str:
    """How far a stress is above the bound, in words; nothing where there is no bound."""
    return f", {(stress - lowest) / 1e3:.4g} kPa above the bound" if bounded(lowest) else ""


def say(texts: list[str]) -> tuple[str, ...]:
    """Issue texts as warnings and return them."""
    for text in texts:
        warn_accuracy(text)
    return tuple(texts)


def distinct(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Up to `count` positions with different values, in random order: chains repeat states."""
    _, first = np.unique(values, return_index=True)
    chosen: NDArray[np.int64] = rng.permutation(first)[:count]
    return chosen


def profiles_of(state: LimitState, draws: Array) -> xr.Dataset:
    """Profiles and onset of some draws, labelled."""
    if draws.shape[0] == 0:
        return xr.Dataset()
    profiles = state.profiles(draws)
    onset = state.onset(profiles)
    values = dict(profiles) | {name: onset[name] for name in ONSET_VARIABLES}
    interface = state.problem.interface
    meaning = {name: along(interface, PROFILES[name]) for name in profiles}
    attributes = study_attributes(state.problem, state.method)
    return label(
        state.problem, state.method, values, np.arange(draws.shape[0]), attributes, meaning
    )
