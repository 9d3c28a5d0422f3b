"""What many tests assert: equal bits, orders of accuracy, means, a process that ends well."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
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


def python(*arguments: Any, cwd: Path | None = None, code: int = 0, **environment: Any) -> str:
    """What a process of its own prints, or else complains of; it ends with this code."""
    command = [sys.executable, *map(str, arguments)]
    options = {"capture_output": True, "text": True, "timeout": 600, "cwd": cwd}
    own = os.environ | {name: str(value) for name, value in environment.items()}
    done = subprocess.run(command, env=own, **options)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout or done.stderr


def standard_error(values: Any) -> float:
    """Standard error of the mean of independent values."""
    return float(np.std(values, ddof=1) / len(values) ** 0.5)


def assert_mean(values: Any, expected: float, errors: float) -> None:
    """The mean is as expected, within so many of its standard errors."""
    assert abs(np.mean(values) - expected) < errors * standard_error(values)
