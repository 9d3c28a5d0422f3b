"""Progress of long work, and its time limit: one mechanism for all that takes long.

A terminal shows a bar, a notebook a line that is rewritten, a pipe a line now and then; all of it
on standard error, and only after two seconds. Code that works only reports what is done
(`advance`), and asks whether its time is `over`.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TypeAlias

Show: TypeAlias = bool | Callable[[int, int], None]
"""True shows progress once work takes long; a callable gets (done, total); False is silent."""

AFTER = 2.0
"""Seconds of silence: who waits no longer than this needs no bar."""
LONG = 10.0
"""Seconds of work from which a pipe hears of it, at once if it can be foreseen."""
TICK = 0.25
PORTION = 0.25
"""Seconds of work between two looks at the clock."""


def duration(seconds: float) -> str:
    """Return seconds as text for people, such as '1.5 h'."""
    sizes = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    most = {"us": 1e-3, "ms": 1.0, "s": 120.0, "min": 7200.0, "h": 172800.0}
    unit = next((unit for unit, below in most.items() if seconds < below), "days")
    return f"{seconds / sizes[unit]:.3g} {unit}"


class Meter:
    """Progress of one piece of work, and the clock it is allowed to run by; a context manager.

    Parameters
    ----------
    what : str
        Label.
    total : int, optional
        All that there is to do, if it is known.
    show : bool or callable
        See `Show`.
    unit : str
        What is counted, plural.
    time_limit : float, optional
        Seconds from now.
    """

    def __init__(
        self,
        what: str,
        total: int | None = None,
        show: Show = True,
        *,
        unit: str = "samples",
        time_limit: float | None = None,
    ) -> None:
        self.unit, self.time_limit, self._show = unit, time_limit, show
        self.stage(what, total)
        self._begun = self._stage

    def stage(self, what: str, total: int | None = None) -> None:
        """Begin another part of the work; the clock goes on."""
        self.what, self.total, self.done, self.note = what, total, 0, ""
        self._first: tuple[float, int] | None = None
        self._stage = time.monotonic()

    def advance(self, count: int = 1) -> None:
        """Report that `count` more are done."""
        self.done += count
        if self._first is None:  # the rate is that of what follows: first come preparations
            self._first = time.monotonic(), self.done
        if callable(self._show):
            self._show(self.done, self.total or 0)

    @property
    def over(self) -> bool:
        """Whether the time allowed has passed."""
        return self.time_limit is not None and self.elapsed >= self.time_limit

    @property
    def elapsed(self) -> float:
        """Seconds since it was made."""
        return time.monotonic() - self._begun

    @property
    def left(self) -> float | None:
        """Estimated seconds that are left; None if unknown."""
        if not self.total or self._first is None:
            return None
        begin, before = self._first
        now = time.monotonic()
        if self.done > before:
            pace = (now - begin) / (self.done - before)
        else:
            pace = (begin - self._stage) / self.done if self.done else 0.0
        left = pace * max(0, self.total - self.done)
        return left if self.time_limit is None else min(left, self.time_limit - self.elapsed)

    @property
    def text(self) -> str:
        """How far it is, as text."""
        of = f" of {self.total:,}" if self.total else ""
        parts = [f"{self.done:,}{of} {self.unit}" if self.done or of else "", self.note]
        parts.append(duration(math.floor(self.elapsed)))
        left = self.left
        if left is not None and left >= 1.0:
            parts.append(f"about {duration(round(left))} left")
        return ", ".join(part for part in parts if part)

    def __enter__(self) -> Meter:
        return self.start()

    def __exit__(self, *error: object) -> None:
        self.stop()

    def start(self) -> Meter:
        """Start the clock; `stop` must follow, whatever happens."""
        self._begun = self._stage = time.monotonic()
        if self._show is True:
            _watch(self)
        return self

    def stop(self) -> None:
        """Show nothing from here on."""
        _unwatch(self)


SILENT = Meter("", show=False)
"""For work that nobody watches and nothing limits."""

_lock = threading.Lock()
_live: list[Meter] = []
_watcher: _Watcher | None = None


def _watch(meter: Meter) -> None:
    global _watcher
    with _lock:
        _live.append(meter)
        if _watcher is None:
            _watcher = _Watcher(daemon=True)
            _watcher.start()


def _unwatch(meter: Meter) -> None:
    global _watcher
    last = None
    with _lock:
        if meter in _live:
            _live.remove(meter)
            if not _live:
                last, _watcher = _watcher, None
    if last is not None:
        last.ended.set()
        last.join()


class _Watcher(threading.Thread):
    """Shows one of the meters that run; ends with the last of them."""

    def __init__(self, *, daemon: bool) -> None:
        super().__init__(daemon=daemon)
        self.ended = threading.Event()

    def run(self) -> None:
        display: _Pipe | _Terminal | _Notebook | None = None
        while not self.ended.wait(TICK):
            with _lock:
                old = [meter for meter in _live if meter.elapsed >= AFTER]
            if old:  # the outermost that knows its end, else the innermost
                display = display or _display()
                display.show(next((meter for meter in old if meter.total), old[-1]))
        if display is not None:
            display.close()


def _display() -> _Pipe | _Terminal | _Notebook:
    shell = sys.modules.get("IPython")
    active = shell.get_ipython() if shell is not None else None
    if type(active).__name__ == "ZMQInteractiveShell":
        return _Notebook()
    return _Terminal() if sys.stderr is not None and sys.stderr.isatty() else _Pipe()


class _Pipe:
    """A line after ten seconds more and a tenth more time: few, however long it takes."""

    def __init__(self) -> None:
        self._next, self._line = 0.0, ""

    def show(self, meter: Meter) -> None:
        elapsed = meter.elapsed
        self._line = f"{meter.what}: {meter.text}"
        foreseen = elapsed + (meter.left or 0.0)
        if elapsed >= self._next and (self._next or foreseen >= LONG):
            self._next = max(elapsed + LONG, 1.1 * elapsed)
            print(self._line, file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._next:
            print(self._line, file=sys.stderr, flush=True)


class _Terminal:
    """A bar that goes away when the work is done."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._bar = Progress(
            SpinnerColumn("line"),
            TextColumn("{task.description}", markup=False),
            BarColumn(30),
            TextColumn("{task.fields[text]}", markup=False),
            console=Console(stderr=True),
            transient=True,
            redirect_stdout=False,
        )
        self._task = self._bar.add_task("", total=None, text="")
        self._bar.start()

    def show(self, meter: Meter) -> None:
        done, total = meter.done, meter.total
        self._bar.update(
            self._task, description=meter.what, completed=done, total=total, text=meter.text
        )

    def close(self) -> None:
        self._bar.stop()


