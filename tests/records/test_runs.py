"""Recorded outputs: studies, runs, exports, pages and what commands print."""

import contextlib
import io
import math
import re
import sys
import warnings
from functools import partial
from pathlib import Path
from unittest import mock

import pandas as pd
import tomli_w
import xarray as xr
from recording import Calls, compared, inside
from small_study import lengths, small_study

import stiction as st
from stiction.base import progress
from stiction.cli import commands
from stiction.cli.report import Page
from stiction.ensemble.experiment import Experiment

calls = Calls()
RUN = "run study.toml --out run --workers 1"
SAME = "the same numbers by st.monte_carlo, tests/user/test_study.py"
small = partial(small_study, 96, 0.047)
SWEPT = small(
    0.31e12,
    samples=9,
    seed=11,
    sweep=[
        *lengths(2.2e-3, 5.1e-3),
        {
            "problem.friction.residual_strength": [5e4, 1.6e5, 2.3e5],
            "problem.solid.poisson_ratio": [0.2, 0.3, 0.4],
        },
        {"problem.load.normal_pressure": [1.9e6, 2.7e6]},
    ],
    title="three axes",
)
SWEPT["problem"]["interface"]["width"] = 0.013
PUSHER = {"type": "pusher", "height": 0.012, "width": 0.006}
PLAIN = re.compile(
    r"<script.*?</script>|<style.*?</style>|<[^>]+>|data:image/[^\"')]*", re.DOTALL
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])", re.ASCII)
CHANGES = re.compile(
    r"\d+(\.\d+)? (us|ms|s|min|h)\b|(numpy|numba|scipy|stiction|Python) [\d.]+\S*|\S*/tmp\S*"
    r"|chunks +\d+|(?<=on the )\d+(?= here)|probed at \d+|\d+ of \d+ (?=probed)"
)


@contextlib.contextmanager
def beside(study):
    """A folder with a study file, in which commands run."""
    with inside() as folder:
        st.Study.from_dict(study).to_toml(Path("study.toml"))
        yield folder


def command(line):
    """Exit code of a command line, the numbers that it prints, and whether it complains."""
    out, err, code, before = io.StringIO(), io.StringIO(), 0, sys.argv
    sys.argv = ["stiction", *line.split()]
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        warnings.catch_warnings(action="ignore", category=ResourceWarning),  # of other tests
        mock.patch.object(progress, "PIPE_INTERVAL", math.inf),
    ):
        try:
            commands.main()
        except SystemExit as ended:
            code = ended.code or 0
    sys.argv = before
    printed, complaints = out.getvalue(), err.getvalue().strip()
    return {"code": code, "numbers": numbers_in(printed), "complains": bool(complaints)}


def numbers_in(text):
    """The numbers of a text, without times, versions and folders."""
    return [float(number) for number in NUMBER.findall(CHANGES.sub("...", text))]


def of_commands(study, *lines):
    """What commands print in a folder with a study, and the table and page that they leave."""
    found = {}

    def figure(page, drawn, caption):
        found[caption] = drawn
        original(page, drawn, caption)

    original = Page.figure
    with beside(study) as folder, mock.patch.object(Page, "figure", figure):
        found |= {line: command(line) for line in lines}
        found["table"] = pd.read_csv(folder / "all.csv")
        if (folder / "all.nc").exists():
            found["array"] = xr.load_dataset(folder / "all.nc")
        found["page"] = numbers_in(PLAIN.sub(" ", (folder / "run/report.html").read_text()))
    return found


@calls(SAME)
def commands_of_a_sweep():
    lines = ("status run", "export run all.csv", "export run all.nc", "report run")
    return of_commands(SWEPT, RUN, *lines)


@calls("events by st.onset of the same samples")
def commands_of_a_specimen():
    method, some = {"type": "equilibrium", "events": 1}, {"samples": 6, "seed": 2}
    plain = small_study(64, 0.083, 0.19e12, 6e-3, method=method, **some)
    plain["problem"]["specimen"] = {"height": 0.031, "thickness": 0.0071, "drive": PUSHER}
    plain["problem"]["load"] = {"normal_pressure": 2.1e6}
    plain["problem"]["friction"]["residual_strength"] = 3.1e5
    return of_commands(plain, RUN, "export run all.csv", "report run")


