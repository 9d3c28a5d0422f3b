"""Checks of arguments that are no part of a model object."""

from __future__ import annotations

import math
import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import describe, real_array, whole

MOST_SAMPLES = 10**10
LAST_SAMPLE = 2**62


def is_whole(value: Any, least: int) -> bool:
    """Whether a value is a whole number (1e4 too), and not less than `least`."""
    number = whole(value)
    return number is not None and number >= least


def is_real(value: Any) -> bool:
    """Whether a value is a number and neither text nor a truth value; NaN and infinity are."""
    if not isinstance(value, int | float | np.integer | np.floating) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def is_finite(value: Any) -> bool:
    """Whether a value is a finite number."""
    return is_real(value) and math.isfinite(value)


def check_count(name: str, value: Any, least: int) -> int:
    """`value` as an int (1e4 too), if it is a whole number of at least `least`."""
    number = whole(value)
    if number is None or number < least:
        raise InputError(f"{name}: must be a whole number >= {least}, got {describe(value)}")
    return number


def check_choice(name: str, value: Any, valid: Collection[str]) -> None:
    """Refuse what is not one of some names."""
    if not isinstance(value, str) or value not in valid:
        names = " or ".join(repr(known) for known in valid)
        raise InputError(f"{name}: must be {names}, got {describe(value)}")


def check_flag(name: str, value: Any) -> None:
    """Refuse what is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name}: must be True or False, got {describe(value)}")


def check_instance(name: str, value: Any, kind: type) -> None:
    """Refuse what is no object of a class, such as arguments that changed places."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIO" else "a"
        raise InputError(f"{name}: must be {article} {kind.__name__}, got {describe(value)}")


def check_progress(value: Any) -> None:
    """Refuse what is neither a truth value nor a function."""
    function = callable(value) and not isinstance(value, type)
    if not function and not isinstance(value, bool | np.bool_):
        raise InputError(f"progress: must be True, False or a function, got {describe(value)}")


def check_memory(name: str, needed: float, advice: str = "ask for fewer") -> None:
    """Refuse what this machine has no memory for, before it begins to swap."""
    try:
        there = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # systems that do not say
        return
    if needed > there:
        raise InputError(
            f"{name}: this takes {needed / 2**30:,.1f} GiB of memory, more than the"
            f" {there / 2**30:,.1f} GiB of this machine; {advice}"
        )


def numbers(name: str, value: Any) -> Array:
    """`value` as a float64 array, or an `InputError` that says what it is instead."""
    try:
        return real_array(value)
    except (TypeError, OverflowError) as error:
        raise InputError(f"{name}: must be numbers; {error}") from None


def as_names(name: str, value: Any) -> tuple[str, ...]:
    """`value` as names, or an `InputError` that says what it is instead."""
    if not isinstance(value, list | tuple | set | frozenset) or not all(
        isinstance(one, str) for one in value
    ):
        raise InputError(f"{name}: must be a list of names, got {describe(value)}")
    return tuple(value)


def as_path(name: str, value: Any) -> Path:
    """`value` as a path, or an `InputError` that says what it is instead."""
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise InputError(f"{name}: must be a path, got {describe(value)}")
    text = os.fspath(value)
    if not text or "\0" in text:
        raise InputError(f"{name}: must be a path, got {describe(text)}")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise InputError(
            f"{name}: {describe(text)} is no valid UTF-8, which NetCDF and JSON need; rename it"
        ) from None
    if any(len(os.fsencode(part)) > 255 for part in Path(text).parts):
        raise InputError(f"{name}: {describe(text)} is too long a name for a file")
    return Path(text)


def too_many_samples(samples: int, first: int, points: int = 1) -> list[str]:
    """What is wrong with these numbers: nobody has so many samples, so a unit or key slipped."""
    problems = []
    if samples * points > MOST_SAMPLES:
        at = f" at each of {points} points" if points > 1 else ""
        problems.append(
            f"samples: must be at most {MOST_SAMPLES:.0e} in all, got {describe(samples)}{at}"
        )
    if first > LAST_SAMPLE:
        problems.append(f"first: must be at most 2**62, got {describe(first)}")
    return problems
