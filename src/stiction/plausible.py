"""Strengths that no solid has, made of heights without a unit."""

from __future__ import annotations

import math
from collections.abc import Mapping

from stiction.errors import UnitWarning, warn_user

TYPICAL = 1e6
"""Pa; shear strength of polymers in the laboratory, where surfaces are measured."""


def is_strength(value: float) -> bool:
    """Whether some solid may have such a mean strength (Pa)."""
    return 1e2 <= value <= 1e10


def warn_of_mapped(strength: float, others: Mapping[str, float]) -> None:
    """Warn of a mean strength (Pa) made of heights without a unit; `others`: if in which one."""
    fits = {unit: abs(math.log(value / TYPICAL)) for unit, value in others.items()
            if is_strength(value)}  # fmt: skip
    unit = min(fits, key=lambda unit: fits[unit]) if fits else None
    advice = f"perhaps they are in {unit}: unit={unit!r}" if unit else "check the units"
    warn_user(
        f"strength: makes {strength:.4g} Pa in the mean of values that state no unit, taken as m;"
        f" {advice}",
        UnitWarning,
    )
