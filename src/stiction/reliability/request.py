"""What is asked of an algorithm, and in words by how much it fell short of that."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stiction.progress import duration
from stiction.reliability.limit_state import LimitState


@dataclass(frozen=True)
class Request:
    """What was asked, checked.

    Attributes
    ----------
    state : LimitState
    stress, target_cv : float
    seed, budget : int
    confidence : float
    pilot : int
        Least samples of plain Monte Carlo.
    spent : int
        Evaluations already made to choose the algorithm.
    """

    state: LimitState
    stress: float
    target_cv: float
    seed: int
    budget: int
    confidence: float
    pilot: int
    spent: int = 0

    def after(self, spent: int) -> Request:
        """The same with less left of the budget."""
        return replace(self, budget=max(0, self.budget - spent), spent=self.spent + spent)


def first_size(usual: int, budget: int) -> int:
    """Samples of a first run: fewer than usual where the budget would not even hold four levels."""
    return min(usual, max(budget // 4, 20))


def short_of(state: LimitState, evaluations: int) -> str:
    """That there were too few evaluations, and what to do."""
    return f"{ran_out(state, evaluations)} do not suffice; {advice(state)}"


def ran_out(state: LimitState, evaluations: int) -> str:
    """What was not enough, in words."""
    limit = duration(state.meter.time_limit or 0.0)
    return f"{evaluations} evaluations" + (f" in {limit}" if state.meter.over else "")


def advice(state: LimitState) -> str:
    """How to get more evaluations."""
    return "raise time_limit" if state.meter.over else "raise max_evaluations"


def missed(request: Request, cv: float, evaluations: int) -> list[str]:
    """That the estimate is less precise than asked for, if so, and what to do."""
    if cv <= request.target_cv:
        return []
    why = short_of(request.state, evaluations)
    return [f"the coefficient of variation is {cv:.3g}, not {request.target_cv:g}: {why}"]


def cut_short(request: Request, cv: float) -> bool:
    """Whether it was the time that ended it."""
    return request.state.meter.over and cv > request.target_cv