@calls("each sample by st.onset")
def commands_of_a_plane():
    method = {"type": "equilibrium", "slip": True}
    some = {"samples": 3, "seed": 2, "keep": ["strength"]}
    plain = small_study([24, 20], [0.023, 0.0164], 0.28e12, method=method, **some)
    plain["random"]["strength"]["anisotropy"] = 1.4
    plain["problem"]["load"] = {"normal_pressure": 2.7e6}
    lines = ("check study.toml", RUN, "status run", "export run all.csv", "report run")
    return of_commands(plain, *lines)


@calls("the same answers by st.failure_probability", close=1e-4)
def answers_of_commands():
    plain = small(0.31e12, sweep=lengths(4e-3, 6e-3))
    plain["problem"]["interface"]["width"] = 0.013
    plain["problem"]["load"] = {"normal_pressure": 2.7e6}
    found = {}
    asked = {"force": 430.0}, {"probability": 0.02}, {"friction_coefficient": 0.26}
    with beside(plain):
        for question in asked:
            text = tomli_w.dumps(plain | {"reliability": question | {"target_cv": 0.5}})
            Path("study.toml").write_text(text)
            found[str(question)] = command("reliability study.toml")
        wrong = {"stress": 7e5, "force": 7e3}, {"probability": 2}, None
        for question in wrong:
            asked = {} if question is None else {"reliability": question}
            Path("study.toml").write_text(tomli_w.dumps(plain | asked))
            found[str(question)] = command("reliability study.toml")
    return found


@calls("read beside the folder")
def mistakes_of_commands():
    """And two points of a sweep that have one label."""
    twice = {"problem.interface.nodes": [96, 96], "random.strength.marginal.alpha": [1.5, 3.0]}
    plain = small(samples=12, seed=0, sweep=[twice])
    with beside(plain):
        found = {"twice": command("run study.toml --out run --no-pilot")}
        changed = plain["problem"] | {"friction": {"critical_slip": 3e-6}}
        other = plain | {"samples": 12, "seed": 4, "problem": changed}
        Path("other.toml").write_text(tomli_w.dumps(other))
        for line in """run missing.toml --out run
run study.toml --out run --part 3/2
run study.toml --out run --part 65/64
run study.toml --out study.toml
run other.toml --out run
status .
export nothing result.nc
export run out.txt
report study.toml""".splitlines():
            found[line] = command(line)
    return found


@calls("the samples that fail are those that are said to")
def a_run_with_failures():
    """And its command again, without them."""
    original = Experiment.results

    def results(self, first, count):
        if first <= 9 < first + count:
            raise FloatingPointError("not finite")
        return original(self, first, count)

    plain = small(samples=12, seed=4, sweep=lengths(2.2e-3, 5.1e-3))
    lines = [RUN, "status run", "check study.toml"]
    with mock.patch.object(Experiment, "results", results):
        lines += ["report run", "export run all.csv --partial"]
        return of_commands(plain, *lines)


@calls("counted: a third of the samples, and what is left of them")
def a_run_in_parts():
    plain = small(samples=31, seed=5, first=2)
    seen = []

    def show(done, total):
        seen.append([done, total])

    exports = ("export run part.csv", "export run all.csv --partial")
    found = of_commands(plain, f"{RUN} --part 2/3", "status run", *exports, "report run")
    with inside():
        for part in ("1/3", "3/3"):
            one = st.Study.from_dict(plain)
            one.run(out="run", part=part, progress=show, workers=1)
    return found | {"progress": [seen[0], seen[-1]]}


@calls("read beside the study")
def what_a_study_would_do():
    with beside(SWEPT):
        check = command("check study.toml")
        Path("study.toml").write_text(
            Path("study.toml").read_text().replace("poisson_ratio", "poison_ratio")
        )
        wrong = command("check study.toml")
    return {"check": check, "wrong": wrong}


test_outputs_are_as_recorded = compared(calls, __file__)
