"""What campaigns share: one trial under limits of time and memory, and counts of outcomes."""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SECONDS = 10.0
BYTES = 2 * 2**30
SHOWN = 40


class Hang(BaseException):
    """A trial ran longer than it may; no `except Exception` of the package catches it."""


@dataclass
class Summary:
    """What became of the trials.

    Attributes
    ----------
    seed : int
    counts : Counter
        Trials by outcome; those whose name begins with 'FAULT' must not be.
    faults : list of str
        One line for each trial that must not be.
    """

    seed: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    @property
    def trials(self) -> int:
        """Trials in all."""
        return sum(self.counts.values())

    def note(self, name: str, outcome: str, detail: str = "") -> None:
        """Count the outcome of a trial."""
        self.counts[outcome] += 1
        if outcome.startswith("FAULT"):
            self.faults.append(f"{outcome}: {name}" + (f": {detail}" if detail else ""))

    def __str__(self) -> str:
        lines = [f"{self.trials} trials, seed {self.seed}, {len(self.faults)} faults"]
        lines += [f"  {count:6d} {outcome}" for outcome, count in sorted(self.counts.items())]
        lines += [f"  {fault}" for fault in self.faults[:SHOWN]]
        if len(self.faults) > SHOWN:
            lines.append(f"  and {len(self.faults) - SHOWN} more faults")
        return "\n".join(lines)


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

    'fine'; 'refused' with an `InputError` or `RunError`; 'FAULT' with a traceback, a hang, too much
    memory, or a refusal without a word.
    """
    from stiction import InputError, RunError

    begin = time.perf_counter()
    try:
        with limits(seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
        outcome = "fine", ""
    except (InputError, RunError) as error:
        outcome = ("refused", str(error)) if str(error).strip() else ("FAULT no word", "")
    except Hang:
        return "FAULT hang", f"{time.perf_counter() - begin:.1f} s"
    except MemoryError as error:
        outcome = "FAULT memory", str(error)[:100]
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        if Path(last.filename).parent == Path(__file__).parent:
            return "fine", "an error of the caller's own function"
        where = f"{last.filename.rsplit('stiction/', 1)[-1]}:{last.lineno}"
        text = " ".join(str(error).split())[:120]
        outcome = "FAULT traceback", f"{type(error).__name__}: {text} ({where})"
    if time.perf_counter() - begin > seconds:  # in compiled code, where no signal gets in
        return "FAULT hang", f"{time.perf_counter() - begin:.1f} s"
    return outcome


def command_line(description: str, count: int) -> argparse.Namespace:
    """The options that every campaign has."""
    parser = argparse.ArgumentParser(description=description.split("\n")[0])
    parser.add_argument("--count", type=int, default=count, help="trials at least")
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def finish(summary: Summary) -> None:
    """Print a summary, and exit with 1 if anything happened that must not."""
    print(summary)
    sys.exit(1 if summary.faults else 0)
