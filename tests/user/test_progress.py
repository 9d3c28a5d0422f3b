"""Progress of long work: what it shows and where, and when its time is over."""

import errno
import io
import re
import sys
import threading
import time

import pytest

from stiction.base import progress
from stiction.base.progress import Meter


@pytest.fixture
def hasty(monkeypatch):
    """The same waits, a hundred times shorter."""
    monkeypatch.setattr(progress, "SILENCE", 0.02)
    monkeypatch.setattr(progress, "PIPE_INTERVAL", 0.1)
    monkeypatch.setattr(progress, "NOTEBOOK_INTERVAL", 0.005)


def work(meter, seconds=0.3, pieces=20, until=lambda: True):
    """Some pieces of work, and a wait until a thread on a busy machine has shown the meter."""
    with meter:
        for _ in range(pieces):
            time.sleep(seconds / pieces)
            meter.advance()
        deadline = time.monotonic() + 60.0
        while not until() and time.monotonic() < deadline:
            time.sleep(0.01)


def test_short_work_is_silent(capsys):
    work(Meter("short", 10), 0.01, 10)
    assert capsys.readouterr() == ("", "")


def test_the_time_that_is_left_is_that_of_what_is_left(monkeypatch):
    clock = iter([0.0, 10.0, 40.0, 40.0])  # prepared, first ten, first fifty, asked twice
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    meter = Meter("", 100)
    meter.advance(10)
    meter.advance(40)
    assert meter.text == "50 of 100 samples, 40 s, about 38 s left"  # 30 s for 40 of them


def test_a_pipe_gets_few_lines_the_last_at_the_end(hasty, capsys):
    begin = time.monotonic()
    work(Meter("long work", 60), 0.6, 60)
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= len(lines) <= 3 + (time.monotonic() - begin) / 0.1
    done = [int(line.removeprefix("long work: ").split()[0]) for line in lines]
    assert done == sorted(done)
    assert "of 60 samples" in lines[0]


class Gone(io.StringIO):
    """A stream that cannot be written to any more."""

    def __init__(self, error, terminal=False):
        super().__init__()
        self.error, self.isatty = error, lambda: terminal

    def write(self, text):
        raise self.error


CLOSED = io.StringIO()
CLOSED.close()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize(
    "stream", [Gone(BrokenPipeError()), CLOSED, Gone(OSError(errno.EIO, "hung up"), True), None]
)
def test_work_goes_on_when_nobody_can_read_its_progress(stream, hasty, monkeypatch, capsys):
    """Somebody closes the terminal, or the pipe's reader ends, while hours of samples remain."""
    monkeypatch.setenv("TERM", "xterm")
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", stream)
        meter = Meter("unwatched", 20)
        work(meter)
    assert meter.done == 20
    assert progress._running == []
    assert capsys.readouterr().out == ""


def test_an_interruption_at_the_end_leaves_no_meter_behind(hasty, monkeypatch):
    def interrupt(meter, last=False):
        if last:
            raise KeyboardInterrupt

    monkeypatch.setattr(Meter, "_write_line", interrupt)
    with pytest.raises(KeyboardInterrupt), Meter("interrupted", 2) as meter:
        meter._line_due = 1.0
    assert progress._running == []


@pytest.mark.parametrize("show", [True, False, lambda done, total: None])
def test_an_interrupted_run_ends_with_its_next_sample(show, monkeypatch):
    monkeypatch.setattr(progress.interrupted, "is_set", lambda: True)
    with pytest.raises(KeyboardInterrupt):
        Meter("", 2, show).advance()


def test_a_terminal_gets_a_bar_that_goes_away_with_warnings_above_it(hasty, monkeypatch):
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", terminal)
    with Meter("outer"):
        work(Meter("by equilibrium", 20), until=lambda: "of 20 samples" in terminal.getvalue())
        print("a warning", file=sys.stderr)
    text = terminal.getvalue()
    bare = re.sub(r"\x1b\[[\d;]*m", "", text)
    assert "by equilibrium \N{BOX DRAWINGS HEAVY HORIZONTAL}" in bare
    assert "of 20 samples" in text
    assert any(line.endswith("a warning") for line in text.splitlines())
    assert text.rstrip("\n").endswith("\x1b[2K")  # the line is erased


def test_one_of_nested_meters_is_shown(hasty, capsys):
    """The outer one if it knows its end, else the inner one; nothing is left behind."""
    before = set(threading.enumerate())
    with Meter("outer", 2) as outer:
        work(Meter("inner", 10))
        outer.advance()
    assert "inner" not in capsys.readouterr().err
    with Meter("outer"):
        work(Meter("inner", 100), 0.4)
    assert "inner: " in capsys.readouterr().err
    assert set(threading.enumerate()) <= before  # a thread of an earlier test may end


def test_a_notebook_has_one_output_that_is_empty_at_the_end(hasty, monkeypatch):
    """No widgets, and no line for each update in a saved notebook."""
    shell = pytest.importorskip("IPython.display")
    outputs = []

    class Handle:
        def update(self, data, raw):
            outputs[-1].append(data)

    def display(data, raw, display_id):
        outputs.append([data])
        return Handle()

    monkeypatch.setitem(sys.modules, "ipykernel", object())
    monkeypatch.setattr(shell, "display", display)
    with Meter("outer"):
        work(Meter("by equilibrium", 20), until=lambda: outputs and len(outputs[0]) > 1)
    ((first, *shown, last),) = outputs
    assert first == last == {}
    assert any("by equilibrium: " in data["text/plain"] for data in shown)
