"""Representations that fit on a screen: arrays by shape and range, long tuples by their length."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

_LONG = 6


def brief(self: Any) -> str:
    """Use as `__repr__` of a dataclass: its fields that are not at their default, shortened."""
    parts = []
    for field in dataclasses.fields(self):
        value = getattr(self, field.name)
        if field.repr and not _is_default(value, field.default):
            parts.append(f"{field.name}={_text(value)}")
    return f"{type(self).__name__}({', '.join(parts)})"


def _is_default(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return bool(value == default)


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        shape = " x ".join(str(size) for size in value.shape)
        if value.dtype.kind not in "fiub" or value.size == 0:
            return f"<{shape} array>"
        if value.dtype.kind == "b":
            return f"<{shape} array, {int(value.sum())} true>"
        return f"<{shape} array, {np.nanmin(value):.6g} to {np.nanmax(value):.6g}>"
    if isinstance(value, list | tuple) and len(value) > _LONG:
        return f"<{len(value)} values>"
    if isinstance(value, float):
        return f"{float(value)!r}"  # numpy's own says np.float64(...)
    return repr(value)
