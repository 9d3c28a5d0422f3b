"""Errors and warnings: invalid input, and failures of a run."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from typing import TypeAlias

_SYMBOLS = {"E": "youngs_modulus", "nu": "poisson_ratio", "rho": "density"}
_OURS = ("stiction", "pydantic", "dataclasses", "functools", "concurrent", "threading")


class InputError(ValueError):
    """Invalid input: one message that lists every problem.

    Parameters
    ----------
    problems : str or iterable of str
        One text for each mistake; each names the key or argument, what was given and what is valid.

    Attributes
    ----------
    problems : tuple of str
        The same texts, one by one.
    """

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[InputError], tuple[tuple[str, ...]]]:
        return type(self), (self.problems,)


class AccuracyWarning(UserWarning):
    """A result is valid but less accurate than it could be; the message gives the error."""


class UnitWarning(UserWarning):
    """A value that no solid has; it is probably in another unit than assumed."""


class RunError(RuntimeError):
    """A run cannot continue; stored results are kept, and the message gives the remedy."""


class StoreError(RunError):
    """A folder or file cannot be used or written."""


class WorkerError(RunError):
    """Workers died or could not be reached."""


def unknown(given: str, valid: Iterable[str]) -> str:
    """Return a text that refuses a name and offers the nearest valid one."""
    names = list(valid)
    near = get_close_matches(given, names, n=1, cutoff=0.5) or [_SYMBOLS.get(given, "")]
    shown = repr(given) if len(given) <= 60 else f"{given[:57]!r}..."
    hint = f"; did you mean {near[0]!r}?" if near[0] else ""
    return f"unknown {shown}{hint} (valid: {', '.join(names)})"


def unknown_name(what: str, given: str, valid: Iterable[str]) -> str:
    """Return the same text, which begins with what the name is for."""
    return f"{what}: {unknown(given, valid)}"


@contextmanager
def prefixed(name: str, mark: str = ": ") -> Iterator[None]:
    """Let the mistakes that are found meanwhile begin with a name."""
    try:
        yield
    except InputError as error:
        raise InputError([f"{name}{mark}{text}" for text in error.problems]) from None


def warn_accuracy(message: str) -> None:
    """Issue an `AccuracyWarning` that points at the caller's own line, outside this package."""
    warn_user(message, AccuracyWarning)


Warned: TypeAlias = tuple[str, type[Warning]]
"""A warning that was collected instead of issued."""
_collected: ContextVar[list[Warned] | None] = ContextVar("collected", default=None)


@contextmanager
def collect_warnings() -> Iterator[list[Warned]]:
    """Collect the warnings of this package in this thread, and in those that run in its context.

    `warnings.catch_warnings` changes the whole process: two threads would take each other's.
    """
    found: list[Warned] = []
    token = _collected.set(found)
    try:
        yield found
    finally:
        _collected.reset(token)


def warn_user(message: str, category: type[Warning]) -> None:
    """Issue a warning that points at the caller's own line, outside this package."""
    collected = _collected.get()
    if collected is not None:
        collected.append((message, category))
        return
    level = 1
    frame = sys._getframe(1)
    # Objects are validated by pydantic, whose frames lie between ours.
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] in _OURS:
        frame, level = frame.f_back, level + 1
    if frame.f_back is None and frame.f_globals.get("__name__") == "threading":
        known = globals().setdefault("__warningregistry__", {})  # a thread has no caller's line
        warnings.warn_explicit(message, category, "stiction", 0, registry=known)
    else:
        warnings.warn(message, category, stacklevel=level + 1)
