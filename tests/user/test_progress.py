"""What long work says, where, and when its time is over."""

import io
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest

import stiction as st
from stiction import progress
from stiction.progress import Meter, Portions, TimeUp


class Terminal(io.StringIO):
    """Standard error of somebody who watches."""

    def isatty(self):
        return True


@pytest.fixture
def hasty(monkeypatch):
    """The same waits, a hundred times shorter."""
    monkeypatch.setattr(progress, "AFTER", 0.02)
    monkeypatch.setattr(progress, "LONG", 0.1)
    monkeypatch.setattr(progress, "TICK", 0.005)


def work(meter, seconds, pieces):
    with meter:
        for _ in range(pieces):
            time.sleep(seconds / pieces)
            meter.advance()


def test_short_work_is_silent(capsys):
    work(Meter("short", 10), 0.01, 10)
    assert capsys.readouterr() == ("", "")


def test_a_pipe_gets_few_lines_with_an_estimate_first(hasty, capsys):
    begin = time.monotonic()
    work(Meter("long work", 60), 0.6, 60)
    lines = capsys.readouterr().err.splitlines()
    # At .02 s, then every .1 s.
    assert 2 <= len(lines) <= 2 + (time.monotonic() - begin) / 0.1
    assert lines[0].startswith("long work: ")
    assert "of 60 samples" in lines[0]
    done = [int(line.split(": ")[1].split()[0]) for line in lines]
    assert done == sorted(done)


def test_work_foreseen_to_be_short_does_not_reach_a_pipe(hasty, monkeypatch, capsys):
    monkeypatch.setattr(progress, "LONG", 5.0)
    work(Meter("brief", 10), 0.1, 10)
    assert capsys.readouterr().err == ""


def test_a_terminal_gets_a_bar_that_goes_away(hasty, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    work(Meter("by equilibrium", 20), 0.3, 20)
    text = terminal.getvalue()
    assert "by equilibrium" in text
    assert "of 20 samples" in text
    assert text.rstrip("\n").endswith("\x1b[2K")  # the line is erased


def test_a_notebook_gets_a_line_that_is_rewritten(hasty, monkeypatch, capsys):
    shown = []

    class Handle:
        def update(self, data, raw):
            shown.append(data["text/plain"])

    def display(data, raw, display_id):
        shown.append(data["text/plain"])
        return Handle()

    shell = type("ZMQInteractiveShell", (), {})()
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", types.SimpleNamespace(display=display))
    work(Meter("in a notebook", 20), 0.3, 20)
    assert shown[0].startswith("in a notebook [")
    assert "#" in shown[-2]
    assert "20 of 20 samples" in shown[-1]
    assert capsys.readouterr().err == ""


def test_only_one_speaks(hasty, capsys):
    """Work that knows its end speaks for its parts; work that does not lets them speak."""
    with Meter("outer", 2) as outer:
        work(Meter("inner", 10), 0.2, 10)
        outer.advance()
        work(Meter("inner", 10), 0.2, 10)
    assert "inner" not in capsys.readouterr().err
    with Meter("outer"):
        work(Meter("inner", 100), 0.4, 100)
    lines = capsys.readouterr().err.splitlines()
    assert any(line.startswith("inner: ") for line in lines)
    assert not progress._speakers


def test_it_ends_with_an_error_too(hasty):
    def failing():
        with Meter("failing"):
            time.sleep(0.05)
            raise ValueError("as it may")

    before = threading.active_count()
    with pytest.raises(ValueError, match="as it may"):
        failing()
    assert threading.active_count() == before
    assert not progress._speakers


def test_portions_cover_all_rows_and_follow_their_pace(monkeypatch):
    portions = Portions(4)
    seen = []
    for rows in portions(1000):
        seen += list(range(1000))[rows]
    assert seen == list(range(1000))
    slow = Portions()
    sizes = []
    for rows in slow(4):
        time.sleep(0.26)
        sizes.append(rows.stop - rows.start)
    assert sizes == [1, 1, 1, 1]
    assert slow.slow


@pytest.fixture(scope="module")
def system():
    problem = st.paper.problem(nodes=256)
    return problem, st.paper.strength(problem, 0.5)


def test_monte_carlo_returns_what_there_is(system):
    with pytest.warns(st.AccuracyWarning, match="when the time was over"):
        part = st.monte_carlo(
            *system, method=st.LocalCriterion(), samples=10**7, workers=1, time_limit=0.3
        )
    count = part.sizes["sample"]
    assert 0 < count < 10**7
    assert part.attrs["cut_short"].startswith(f"{count} of 10000000 samples")
    assert bool(part["critical_stress"].notnull().all())
    again = st.monte_carlo(*system, method=st.LocalCriterion(), samples=min(count, 300))
    np.testing.assert_array_equal(
        again["critical_stress"], part["critical_stress"][: again.sizes["sample"]]
    )
    whole = st.monte_carlo(*system, method=st.LocalCriterion(), samples=10, time_limit=60.0)
    assert "cut_short" not in whole.attrs


def test_a_stored_run_is_cut_short_and_goes_on(system, tmp_path):
    study = st.Study(
        problem=system[0],
        random=system[1],
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=20_000),
    )
    out = tmp_path / "result.nc"
    part = study.run(out=out, workers=1, time_limit=0.05)
    assert "of 20000 samples are done" in part.attrs["cut_short"]
    assert not out.exists()
    assert bool(part["critical_stress"].isnull().any())
    whole = study.run(out=out)
    assert "cut_short" not in whole.attrs
    assert bool(whole["critical_stress"].notnull().all())


