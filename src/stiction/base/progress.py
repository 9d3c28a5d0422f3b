"""Report the progress of long work, with the same mechanism everywhere.

After a second, a terminal shows a bar (rich), a notebook shows an output that is
updated, and a pipe receives a line now and then. The working code reports its
progress with `advance`.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

Show: TypeAlias = bool | Callable[[int, int], None]
"""True shows progress once work takes long, False is silent, a callable gets (done, total)."""

AFTER, TICK = 1.0, 0.25
"""Seconds of silence, for work that needs no bar, and seconds between updates."""
LONG = 10.0
"""Seconds between lines in a pipe, at least."""

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
    """Context manager for the progress of a computation. `total` is its size, if known."""

    def __init__(
        self, what: str, total: int | None = None, show: Show = True, *, unit: str = "samples"
    ) -> None:
        self.unit, self._show = unit, show
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

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._begun

    @property
    def text(self) -> str:
        """Return the progress, the elapsed and the remaining time, in words."""
        of = f" of {self.total:,}" if self.total else ""
        parts = [f"{self.done:,}{of} {self.unit}" if self.done or of else "", self.note]
        parts += ["compiling" * bool(_compiling), duration(math.floor(self.elapsed))]
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
            _running.append(self)
            if _running[0] is self:
                self._ended = threading.Event()
                self._watcher = threading.Thread(target=_watch, args=[self._ended], daemon=True)
                self._watcher.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self in _running:
            _running.remove(self)
        if hasattr(self, "_watcher"):
            self._ended.set()
            self._watcher.join()


SILENT = Meter("", show=False)
"""For work that nobody watches and nothing limits."""

_running: list[Meter] = []
"""Meters that are shown, the outermost first."""
_compiling: list[Any] = []
"""Kernels that numba compiles at the moment."""


def _watch(ended: threading.Event) -> None:
    """Show one of the running meters until the outermost meter has ended."""
    display = shown = None
    while not ended.wait(TICK):
        if "numba" in sys.modules:
            _listen()
        old = [meter for meter in tuple(_running) if meter.elapsed >= AFTER]
        if old:  # the outermost whose total is known, else the innermost
            shown = next((meter for meter in old if meter.total), old[-1])
            display = display or _display()
            display(shown, False)
    if display is not None and shown is not None:
        display(shown, True)


@cache
def _listen() -> None:
    """Let numba say when it compiles."""
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, begun: Any) -> None:
            _compiling.append(begun)

        def on_end(self, ended: Any) -> None:
            del _compiling[-1:]

    event.register("numba:compile", Listener())


def _display() -> Callable[[Meter, bool], None]:
    """Return a function that shows a meter. Its second argument is true at the last call."""
    stream, soon = sys.stderr, LONG
    if stream is not None and stream.isatty():
        return _in_terminal()
    if "ipykernel" in sys.modules:
        return _in_notebook()

    def write_line(meter: Meter, last: bool) -> None:  # few lines, however long it takes
        nonlocal soon
        if meter.elapsed >= soon or (last and soon > LONG):
            soon = max(meter.elapsed + LONG, 1.1 * meter.elapsed)
            print(f"{meter.what}: {meter.text}", file=stream, flush=True)

    return write_line


def _in_terminal() -> Callable[[Meter, bool], None]:
    """Show a bar that disappears at the end. Printed lines appear above the bar."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress

    columns = "{task.description}", BarColumn(30), "{task.fields[text]}"
    options: Any = {"transient": True, "auto_refresh": False, "redirect_stdout": False}
    bar = Progress(*columns, console=Console(stderr=True), **options)
    task = bar.add_task("", text="")

    def show(meter: Meter, last: bool) -> None:
        if last:
            bar.stop()
        else:
            bar.start()
            options: Any = {"total": meter.total, "completed": meter.done, "text": meter.text}
            bar.update(task, description=meter.what, refresh=True, **options)

    return show


def _in_notebook() -> Callable[[Meter, bool], None]:
    """Show an output that is updated, and empty at the end. Rich would need ipywidgets."""
    from IPython.display import display

    handle = display({}, raw=True, display_id=True)

    def show(meter: Meter, last: bool) -> None:
        share = f"{meter.done / meter.total:.0%}, " if meter.total else ""
        text = {"text/plain": f"{meter.what}: {share}{meter.text}"}
        handle.update({} if last else text, raw=True)

    return show
