"""Progress of long work: a bar on a terminal, nothing in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

Report: TypeAlias = Callable[[int], None]
"""Called with the number of samples just finished."""


@contextmanager
def progress_bar(
    total: int, what: str, show: bool | Callable[[int, int], None]
) -> Iterator[Report]:
    """A function to report finished samples to.

    Parameters
    ----------
    total : int
        Samples to do.
    what : str
        Label of the bar.
    show : bool or callable
        True shows a bar if standard error is a terminal; a callable gets (done, total).
    """
    if callable(show):
        done = 0

        def tell(count: int) -> None:
            nonlocal done
            done += count
            show(done, total)

        yield tell
        return
    if not (show and sys.stderr.isatty()):
        yield lambda count: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        Task,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{task.speed:,.0f}/s" if task.speed else "")

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        Rate(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda count: bar.advance(task, count)


@contextmanager
def status_line(what: str) -> Iterator[Callable[[str], None]]:
    """A function that shows where a long run is: one line on a terminal, nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda text: status.update(f"{what}: {text}")
