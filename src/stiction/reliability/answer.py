"""What a failure probability and a design stress are reported with, and their common options."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from stiction.arrays import Array
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError, warn_accuracy
from stiction.methods import label, study_attributes
from stiction.model import _count, _number
from stiction.problem import PROFILES
from stiction.progress import Meter, duration
from stiction.reliability.guide import too_slow, two_levels_refused
from stiction.reliability.limit_state import Event, LimitState
from stiction.reliability.subset import Level
from stiction.results import ONSET_VARIABLES, along

TargetCv: TypeAlias = Annotated[
    float, BeforeValidator(_number), Field(ge=1e-6, allow_inf_nan=False)
]
"""A smaller coefficient of variation would take more than 1e12 failures."""
Confidence: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, lt=1)]
Probability: TypeAlias = Annotated[float, BeforeValidator(_number), Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[int, BeforeValidator(_count), Field(ge=100)]
Seed: TypeAlias = Annotated[int, BeforeValidator(_count), Field(ge=0)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Answer:
    """What both answers hold.

    Attributes
    ----------
    stress : float
        Pa.
    probability : float
        Of an onset below `stress`.
    interval : tuple of float
        Confidence interval of what was asked for.
    cv : float
        Coefficient of variation of the probability at `stress`: estimated standard error over the
        estimate; infinite if no failure was seen, zero if exact.
    evaluations, first_stage_evaluations : int
        Samples that the method was asked for, and only its less expensive first stage.
    lower_bound, stress_above_bound : float
        Pa; no sample slides below `lower_bound`.
    algorithm : str
        'plain', 'subset', 'two_level' or 'exact' (nothing had to be sampled).
    reason : str
        Why this algorithm.
    confidence : float
        Of `interval`.
    diagnostics : dict
        Numbers that belong to the algorithm, by name.
    cut_short : bool
        Whether `time_limit` ended it before `target_cv` was reached.
    warnings : tuple of str
        Why the answer is not to be trusted; empty if it is.
    normal_pressure : float
        Mean over the interface, Pa; NaN if the problem has none.
    friction_coefficient : float
        `stress` over `normal_pressure`; NaN without one.
    """

    stress: float
    probability: float
    interval: tuple[float, float]
    cv: float
    evaluations: int
    lower_bound: float
    algorithm: str
    reason: str
    confidence: float
    first_stage_evaluations: int = 0
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

    @property
    def _place(self) -> str:
        """The coefficient and the distance from the bound, in words where there are any."""
        text = ""
        if math.isfinite(self.normal_pressure):
            text = f" (friction coefficient {self.friction_coefficient:.4g})"
        if bounded(self.lower_bound):
            text += f", {self.stress_above_bound / 1e3:.4g} kPa above the bound"
        return text

    @property
    def _effort(self) -> str:
        text = f"{self.algorithm}, {self.evaluations} evaluations"
        return text + ", cut short" * self.cut_short


@dataclass(frozen=True, eq=False, kw_only=True)
class FailureProbability(Answer):
    """Probability that an interface slides below a stress, with its error; see also `Answer`.

    Attributes
    ----------
    levels : tuple of Level
        Of the first repetition of subset simulation; empty for other algorithms.
    failing_profiles : xarray.Dataset
        Some samples from the failure set over ('sample', 'x'), as likely as they are there:
        `strength` (and what else is random), `critical_stress`, `critical_position`, ...
    """

    levels: tuple[Level, ...] = ()
    failing_profiles: xr.Dataset = field(default_factory=xr.Dataset, repr=False)

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"P = {self.probability:.3g} ({100 * self.confidence:g} %: {low:.3g} to {high:.3g},"
            f" c.o.v. {self.cv:.2g}) below {self.stress / 1e6:.6g} MPa{self._place};"
            f" {self._effort}"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignStress(Answer):
    """A stress and the probability that the interface slides below it; see also `Answer`.

    Attributes
    ----------
    median_stress : float
        Median stress at onset of 200 plain samples, Pa: what every second joint holds.
    median_over_design : float
        `median_stress` over `stress`.
    """

    median_stress: float = math.nan

    @property
    def median_over_design(self) -> float:
        """`median_stress` over `stress`: how far a design stays below what is typical."""
        return self.median_stress / self.stress

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.stress / 1e6:.7g} MPa ({100 * self.confidence:g} %: {low / 1e6:.7g} to"
            f" {high / 1e6:.7g}){self._place}, at P = {self.probability:g}; {self._effort}"
        )


def prepare(
    experiment: Experiment,
    event: Event,
    workers: int | None,
    meter: Meter,
    *,
    per_pressure: bool = False,
    algorithm: str = "subset",
    max_evaluations: int | None = None,
) -> LimitState:
    """Return the limit state, or an `InputError` if the algorithm cannot be used."""
    state = LimitState(experiment, event, per_pressure, workers or usable_cores(), meter)
    problems = []
    if per_pressure and not experiment.pressure > 0.0:
        problems.append("friction_coefficient: needs a normal pressure (load.normal_pressure, Pa)")
    if algorithm in ("subset", "two_level") and (slow := too_slow(state, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and (reason := two_levels_refused(state)):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    experiment.check_fields()
    return state


def bounded(lowest: float) -> bool:
    """Return whether a least possible stress says anything: zero or none does not."""
    return bool(np.isfinite(lowest) and lowest > 0.0)


def short_of(state: LimitState, evaluations: int) -> str:
    """Return that there were too few evaluations, and what to do."""
    return f"{ran_out(state, evaluations)} do not suffice; {advice(state)}"


def ran_out(state: LimitState, evaluations: int) -> str:
    """Return what was not enough, in words."""
    limit = duration(state.meter.time_limit or 0.0)
    return f"{evaluations} evaluations" + (f" in {limit}" if state.meter.over else "")


def advice(state: LimitState) -> str:
    """Return how to get more evaluations."""
    return "raise time_limit" if state.meter.over else "raise max_evaluations"


def imprecise(state: LimitState, cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return that the estimate is less precise than asked for, if so, and what to do."""
    if cv <= target_cv:
        return []
    why = short_of(state, evaluations)
    return [f"the coefficient of variation is {cv:.3g}, not {target_cv:g}: {why}"]


def nothing_known(state: LimitState) -> TimeoutError:
    """Return the error that ends an answer without any estimate."""
    limit = duration(state.meter.time_limit or 0.0)
    return TimeoutError(f"nothing is known after {limit}: {advice(state)}")


def warned(texts: list[str]) -> tuple[str, ...]:
    """Issue texts as warnings and return them."""
    for text in texts:
        warn_accuracy(text)
    return tuple(texts)


def distinct(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions with different values, in random order."""
    _, first = np.unique(values, return_index=True)  # chains repeat states
    chosen: NDArray[np.int64] = rng.permutation(first)[:count]
    return chosen


def profiles_of(state: LimitState, draws: Array) -> xr.Dataset:
    """Return profiles and onset of some draws, labelled."""
    if draws.shape[0] == 0:
        return xr.Dataset()
    problem, method = state.experiment.problem, state.experiment.method
    profiles = state.profiles(draws)
    onset = state.experiment.onset(profiles)
    values = dict(profiles) | {name: onset[name] for name in ONSET_VARIABLES}
    meaning = {name: along(problem.interface, PROFILES[name]) for name in profiles}
    attributes = study_attributes(problem, method)
    return label(problem, method, values, np.arange(draws.shape[0]), attributes, meaning)
