"""What a failure probability and a design stress are reported with, and their common options."""

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
import xarray as xr
from pydantic import BeforeValidator, Field

from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError, warn_accuracy
from stiction.model import _count, _number
from stiction.progress import Meter
from stiction.reliability.guide import too_slow, two_levels_refused
from stiction.reliability.limit_state import Event, LimitState

TargetCv: TypeAlias = Annotated[
    float, BeforeValidator(_number), Field(ge=1e-6, allow_inf_nan=False)
]
"""A smaller coefficient of variation would take more than 1e12 failures."""
Confidence: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, lt=1)]
Probability: TypeAlias = Annotated[float, BeforeValidator(_number), Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[int, BeforeValidator(_count), Field(ge=100)]


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
    normal_pressure: float
    warnings: tuple[str, ...]
    first_stage_evaluations: int = 0

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


@dataclass(frozen=True, eq=False, kw_only=True)
class FailureProbability(Answer):
    """Probability that an interface slides below a stress, with its error; see also `Answer`.

    Attributes
    ----------
    failing_profiles : xarray.Dataset
        Some samples from the failure set over ('sample', 'x'), as likely as they are there:
        `strength` (and what else is random), `critical_stress`, `critical_position`, ...
    """

    failing_profiles: xr.Dataset = field(default_factory=xr.Dataset, repr=False)

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"P = {self.probability:.3g} ({100 * self.confidence:g} %: {low:.3g} to {high:.3g},"
            f" c.o.v. {self.cv:.2g}) below {self.stress / 1e6:.6g} MPa{self._place};"
            f" {self.algorithm}, {self.evaluations} evaluations"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignStress(Answer):
    """A stress and the probability that the interface slides below it; see `Answer`."""

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.stress / 1e6:.7g} MPa ({100 * self.confidence:g} %: {low / 1e6:.7g} to"
            f" {high / 1e6:.7g}){self._place}, at P = {self.probability:g};"
            f" {self.algorithm}, {self.evaluations} evaluations"
        )


def prepare(
    experiment: Experiment,
    event: Event,
    workers: int | None,
    meter: Meter,
    max_evaluations: int | None,
    *,
    algorithm: str = "subset",
    per_pressure: bool = False,
) -> LimitState:
    """Return the limit state, or an `InputError` if the algorithm cannot be used."""
    state = LimitState(experiment, event, per_pressure, workers or usable_cores(), meter)
    problems = []
    if per_pressure and not experiment.pressure > 0.0:
        problems.append(
            "friction_coefficient: needs a normal pressure (load.normal_pressure, Pa)"
        )
    if algorithm in ("subset", "two_level") and (slow := too_slow(state, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and (reason := two_levels_refused(state)):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    experiment.check_fields()
    return state


AnyAnswer = TypeVar("AnyAnswer", bound=Answer)


def answered(
    kind: type[AnyAnswer], state: LimitState, doubts: list[str], **values: Any
) -> AnyAnswer:
    """Issue the doubts as warnings, and return the answer with them."""
    for text in doubts:
        warn_accuracy(text)
    return kind(
        lower_bound=state.bounds[0],
        normal_pressure=state.experiment.pressure,
        warnings=tuple(doubts),
        **values,
    )


def bounded(lowest: float) -> bool:
    """Return whether a least possible stress says anything: zero or none does not."""
    return bool(np.isfinite(lowest) and lowest > 0.0)


def imprecise(cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return that the estimate is less precise than asked for, if so, and what to do."""
    if cv <= target_cv:
        return []
    return [
        f"the coefficient of variation is {cv:.3g}, not {target_cv:g}: {evaluations} evaluations"
        " do not suffice; raise max_evaluations"
    ]