@pytest.mark.parametrize("limit", [0, -1.0, True, "10", np.nan, np.inf])
def test_a_time_limit_is_a_positive_number(system, limit):
    method = st.LocalCriterion()
    for call in (
        lambda: st.monte_carlo(*system, method=method, samples=1, time_limit=limit),
        lambda: st.failure_probability(*system, 0.7e6, method=method, time_limit=limit),
        lambda: st.design_stress(*system, probability=0.1, method=method, time_limit=limit),
        lambda: st.failure_curve(*system, method=method, time_limit=limit),
    ):
        with pytest.raises(st.InputError, match="time_limit"):
            call()


class Watched(Meter):
    """Its time is over after so many looks at the clock."""

    def __init__(self, looks):
        super().__init__("", show=False, time_limit=1.0)
        self.looks = looks

    @property
    def over(self):
        self.looks -= 1
        return self.looks < 0


@pytest.mark.parametrize("algorithm", ["auto", "plain", "subset", "importance", "two_level"])
def test_failure_probability_at_any_moment_when_time_is_up(system, algorithm, monkeypatch):
    """Wherever the time ends, the answer is one, with an interval that holds the truth."""
    from stiction.reliability import estimate

    monkeypatch.setattr(progress, "PORTION", 0.01)
    known = 0
    for looks in (0, 1, 2, 3, 5, 8, 12, 20, 30, 50):
        monkeypatch.setattr(estimate, "Meter", lambda *a, looks=looks, **b: Watched(looks))
        with pytest.warns(st.AccuracyWarning, match="raise time_limit"):
            found = st.failure_probability(
                *system, 0.665e6, method=st.Equilibrium(), algorithm=algorithm, target_cv=1e-3
            )
        assert found.cut_short
        assert "cut short" in str(found)
        # P is about 7e-5.
        assert found.interval[0] < 7e-5 < found.interval[1]
        known += np.isfinite(found.probability)
    assert known > 3


def test_design_stress_and_curve_when_time_is_up(system, monkeypatch):
    from stiction.reliability import design

    monkeypatch.setattr(progress, "PORTION", 0.01)
    for looks in (0, 1, 3, 8, 20):
        monkeypatch.setattr(design, "Meter", lambda *a, looks=looks, **b: Watched(looks))
        with pytest.warns(st.AccuracyWarning, match="raise time_limit"):
            found = st.design_stress(
                *system, probability=1e-9, method=st.LocalCriterion(), target_cv=1e-3
            )
        assert found.cut_short
        # P = 1e-9 lies .3 kPa above the bound.
        assert found.interval[0] <= 0.6603e6 <= found.interval[1]
    with pytest.warns(st.AccuracyWarning, match="raise time_limit"):
        curve = st.failure_curve(
            *system,
            method=st.LocalCriterion(),
            target_cv=1e-3,
            plain_samples=10**7,
            time_limit=0.5,
        )
    assert "raise time_limit" in curve.attrs["cut_short"]


def test_simulations_and_onsets_speak_too(hasty, system, capsys, monkeypatch):
    monkeypatch.setattr(progress, "AFTER", 0.0)  # with its kernels compiled it is a matter of .1 s
    monkeypatch.setattr(progress, "LONG", 0.01)
    problem, field = system
    profiles = field.profiles(problem.interface, field.draws(problem.interface, 200, 0))
    told = []
    all_at_once = st.onset(
        problem, profiles, method=st.LocalCriterion(), progress=lambda *done: told.append(done)
    )
    assert told[-1] == (200, 200)
    assert len(told) > 1
    np.testing.assert_array_equal(
        all_at_once["critical_stress"][150:],
        st.onset(problem, profiles[150:], method=st.LocalCriterion())["critical_stress"],
    )
    capsys.readouterr()
    method = st.Rupture(loading_rate=2e7)
    st.simulate_rupture(problem, profiles[0], method=method, stop="onset")
    assert "rupture: " in capsys.readouterr().err
    st.simulate_rupture(problem, profiles[0], method=method, stop="onset", progress=False)
    assert "rupture: " not in capsys.readouterr().err


def test_time_up_says_how_much_was_spent():
    assert TimeUp([1.0, 2.0]).spent == 2
    assert TimeUp([1.0], 30).spent == 30


def test_forks_and_exits_cleanly():
    """A thread that shows progress must not keep a process alive."""
    code = (
        "import time; from stiction.progress import Meter\n"
        "Meter('left open').start(); time.sleep(0.1)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
