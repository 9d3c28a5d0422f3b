"""What many tests assert: equal bits, orders of accuracy, means within their standard errors."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pytest


def assert_same(found: Mapping[Any, Any], expected: Mapping[Any, Any]) -> None:
    """Arrays of the same names and types are equal bit by bit."""
    assert set(found) == set(expected)
    for name in found:
        one, other = np.asarray(found[name]), np.asarray(expected[name])
        assert one.dtype == other.dtype, name
        assert one.shape == other.shape, name
        assert one.tobytes() == other.tobytes(), name


def assert_second_order(errors: Any, within: float) -> None:
    """Halving a step divides each error by four."""
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(4.0, abs=within)


def standard_error(values: Any) -> float:
    """Standard error of the mean of independent values."""
    return float(np.std(values, ddof=1) / len(values) ** 0.5)


def assert_mean(values: Any, expected: float, errors: float) -> None:
    """The mean is as expected, within so many of its standard errors."""
    assert abs(np.mean(values) - expected) < errors * standard_error(values)
