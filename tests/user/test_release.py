"""A release says the same everywhere: version, date, requirements, addresses."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import stiction as st

ROOT = Path(__file__).parents[2]
META = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = (ROOT / "CITATION.cff").read_text()
CODEMETA = json.loads((ROOT / "codemeta.json").read_text())
RECIPE = (ROOT / "conda" / "recipe.yaml").read_text()


def test_the_version_and_its_date_stand_everywhere():
    assert f"\nversion: {st.__version__}\n" in CITATION
    assert CODEMETA["version"] == st.__version__
    assert f'version: "{st.__version__}"' in RECIPE
    heading = rf"^## {re.escape(st.__version__)} - (\d{{4}}-\d\d-\d\d)$"
    (date,) = re.findall(heading, (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert f"date-released: {date}" in CITATION
    assert CODEMETA["datePublished"] == date
    command = [sys.executable, "-m", "stiction", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"stiction {st.__version__}\n"


def test_the_recipe_needs_what_the_package_needs():
    run = RECIPE.split("  run:\n")[1].split("\ntests:")[0].lower()
    for requirement in META["dependencies"]:
        name, version = requirement.lower().split(">=")
        name = "matplotlib-base" if name == "matplotlib" else name
        assert f"    - {name} >={version}" in run
    needed = {one.split(">=")[0] for one in META["dependencies"]}
    assert set(CODEMETA["softwareRequirements"]) == needed
    assert META["scripts"]["stiction"] in RECIPE


def test_pythons_are_those_that_the_workflow_runs():
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(META["classifiers"]))
    workflow = (ROOT / ".github" / "workflows" / "ci.yml").read_text()
    matrix = re.search(r"python: \[(.*)\]", workflow)
    assert re.findall(r"3\.\d+", matrix[1]) == named
    assert META["requires-python"] == f">={named[0]}"


def test_addresses_agree_once_there_are_any():
    address = META.get("urls", {}).get("Repository")
    assert ("repository-code:" in CITATION) == (address is not None)
    assert CODEMETA.get("codeRepository") == address


def test_references_of_the_article_are_there():
    text = (ROOT / "paper" / "paper.md").read_text()
    there = set(re.findall(r"@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text()))
    assert set(re.findall(r"@([a-z]+\d*)", text.split("---")[2])) == there
