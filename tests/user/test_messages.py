"""What people read before anything is computed: help, examples, checks, suggestions, doubts."""

from __future__ import annotations

import re
import shlex

import pytest
import tomli_w
from checks import python
from refusals import refuses
from setups import EXACT, beta_strength, make_problem
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


MARGINAL = "random__strength__marginal"
STUDIES = {  # what is wrong, and the exit code of a run
    "MPa": (text(**{f"{MARGINAL}__low": 0.66, f"{MARGINAL}__high": 1.66}), 2),
    "kPa": (text(**{f"{MARGINAL}__low": 660.0, f"{MARGINAL}__high": 1660.0}), 0),
    "uniform": (text(random__strength__spectrum__correlation_length=0.5), 2),
    "below the residual": (text(problem__friction__residual_strength=1.2e6), 2),
    "coarse": (text(random__strength__spectrum__correlation_length=4e-4), 0),
    "a law without scale": (text(problem__friction={}), 2),
    "a force without an area": (text(reliability={"force": 40e3}), 2),
    "a coefficient without a pressure": (text(reliability={"friction_coefficient": 0.4}), 2),
    "a demand in MPa": (text(reliability={"stress": 3.2}), 2),
    "a demand far above": (text(reliability={"stress": 60e6}), 0),
    "a station off the interface": (text(save={"stations": {"far": 3.0}}), 2),
}


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("name", STUDIES)
def test_check_says_what_a_run_says_before_its_first_sample(name, inside, runs):
    content, code = STUDIES[name]
    (inside / "study.toml").write_text(content)

    def said(line):
        marks = "error: ", "warning: "
        lines = runs(line, code=code).splitlines()
        return [line for line in lines if line.startswith(marks)]

    checked = said("check study.toml")
    assert checked
    assert said("run study.toml --out run --no-pilot")[: len(checked)] == checked


def test_a_doubt_of_a_unit_comes_instead_of_advice_that_follows_from_it():
    """A modulus in MPa: no number of nodes would do."""
    law, interface = st.LinearWeakening(weakening_rate=0.5e12), st.Interface(0.1, 1024)
    for modulus, words in ((1e3, "check the units"), (1e8, "interface.nodes: must be")):
        solid = st.Solid(shear_modulus=modulus, poisson_ratio=0.33, density=1170.0)
        with pytest.raises(st.InputError) as caught:
            st.Problem(solid, interface, law)
        assert words in str(caught.value).lower()
        assert ("interface.nodes: must be" in str(caught.value)) == (modulus == 1e8)


def test_what_stands_in_the_place_of_a_random_field_gets_one_line():
    """An array was refused number by number; a field that goes into the wrong call is led on."""
    problem, field = make_problem(), beta_strength(4e-3)
    given = {"method": EXACT, "samples": 2, "progress": False}
    for wrong in (field.sample(problem.interface)[0], 256 * [1e6], "strength", [field, 1.0]):
        with pytest.raises(
            st.InputError, match="For a measured profile, use st.onset"
        ) as caught:
            st.monte_carlo(problem, wrong, **given)
        (text,) = caught.value.problems
        assert text.startswith("random: ")
    words = "got a RandomField ... st.monte_carlo"
    refuses(words, lambda: st.onset(problem, field, method=EXACT))


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
    places = {"cwd": inside, "PYTHONPATH": files.Path(st.__file__).parents[1]}
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
    contents = {
        "tab.toml": (b'peaks = "data\\tau.csv"\n' + text().encode(), "write / for \\, or"),
        "gone.toml": (b'random = "gone.json"\n', "gone.json: does not exist"),
        "letter.toml": (b'peaks = "data\\xau.csv"', "in paths, write / for \\, or"),
        "latin.toml": (study.encode("latin-1"), "save it as UTF-8"),
        "json.toml": (b'{"problem": 1}', "`stiction example FILE` writes a study"),
        "other.toml": (b"[tool.poetry]\n", "FILE` writes a study to start from"),
        "case.toml": (study.replace("[method]", "[Method]").encode(), "mean 'method'"),
    }
    for name, (content, words) in contents.items():
        (inside / name).write_bytes(content)
        (line,) = runs(f"check {name}", words, code=2).splitlines()
        assert line.startswith("error: ")
    (inside / "mark.toml").write_bytes(study.encode("utf-8-sig"))
    (inside / "wide.toml").write_bytes(study.encode("utf-16"))  # `>` of PowerShell 5.1
    runs("check mark.toml", "valid")
    runs("check wide.toml", "valid")
    (line,) = runs("check Mark.toml", "mean 'mark.toml'", code=2).splitlines()
    for folder, code in (("none", 1), ("mark.toml", 2)):
        assert len(runs(f"status {folder}", "give the folder", code=code).splitlines()) == 1
