"""A small study, stored in many chunks within milliseconds: what faults and damage are tried on."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr

import stiction as st
from stiction.ensemble import resume

PLAIN: dict[str, Any] = {
    "problem": {
        "solid": {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0},
        "interface": {"length": 0.1, "nodes": 64},
        "friction": {"weakening_rate": 0.1e12},
    },
    "random": {
        "strength": {
            "marginal": {"type": "beta", "alpha": 1.5, "beta": 3.0, "low": 0.66e6, "high": 1.66e6},
            "spectrum": {"type": "power_law", "correlation_length": 0.02},
        }
    },
    "method": {"type": "local_criterion"},
    "ensemble": {"samples": 20, "seed": 3, "keep": ["strength"], "keep_samples": [0, 7]},
    "sweep": [{"problem.interface.length": [0.1, 0.11, 0.12]}],
}


def study(samples: int = 20) -> st.Study:
    """Three points of so many samples."""
    plain = copy.deepcopy(PLAIN)
    plain["ensemble"]["samples"] = samples
    return st.Study.from_dict(plain)


def place() -> str | None:
    """Where to put the files: in memory if that is possible, since every write is synced."""
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


@contextmanager
def many_chunks() -> Iterator[None]:
    """Every piece of work is written at once."""
    before = resume.FLUSH_SECONDS
    resume.FLUSH_SECONDS = 0.0
    try:
        yield
    finally:
        resume.FLUSH_SECONDS = before


def run(path: Path, samples: int = 20) -> xr.Dataset:
    """Run it, or what is missing of it."""
    with many_chunks(), warnings.catch_warnings():
        warnings.simplefilter("ignore", st.AccuracyWarning)
        return study(samples).run(out=path, workers=1)


def warned(caught: list[warnings.WarningMessage]) -> bool:
    """Whether anything but a remark on accuracy was said."""
    return any(not issubclass(w.category, st.AccuracyWarning) for w in caught)