class _Notebook:
    """A line below the cell, rewritten; rich would need ipywidgets."""

    def __init__(self) -> None:
        from IPython.display import display

        self._line = display({"text/plain": ""}, raw=True, display_id=True)

    def show(self, meter: Meter, bar: str = "") -> None:
        self._meter = meter
        if meter.total:
            full = round(30 * min(1.0, meter.done / meter.total))
            bar = f" [{'#' * full:.<30}]"
        self._line.update({"text/plain": f"{meter.what}{bar} {meter.text}"}, raw=True)

    def close(self) -> None:
        self.show(self._meter)


class Portions:
    """Cuts rows into portions of about a quarter of a second, by what the last ones took."""

    def __init__(self, smallest: int = 1) -> None:
        self._smallest = smallest
        self._pace: float | None = None

    @property
    def slow(self) -> bool:
        """Whether a row takes more than a millisecond."""
        return self._pace is not None and self._pace > 1e-3

    def __call__(self, count: int) -> Iterator[slice]:
        """Slices that cover `count` rows; the time until the next is asked for is measured."""
        first, size = 0, self._smallest
        while first < count:
            if self._pace is not None:
                size = max(1, int(PORTION / max(self._pace, 1e-9)))
            stop = min(count, first + size)
            begin = time.perf_counter()
            yield slice(first, stop)
            took = (time.perf_counter() - begin) / (stop - first)
            # The fastest so far: the first may have compiled kernels.
            self._pace = took if self._pace is None else min(self._pace, took)
            first = stop
