"""The study that tests change to what they need: the paper's strength on few nodes."""

from __future__ import annotations

import copy
from functools import reduce
from typing import Any

from recording import stored


def small_study(
    nodes: Any = 128, length: Any = 0.1, weakening_rate: float = 0.25e12,
    correlation_length: float = 4e-3, **tables: Any,
) -> dict[str, Any]:  # fmt: skip
    """A study in plain form; `tables` replace or add those of this name."""
    plain = stored("small_study")
    plain["problem"]["interface"] = {"length": length, "nodes": nodes}
    plain["problem"]["friction"] = {"weakening_rate": weakening_rate}
    plain["random"]["strength"]["spectrum"]["correlation_length"] = correlation_length
    return plain | tables


def lengths(*values: float) -> list[dict[str, Any]]:
    """A sweep of the strength's correlation length, m."""
    return [{"random.strength.spectrum.correlation_length": list(values)}]


def altered(plain: dict[str, Any], **values: Any) -> dict[str, Any]:
    """A copy of a study with other values by key, dots written as __, without those of None."""
    study = copy.deepcopy(plain)
    for path, value in values.items():
        *above, last = path.split("__")
        table = reduce(lambda inner, name: inner.setdefault(name, {}), above, study)
        table[last] = value
        if value is None:
            del table[last]
    return study
