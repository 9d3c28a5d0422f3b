"""Methods of somebody else: the local criterion with other onsets."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from setups import LOCAL


@dataclasses.dataclass(frozen=True)
class StandIn:
    """The onset as a function of the samples and of the onsets by the local criterion."""

    onset: Callable[[Any, Any], Any]
    type: str = "stand_in"
    first_stage: str | None = None
    exact_method: str | None = None
    scaling: str = "none"
    seconds: Any = 1e-4
    label = "stand-in"
    variables = staticmethod(LOCAL.variables)
    supports = staticmethod(lambda problem: [])

    def seconds_per_sample(self, problem: Any) -> float:
        return self.seconds

    def prepare(self, problem: Any) -> Any:
        solve = LOCAL.prepare(problem)

        def changed(rows: Any) -> Any:
            values = solve(rows)
            return values | {"critical_stress": self.onset(rows, values["critical_stress"])}

        return changed
