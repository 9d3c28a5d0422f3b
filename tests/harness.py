"""One trial of a call with odd arguments, under limits of time and memory."""

from __future__ import annotations

import resource
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SECONDS = 10.0
BYTES = 2 * 2**30


class Hang(BaseException):
    """A trial ran longer than it may; no `except Exception` of the package catches it."""


@contextmanager
def limits(seconds: float = SECONDS, extra_bytes: int = BYTES) -> Iterator[None]:
    """Raise `Hang` after so many seconds, and MemoryError beyond so many more bytes."""

    def ring(number: int, frame: Any) -> None:
        raise Hang

    with open("/proc/self/statm", "rb") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGALRM, ring)
    resource.setrlimit(resource.RLIMIT_AS, (now + extra_bytes, hard))
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        signal.signal(signal.SIGALRM, before)


def trial(call: Callable[[], Any], seconds: float = SECONDS) -> tuple[str, str]:
    """Outcome of one call that may be refused, and a word on it.

    'fine'; 'refused' with an `InputError`, a `RunError` or the `TimeoutError` of a time limit;
    'FAULT' with a traceback, a hang, too much memory, or a refusal without a word.
    """
    from stiction import InputError, RunError

    begin = time.perf_counter()
    try:
        with limits(seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
        outcome = "fine", ""
    except (InputError, RunError, TimeoutError) as error:
        outcome = ("refused", str(error)) if str(error).strip() else ("FAULT no word", "")
    except Hang:
        return "FAULT hang", f"{time.perf_counter() - begin:.1f} s"
    except MemoryError as error:
        outcome = "FAULT memory", str(error)[:100]
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        if Path(last.filename).parent.name == "fuzz":
            return "fine", "an error of the caller's own function"
        where = f"{last.filename.rsplit('stiction/', 1)[-1]}:{last.lineno}"
        text = " ".join(str(error).split())[:120]
        outcome = "FAULT traceback", f"{type(error).__name__}: {text} ({where})"
    if time.perf_counter() - begin > seconds:  # in compiled code, where no signal gets in
        return "FAULT hang", f"{time.perf_counter() - begin:.1f} s"
    return outcome
