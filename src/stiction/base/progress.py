"""Progress of long work: one mechanism for everything that takes long.

A terminal and a notebook show a line with a bar, a pipe has a line now and then; all of it on
standard error, and only after two seconds. The code that works reports what is done (`advance`).
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from typing import TypeAlias

Show: TypeAlias = bool | Callable[[int, int], None]
"""True shows progress once work takes long; a callable gets (done, total); False is silent."""

AFTER = 2.0
"""Seconds of silence: who waits no longer than this needs no bar."""
LONG = 10.0
"""Seconds between lines in a pipe, at least."""
WIDTH = 100
"""Letters of a line in a notebook."""
TICK = 0.25

interrupted = threading.Event()
"""Set by a signal that ends a run: the exception of its handler is lost if it comes in a finalizer
or a callback from C, where Python ignores exceptions."""


def duration(seconds: float) -> str:
    """Return seconds as text for people, such as '1.5 h'."""
    sizes = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    most = {"us": 1e-3, "ms": 1.0, "s": 120.0, "min": 7200.0, "h": 172800.0}
    unit = next((unit for unit, below in most.items() if seconds < below), "days")
    return f"{seconds / sizes[unit]:.3g} {unit}"


class Meter:
    """Progress of a computation, of `total` units if that is known; a context manager."""

    def __init__(
        self, what: str, total: int | None = None, show: Show = True, *, unit: str = "samples"
    ) -> None:
        self.unit, self._show = unit, show
        self._watcher: threading.Thread | None = None
        self.stage(what, total)
        self._begun = time.monotonic()

    def stage(self, what: str, total: int | None = None) -> None:
        """Begin another part of the work; the clock goes on."""
        self.what, self.total, self.done, self.note = what, total, 0, ""
        self._first: tuple[float, int] | None = None

    def advance(self, count: int = 1) -> None:
        """Report that `count` more are done; end an interrupted run."""
        if interrupted.is_set():
            raise KeyboardInterrupt
        self.done += count
        if self._first is None:  # the rate is that of what follows: preparations come first
            self._first = time.monotonic(), self.done
        if callable(self._show):
            self._show(self.done, self.total or 0)

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._begun

    @property
    def text(self) -> str:
        """Return the progress, the elapsed and the remaining time, in words."""
        of = f" of {self.total:,}" if self.total else ""
        parts = [f"{self.done:,}{of} {self.unit}" if self.done or of else "", self.note]
        parts.append(duration(math.floor(self.elapsed)))
        begin, before = self._first or (0.0, self.done)
        if self.total and self.done > before:
            pace = (time.monotonic() - begin) / (self.done - before)
            left = pace * (self.total - self.done)
            if left >= 1.0:
                parts.append(f"about {duration(round(left))} left")
        return ", ".join(part for part in parts if part)

    def __enter__(self) -> Meter:
        self._begun = time.monotonic()
        if self._show is True:
            _live.append(self)
            if _live[0] is self:
                self._ended = threading.Event()
                self._watcher = threading.Thread(
                    target=_watch, args=(self._ended,), daemon=True
                )
                self._watcher.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self in _live:
            _live.remove(self)
        if self._watcher is not None:
            self._ended.set()
            self._watcher.join()


SILENT = Meter("", show=False)
"""For work that nobody watches and nothing limits."""

_live: list[Meter] = []
"""Meters that run and are shown, the outermost first."""


def _watch(ended: threading.Event) -> None:
    """Show one of the meters that run until the outermost has ended."""
    shown = show = None
    while not ended.wait(TICK):
        old = [meter for meter in tuple(_live) if meter.elapsed >= AFTER]
        if old:  # the outermost whose total is known, else the innermost
            shown = next((meter for meter in old if meter.total), old[-1])
            show = show or _display()
            show(shown, False)
    if shown is not None and show is not None:
        show(shown, True)


def _display() -> Callable[[Meter, bool], None]:
    """Return a function that shows a meter, with a flag at its last call."""
    stream = sys.stderr
    if stream is not None and stream.isatty():
        return _terminal()
    if "ipykernel" in sys.modules:
        return _notebook
    soon = LONG

    def write_line(meter: Meter, last: bool) -> None:  # few lines, however long it takes
        nonlocal soon
        if meter.elapsed >= soon or (last and soon > LONG):
            soon = max(meter.elapsed + LONG, 1.1 * meter.elapsed)
            print(f"{meter.what}: {meter.text}", file=stream, flush=True)

    return write_line


def _with_bar(meter: Meter) -> str:
    full = round(30 * min(1.0, meter.done / meter.total)) if meter.total else 0
    bar = f"[{'#' * full:.<30}] " if meter.total else ""
    return f"{meter.what} {bar}{meter.text}"


def _terminal() -> Callable[[Meter, bool], None]:
    """Return a function that shows a bar, which goes away at the end; warnings appear above it."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    live = Live(
        console=Console(stderr=True), auto_refresh=False, transient=True, redirect_stdout=False
    )

    def show(meter: Meter, last: bool) -> None:
        if last:
            live.stop()
        else:
            live.start()
            live.update(Text(_with_bar(meter), no_wrap=True, overflow="ellipsis"), refresh=True)

    return show


def _notebook(meter: Meter, last: bool) -> None:
    """Show a line that is rewritten, and goes away at the end; rich would need ipywidgets."""
    line = "" if last else _with_bar(meter)
    print(f"\r{line:{WIDTH}}\r", end="", file=sys.stderr, flush=True)
