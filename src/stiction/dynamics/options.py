"""What `simulate_rupture` is given, checked at once."""

from __future__ import annotations

from numbers import Real
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from stiction.dynamics.method import Rupture
from stiction.errors import InputError
from stiction.model import FilePath, check, describe, is_finite, is_whole
from stiction.problem import Problem

Stop = Literal["sliding", "onset", "rest", "runaway", "time"]

_MOST_EVERY = 10**6
"""The record of the steps between two frames is kept in memory."""


def _finite(value: Any) -> bool:
    return isinstance(value, Real) and is_finite(value)


def check_options(options: dict[str, Any]) -> None:
    """Refuse what does not fit, all of it in one message."""
    problems = []
    for name in ("every", "every_implicit", "every_near_onset", "checkpoint_every", "chunk"):
        value = options[name]
        if value is None and name == "every_near_onset":
            continue
        if not is_whole(value, 1) or value > _MOST_EVERY:
            given = describe(value)
            problems.append(f"{name}: must be a whole number of steps, 1 to 10**6, got {given}")
    for name in ("interval", "end_time"):
        value = options[name]
        if value is not None and not (_finite(value) and value > 0.0):
            problems.append(f"{name}: must be a positive number of seconds, got {value!r}")
    if not (_finite(options["arrival"]) and 0.0 < options["arrival"] <= 1.0):
        given = describe(options["arrival"])
        problems.append(f"arrival: must be a share of the strength in (0, 1], got {given}")
    if options["stop"] is not None and options["stop"] not in get_args(Stop):
        problems.append(f"stop: must be one of {get_args(Stop)}, got {describe(options['stop'])}")
    elif options["stop"] == "time" and options["end_time"] is None:
        problems.append("end_time: needed with stop='time', got None")
    if (options["initial_slip"] is None) != (options["initial_load"] is None):
        problems.append("initial_slip and initial_load: give both or neither")
    elif options["initial_load"] is not None and not _finite(options["initial_load"]):
        problems.append(f"initial_load: must be a number, Pa, got {options['initial_load']!r}")
    for name in ("store", "checkpoint", "restart"):
        value = options[name]
        if value is None:
            continue
        try:
            check(name, value, FilePath)
        except InputError as error:
            problems += error.problems
            continue
        if name == "checkpoint" and Path(value).is_dir():
            problems.append(f"checkpoint: {str(value)!r} is a folder; name a file")
    told = options["progress"]
    if told is not None and not isinstance(told, bool) and not callable(told):
        problems.append(f"progress: must be true, false or callable, got {describe(told)}")
    if not isinstance(options["steps"], bool | np.bool_):
        problems.append(f"steps: must be True or False, got {describe(options['steps'])}")
    if not isinstance(options["problem"], Problem):
        problems.append(f"problem: must be a Problem, got {describe(options['problem'])}")
    if not isinstance(options["method"], Rupture):
        problems.append(
            "method: must be a method object st.Rupture(loading_rate=...), got "
            f"{describe(options['method'])}"
        )
    if problems:
        raise InputError(problems)
