"""How far long work is, and when its time is over: one mechanism for all that takes long.

A terminal shows a bar, a notebook a line that is rewritten, a pipe a line now and then; all of it
on standard error, and only once two seconds have passed. Who works knows nothing of this: it says
what is done (`advance`), what it expects in all (`expect`), and asks whether its time is `over`.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

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
    """Seconds for people."""
    if seconds < 1.0:
        return f"{seconds * 1e3:.3g} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.3g} us"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    if seconds < 7200.0:
        return f"{seconds / 60.0:.3g} min"
    if seconds < 48 * 3600.0:
        return f"{seconds / 3600.0:.3g} h"
    return f"{seconds / 86400.0:.3g} days"


class TimeUp(Exception):
    """The time allowed is over.

    Attributes
    ----------
    values : array
        What was computed of what was asked for last, from its beginning.
    spent : int
        Samples computed since whoever catches it was asked.
    """

    def __init__(self, values: Any = (), spent: int | None = None) -> None:
        super().__init__("the time allowed is over")
        self.values: NDArray[Any] = np.asarray(values, dtype=np.float64)
        self.spent = self.values.size if spent is None else spent


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
        self.what, self.total, self.unit, self.note = what, total, unit, ""
        self.time_limit = time_limit
        self.done, self.at_most = 0, False
        self._show = show
        self._begun = self._stage = time.monotonic()
        self._first: tuple[float, int] | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def advance(self, count: int = 1) -> None:
        """`count` more are done."""
        self.done += count
        if self._first is None:  # the rate is that of what follows: first come preparations
            self._first = time.monotonic(), self.done
        if callable(self._show):
            self._show(self.done, self.total or 0)

    def expect(self, more: float, *, at_most: bool = False) -> None:
        """So many more are expected, or allowed at most."""
        self.total, self.at_most = self.done + max(0, math.ceil(more)), at_most

    def stage(self, what: str, total: int | None = None) -> None:
        """Another part of the work begins; the clock goes on."""
        self.what, self.total, self.done, self.at_most, self.note = what, total, 0, False, ""
        self._first, self._stage = None, time.monotonic()

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
        """Seconds that are left, if that can be told."""
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
        """Where it is, for people."""
        parts = []
        if self.total and not self.at_most:
            parts.append(f"{self.done:,} of {self.total:,} {self.unit}")
        elif self.done:
            parts.append(f"{self.done:,} {self.unit}")
            if self.total:
                parts[-1] += f" (at most {self.total:,})"
        if self.note:
            parts.append(self.note)
        parts.append(duration(math.floor(self.elapsed)))
        left = self.left
        if left is not None and left >= 1.0:
            parts.append(f"{'up to' if self.at_most else 'about'} {duration(round(left))} left")
        return ", ".join(parts)

    def __enter__(self) -> Meter:
        return self.start()

    def __exit__(self, *error: object) -> None:
        self.stop()

    def start(self) -> Meter:
        """The clock starts; `stop` must follow, come what may."""
        self._begun = self._stage = time.monotonic()
        if self._show is True:
            with _floor:
                _live.append(self)
            self._thread = threading.Thread(target=self._watch, daemon=True)
            self._thread.start()
        return self

    def stop(self) -> None:
        """Nothing is shown from here on."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
            with _floor:
                _live.remove(self)

    def _watch(self) -> None:
        """Wait until it is worth a word, then show it until it ends; runs in a thread."""
        if self._ended.wait(AFTER):
            return
        display: Display | None = None
        try:
            while not self._ended.is_set():
                if display is None:
                    display = _take_the_floor(self)
                elif _speakers[-1] is self:
                    display.show(self)
                self._ended.wait(TICK)
        finally:
            if display is not None:
                with _floor:
                    display.close(self)
                    _speakers.remove(self)
                    _displays.pop(self, None)


_floor = threading.Lock()
_live: list[Meter] = []
_speakers: list[Meter] = []
_displays: dict[Meter, Display] = {}


def _take_the_floor(meter: Meter) -> Display | None:
    """A display, unless this is a part of work that knows its end.

    Work that does not know its end falls silent while a part of it has more to tell.
    """
    with _floor:
        earlier = _live[: _live.index(meter)]
        if any(other.total and not other.at_most for other in earlier):
            return None
        display = _displays[meter] = _display()
        _speakers.append(meter)
        _speakers.sort(key=_live.index)  # the innermost last, whichever thread woke first
        for speaker in _speakers[:-1]:
            _displays[speaker].pause()
        return display


class Display(Protocol):
    """A way to show a meter."""

    def show(self, meter: Meter) -> None:
        """Now, or when it is time."""

    def pause(self) -> None:
        """Make room for another."""

    def close(self, meter: Meter) -> None:
        """The work has ended."""


def _display() -> Display:
    if _in_notebook():
        return _Notebook()
    if sys.stderr is not None and sys.stderr.isatty():
        return _Terminal()
    return _Pipe()


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    active = shell.get_ipython() if shell is not None else None
    return type(active).__name__ == "ZMQInteractiveShell"


class _Pipe:
    """A line after ten seconds more and a tenth more time: few, however long it takes."""

    def __init__(self) -> None:
        self._next = 0.0

    def show(self, meter: Meter) -> None:
        elapsed = meter.elapsed
        if elapsed < self._next:
            return
        if self._next or elapsed >= LONG or elapsed + (meter.left or 0.0) >= LONG:
            print(f"{meter.what}: {meter.text}", file=sys.stderr, flush=True)
            self._next = max(elapsed + LONG, 1.1 * elapsed)

    def pause(self) -> None:
        pass

    def close(self, meter: Meter) -> None:
        pass


class _Terminal:
    """A bar that goes away when the work is done."""

    def __init__(self) -> None:
        self._bar: Any = None

    def show(self, meter: Meter) -> None:
        known = meter.total is not None and not meter.at_most
        if self._bar is None:
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
            self._task = self._bar.add_task(meter.what, total=None, text="")
            self._bar.start()
        self._bar.update(
            self._task,
            description=meter.what,
            completed=meter.done,
            total=meter.total if known else None,
            text=meter.text,
        )

    def pause(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def close(self, meter: Meter) -> None:
        self.pause()


class _Notebook:
    """A line below the cell, rewritten; needs nothing but IPython, which is there."""

    WIDTH = 30

    def __init__(self) -> None:
        self._line: Any = None

    def show(self, meter: Meter) -> None:
        share = min(1.0, meter.done / meter.total) if meter.total and not meter.at_most else None
        full = 0 if share is None else round(share * self.WIDTH)
        bar = "" if share is None else f" [{'#' * full}{'.' * (self.WIDTH - full)}]"
        self._write(f"{meter.what}{bar} {meter.text}")

    def _write(self, text: str) -> None:
        from IPython.display import display

        data = {"text/plain": text}
        if self._line is None:
            self._line = display(data, raw=True, display_id=True)
        else:
            self._line.update(data, raw=True)

    def pause(self) -> None:
        pass

    def close(self, meter: Meter) -> None:
        self._write(f"{meter.what} {meter.text}")


SILENT = Meter("", show=False)
"""For work that nobody watches and nothing limits."""


def check_time_limit(value: Any, name: str = "time_limit") -> list[str]:
    """Why a value is no time limit."""
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if value is None or (number and 0.0 < value < math.inf):
        return []
    return [f"{name}: must be a positive number of seconds, got {value!r}"]


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
