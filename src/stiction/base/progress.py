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
    """Return seconds as text for people, such as '1.5 h'.

    >>> [duration(seconds) for seconds in (2.5e-4, 1e-3, 0.9994, 1.0, 119.0, 120.0)]
    ['250 us', '1 ms', '999 ms', '1 s', '119 s', '2 min']
    >>> [duration(seconds) for seconds in (7199.0, 7200.0, 172799.0, 172800.0, 1e6, 0.0)]
    ['120 min', '2 h', '48 h', '2 days', '11.6 days', '0 us']
    """
    sizes = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    most = {"us": 1e-3, "ms": 1.0, "s": 120.0, "min": 7200.0, "h": 172800.0}
    unit = next((unit for unit, below in most.items() if seconds < below), "days")
    return f"{seconds / sizes[unit]:.3g} {unit}"


class Meter:
    """Context manager for the progress of a computation.

    `total` is its size, if known.

    Examples
    --------
    >>> reported = []
    >>> with Meter("solving", 7, lambda *counts: reported.append(counts)) as meter:
    ...     meter.advance()
    ...     meter.advance(3)
    ...     meter.stage("sorting")
    ...     meter.advance(2)
    >>> reported, meter.what
    ([(1, 7), (4, 7), (2, 0)], 'sorting')

    After an interruption the next report ends the work.

    >>> interrupted.set()
    >>> try:
    ...     meter.advance()
    ... except KeyboardInterrupt:
    ...     print(meter.done)
    ... finally:
    ...     interrupted.clear()
    2
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
        """Return the progress, the elapsed and the remaining time, in words.

        The pace is that between the first report and now: 12 s for 3 samples, and 5 are left.

        >>> from unittest.mock import patch
        >>> meter = Meter("solving", 1009, False)
        >>> meter.done, meter._begun, meter._first, meter.note = 1004, 70.0, (100.0, 1001), "step 7"
        >>> with patch("time.monotonic", return_value=112.9):
        ...     print(meter.text)
        ...     meter.done = 1009
        ...     print(meter.text)
        ...     meter.stage("sorting")
        ...     print(meter.text)
        ...     meter.unit, meter.done = "steps", 5
        ...     print(meter.text)
        1,004 of 1,009 samples, step 7, 42 s, about 22 s left
        1,009 of 1,009 samples, step 7, 42 s
        42 s
        5 steps, 42 s
        """
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
        """Show the meter if no other meter is shown.

        >>> import io
        >>> from contextlib import redirect_stderr
        >>> from unittest.mock import patch
        >>> log, now = io.StringIO(), [0.0]
        >>> with redirect_stderr(log), patch("time.monotonic", lambda: now[0]):
        ...     with patch("stiction.base.progress._display", return_value=None):
        ...         with Meter("outer") as outer, Meter("inner", 8, unit="steps") as inner:
        ...             for now[0] in (9.0, 10.0, 19.0, 20.5, 200.0, 209.0, 219.0, 221.0):
        ...                 inner.advance()
        ...             _running == [outer, inner]
        ...         with Meter("short"), Meter("silent", 8, False) as silent:
        ...             now[0] = 9999.0
        ...             silent.advance()
        ...     _running
        True
        []

        A line comes after 10 s, and later when the time has grown by a tenth:

        >>> print(log.getvalue(), end="")
        inner: 2 of 8 steps, 10 s, about 6 s left
        inner: 4 of 8 steps, 20 s, about 15 s left
        inner: 5 of 8 steps, 3.33 min, about 2.38 min left
        inner: 8 of 8 steps, 3.68 min
        outer: 3.68 min
        """
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
    """Return the outermost running meter whose total is known, or else the innermost meter.

    >>> meters = [Meter("outer"), Meter("middle", 7), Meter("inner", 5), Meter("innermost")]
    >>> for shown in (meters, meters[:2], meters[:1], [meters[0], meters[3]]):
    ...     _running[:0] = shown
    ...     print(_shown().what)
    ...     del _running[: len(shown)]
    middle
    middle
    outer
    innermost
    """
    return next((meter for meter in _running if meter.total), _running[-1])


def _display() -> Any:
    """Return the display of a running meter between `start` and `stop`, or None for a pipe.

    >>> import io
    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> terminal = SimpleNamespace(isatty=lambda: True)
    >>> hosts = (terminal, ()), (io.StringIO(), ("ipykernel",)), (None, ("ipykernel",)), (None, ())
    >>> for stderr, modules in hosts:
    ...     host = SimpleNamespace(stderr=stderr, modules=modules)
    ...     with patch("stiction.base.progress.sys", host):
    ...         with patch("stiction.base.progress._bar", return_value="bar"):
    ...             print(_display() if stderr is terminal else type(_display()).__name__)
    bar
    _Output
    _Output
    NoneType
    """
    with suppress(*GONE):
        if sys.stderr.isatty():
            return _bar()
    return _Output() if "ipykernel" in sys.modules else None


def _bar() -> Any:
    """Return a bar that disappears at the end. Printed lines appear above the bar.

    >>> _running.insert(0, Meter("solving", 7))
    >>> row = _bar().get_renderable()
    >>> del _running[0]
    >>> what, bar, text = [next(iter(column.cells)) for column in row.columns]
    >>> what, bar.total, bar.completed, bar.pulse, text
    ('solving', 7, 0, False, '0 of 7 samples, 0 us')
    """
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
    """An output of a notebook, which is empty at the end. Rich would need ipywidgets.

    Examples
    --------
    >>> from unittest.mock import Mock, patch
    >>> output, ipython = _Output(), Mock()
    >>> output.stop()
    >>> output._ended.is_set()
    True
    >>> output._ended = Mock(wait=Mock(side_effect=[False, True]))
    >>> _running.insert(0, Meter("solving", 7))
    >>> with patch.dict(sys.modules, {"IPython": ipython, "IPython.display": ipython}):
    ...     output.start()
    >>> del _running[0]
    >>> for shown in ipython.display.return_value.update.call_args_list:
    ...     print(shown.args[0], shown.kwargs)
    {'text/plain': 'solving: 0 of 7 samples, 0 us'} {'raw': True}
    {} {'raw': True}
    """

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
