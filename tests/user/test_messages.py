"""What people read before anything is computed: help, examples, checks, suggestions, doubts."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import tomli_w
from checks import python
from recording import stored
from small_study import altered, small_study
from typer.main import get_command

import stiction as st
from stiction.base import files
from stiction.cli.commands import app


@pytest.fixture(autouse=True)
def inside(monkeypatch, tmp_path):
    """Commands run in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def text(**values):
    """The small study with other values."""
    return tomli_w.dumps(altered(small_study(256), **values))


STUDIES = stored("doubtful_studies")
"""What is wrong, as changes of the small study, and the exit code of a run."""
FILES = stored("no_studies")
"""What is in a file that is no study, its encoding, and words of the refusal."""


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("name", STUDIES)
def test_check_says_what_a_run_says_before_its_first_sample(name, inside, runs):
    changes, code = STUDIES[name]
    (inside / "study.toml").write_text(text(**changes))

    def said(line):
        marks = "error: ", "warning: "
        lines = runs(line, code=code).splitlines()
        return [line for line in lines if line.startswith(marks)]

    checked = said("check study.toml")
    assert checked
    assert said("run study.toml --out run --no-pilot")[: len(checked)] == checked


def test_every_help_has_examples_and_no_text_is_cut(runs):
    overview = runs("--help")
    assert "..." not in overview.replace("[ARGS]...", "")
    for name in (command.callback.__name__ for command in app.registered_commands):
        assert re.search(rf"^  {name} ", overview, re.MULTILINE)
        calls = runs(f"{name} --help").partition("\n  Examples:\n")[2].partition("\n\n")[0]
        assert calls, name
        for line in calls.splitlines():
            program, command, *options = shlex.split(line.partition(" > ")[0])
            assert (program, command) == ("stiction", name), line
            get_command(app).commands[name].make_context(name, options)


@pytest.mark.filterwarnings("always")
def test_the_example_is_a_study_that_runs_without_a_doubt(inside, runs):
    runs("example study.toml")
    runs("example study.toml", "already exists", code=2)
    for line in ("check study.toml", "run study.toml --out run", "report run"):
        said = runs(line)
        assert "warning" not in said, said
    answer = runs("reliability study.toml")
    assert re.search(r"Probability of sliding\s.*90 % interval", answer)
    assert re.search(r"\n  probability +[\d.e-]+ +[\d.e-]+ to [\d.e-]+\n", answer)


COMMANDS = """
import contextlib, sys
from stiction.cli import commands

for line in sys.argv[1:]:
    sys.argv = ["stiction", *line.split()]
    with contextlib.suppress(SystemExit):
        commands.main()
"""


def test_commands_need_neither_a_backend_nor_all_letters(inside):
    """In the shell of a notebook, and where the output is redirected on Windows."""
    (inside / "study.toml").write_text(text(title="τ"), encoding="utf-8")
    places = {"cwd": inside, "PYTHONPATH": Path(st.__file__).parents[1]}
    places |= {"PYTHONIOENCODING": "cp1252", "MPLBACKEND": "no_such_backend"}
    said = python("-c", COMMANDS, "check study.toml", "run study.toml --out run", **places)
    assert "valid, '?'" in said
    assert "30 of 30 samples in run" in said


def test_a_cache_that_cannot_be_used_is_said_once(inside):
    (inside / "file").write_text("")
    folder = inside / "file" / "compiled" / "digest"
    files._warn_once.cache_clear()
    with pytest.warns(UserWarning, match="cache: .*cannot be used.*STICTION_CACHE_DIR") as seen:
        assert {files.private_folder(folder) for _ in range(2)} == {folder}
    assert len(seen) == 1


def test_files_that_are_no_study_get_one_line_that_says_what_to_do(inside, runs):
    study = text(title="Größe")
    for name, (content, encoding, words) in FILES.items():
        (inside / name).write_text(content.format(study=study), encoding)
        (line,) = runs(f"check {name}", words, code=2).splitlines()
        assert line.startswith("error: ")
    (inside / "case.toml").write_text(study.replace("[method]", "[Method]"), "utf-8")
    runs("check case.toml", "mean 'method'", code=2)
    (inside / "mark.toml").write_bytes(study.encode("utf-8-sig"))
    (inside / "wide.toml").write_bytes(study.encode("utf-16"))  # `>` of PowerShell 5.1
    runs("check mark.toml", "valid")
    runs("check wide.toml", "valid")
    (line,) = runs("check Mark.toml", "mean 'mark.toml'", code=2).splitlines()
    for folder, code in (("none", 1), ("mark.toml", 2)):
        assert len(runs(f"status {folder}", "give the folder", code=code).splitlines()) == 1
