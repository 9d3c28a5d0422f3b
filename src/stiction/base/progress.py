"""Report the progress of long work, with the same mechanism everywhere.

After a second, a terminal shows a bar (rich), and a notebook shows an
output that is updated. A pipe receives a line now and then. The working
code reports its progress with `advance`.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeAlias

Show: TypeAlias = bool | Callable[[int, int], None]
"""True shows progress once work takes long, False is silent, a callable
gets (done, total)."""

SILENCE = 1.0
"""Seconds before a bar appears, because short work needs no bar."""
PIPE_INTERVAL, NOTEBOOK_INTERVAL = 10.0, 0.5
"""Seconds between lines in a pipe, at least, and between updates in a
notebook."""
GONE = AttributeError, OSError, ValueError
"""Errors of a stderr that is None, hung up, a broken pipe or closed.
The work goes on."""

interrupted = threading.Event()
"""Set by a signal that ends a run: the exception of its handler is lost
if it comes in a finalizer or a callback from C, where Python ignores
exceptions."""


def duration(seconds: float) -> str:
    """Return seconds as text for people, such as '1.5 h'."""
    sizes = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    most = {"us": 1e-3, "ms": 1.0, "s": 120.0, "min": 7200.0, "h": 172800.0}
    unit = next((unit for unit, below in most.items() if seconds < below), "days")
    return f"{seconds / sizes[unit]:.3g} {unit}"


class Meter:
    """Context manager for the progress of a computation.

    `total` is its size, if known.
    """

    def __init__(
        self, what: str, total: int | None = None, show: Show = True, *, unit: str = "samples"
    ) -> None:
        self.unit, self._show, self._display = unit, show, None
        self.stage(what, total)
        self._begun = time.monotonic()

    def stage(self, what: str, total: int | None = None) -> None:
        """Begin the next part of the work. The clock continues."""
        self.what, self.total, self.done, self.note = what, total, 0, ""
        self._first: tuple[float, int] | None = None

    def advance(self, count: int = 1) -> None:
        """Report that `count` more are done, and end an interrupted run."""
        if interrupted.is_set():
            raise KeyboardInterrupt
        self.done += count
        if self._first is None:  # preparations before the first unit do not count in the rate
            self._first = time.monotonic(), self.done
        if callable(self._show):
            self._show(self.done, self.total or 0)
        elif self in _running and _running[0]._display is None:
            _running[0]._write_line()

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
        self._begun, self._line_due = time.monotonic(), PIPE_INTERVAL
        if self._show is True:
            _running.append(self)
        if _running == [self]:
            self._display = _display()
            if self._display is not None:
                self._starter = threading.Timer(SILENCE, self._display.start)
                self._starter.daemon = True
                self._starter.start()
        return self

    def __exit__(self, *error: object) -> None:
        try:
            if self._display is not None:
                self._starter.cancel()
                with suppress(*GONE):
                    self._display.stop()
                self._starter.join()
                with suppress(*GONE):
                    self._display.stop()  # if it had just started
            elif _running[:1] == [self] and self._line_due > PIPE_INTERVAL:
                self._write_line(last=True)
        finally:  # also after Ctrl-C in these lines
            if self in _running:
                _running.remove(self)

    def _write_line(self, last: bool = False) -> None:
        """Write a line for a pipe if the last line was long ago."""
        if last or self.elapsed >= self._line_due:
            self._line_due = max(self.elapsed + PIPE_INTERVAL, 1.1 * self.elapsed)
            text = f"{_shown().what}: {_shown().text}\n"
            with suppress(*GONE):
                sys.stderr.write(text)
                sys.stderr.flush()


SILENT = Meter("", show=False)
"""Meter for work that is not shown and has no limit."""

_running: list[Meter] = []
"""Meters that are shown, the outermost first."""


def _shown() -> Meter:
    """Return the outermost running meter whose total is known, or else the innermost meter."""
    return next((meter for meter in _running if meter.total), _running[-1])


def _display() -> Any:
    """Return the display of a running meter between `start` and `stop`, or None for a pipe."""
    with suppress(*GONE):
        if sys.stderr.isatty():
            return _bar()
    return _Output() if "ipykernel" in sys.modules else None


def _bar() -> Any:
    """Return a bar that disappears at the end. Printed lines appear above the bar."""
    from rich.console import Console
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.table import Table

    def row() -> Table:
        meter, grid = _shown(), Table.grid(padding=(0, 1))
        size: Any = {"total": meter.total, "completed": meter.done, "width": 30}
        grid.add_row(meter.what, ProgressBar(pulse=not meter.total, **size), meter.text)
        return grid

    options: Any = {"transient": True, "redirect_stdout": False}
    return Live(get_renderable=row, console=Console(stderr=True), **options)


class _Output:
    """An output of a notebook, which is empty at the end. Rich would need ipywidgets."""

    def __init__(self) -> None:
        self._ended = threading.Event()

    def start(self) -> None:
        """Show a running meter until `stop`."""
        from IPython.display import display

        handle = display({}, raw=True, display_id=True)
        while not self._ended.wait(NOTEBOOK_INTERVAL):
            text = f"{_shown().what}: {_shown().text}"
            handle.update({"text/plain": text}, raw=True)
        handle.update({}, raw=True)

    def stop(self) -> None:
        """Stop, and leave an empty output."""
        self._ended.set()
