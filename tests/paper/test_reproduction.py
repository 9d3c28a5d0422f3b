"""The paper, recomputed: rules, claims, and the quick pipeline from the command to the page."""

import ast
import csv
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stiction as st

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from reproduction import claims, modulus, rules, statements_onset, statements_rupture  # noqa: E402
from reproduction import numbers_with_errors as estimates  # noqa: E402
from reproduction.numbers_with_errors import Number  # noqa: E402
from reproduction.rules import Verdict  # noqa: E402

CLAIMS = [
    claim
    for groups in (statements_onset.GROUPS, statements_rupture.GROUPS, {"": modulus.CLAIMS})
    for rows in groups.values()
    for claim in rows
]
MODULES = {"external", "paper", "plot", "statistics", "theory"}
HOLDS, CORRECTED, FAILS, OPEN = (
    Verdict.HOLDS, Verdict.CORRECTED, Verdict.FAILS, Verdict.OPEN,
)  # fmt: skip


def row(*values, error=0.1):
    return [Number(value, error) for value in values]


@pytest.mark.parametrize(
    ("rule", "series", "verdict"),
    [
        (rules.below(1.0), [row(0.2, 0.5)], HOLDS),
        (rules.below(1.0), [row(0.2, 0.9)], OPEN),
        (rules.below(1.0), [row(0.2, 1.5)], FAILS),
        (rules.below(1.0, partly=True), [row(0.2, 1.5)], CORRECTED),
        (rules.above(0.0), [row(0.5)], HOLDS),
        (rules.above(0.0), [row(-0.5)], FAILS),
        (rules.above(0.0), [row(0.2)], OPEN),
        (rules.within(1.0, 2.0), [row(1.5)], HOLDS),
        (rules.within(1.0, 2.0), [row(2.5)], FAILS),
        (rules.printed("0.66"), [row(0.6644, error=0.0)], HOLDS),
        (rules.printed("0.66"), [row(0.667, error=0.0)], FAILS),
        (rules.falling(), [row(3, 2, 1)], HOLDS),
        (rules.falling(), [row(3, 4, 1)], CORRECTED),
        (rules.falling(), [row(1, 2, 3)], FAILS),
        (rules.falling(), [row(1, 1.1)], OPEN),
        (rules.falling(), [row(1, 2, 1)], FAILS),
        (rules.rising(), [row(1, 2, 3)], HOLDS),
        (rules.rising(), [row(1, 0, 3)], CORRECTED),
        (rules.rising(), [row(3, 2)], FAILS),
        (rules.each(rules.below(1.0), rules.above(1.0)), [row(0), row(2)], HOLDS),
        (rules.each(rules.below(1.0), rules.above(1.0)), [row(0), row(0)], FAILS),
        (rules.each(rules.below(1.0), rules.above(1.0)), [row(0), row(1)], OPEN),
        (rules.graded(rules.above(2.0), rules.above(1.0)), [row(3)], HOLDS),
        (rules.graded(rules.above(2.0), rules.above(1.0)), [row(1.5)], CORRECTED),
        (rules.graded(rules.above(2.0), rules.above(1.0)), [row(0)], FAILS),
        (rules.graded(rules.above(2.0), rules.above(1.0)), [row(1.1)], OPEN),
        (rules.main(rules.above(1.0), rules.below(1.0)), [row(2), row(0)], HOLDS),
        (rules.main(rules.above(1.0), rules.below(1.0)), [row(2), row(2)], CORRECTED),
        (rules.main(rules.above(1.0), rules.below(1.0)), [row(0), row(0)], FAILS),
        (rules.main(rules.above(1.0), rules.below(1.0)), [row(2), row(1)], OPEN),
        (rules.never(0.5), [row(0.0, 0.0)], HOLDS),
        (rules.never(0.5), [row(0.0, 0.1)], CORRECTED),
        (rules.never(0.5), [row(0.0, 0.9)], FAILS),
        (rules.by_chance(), [row(0.02, 0.5)], HOLDS),
        (rules.by_chance(), [row(0.001, 0.5)], FAILS),
        (rules.corrected(rules.below(1.0)), [row(0)], CORRECTED),
        (rules.corrected(rules.below(1.0)), [row(2)], FAILS),
        (rules.below(1.0), [[]], OPEN),
        (rules.below(1.0), [], OPEN),
    ],
)
def test_each_rule_gives_each_of_its_verdicts(rule, series, verdict):
    assert rule(series) is verdict
    assert rule.text


def test_every_claim_has_a_place_to_the_sentence_and_a_name_of_its_own():
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS) > 85
    place = re.compile(r"sentence|Eq\. |par\. ")
    for claim in CLAIMS:
        assert place.search(claim.where), claim.name
        assert claim.where.startswith(("Abstract", "Sec. ", "App. ")), claim.name
        assert claim.says.endswith("."), claim.name
        assert claim.kind in ("finding", "arithmetic")


def test_only_public_names_are_used():
    public = set(st.__all__)
    for path in (ROOT / "reproduction").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not (node.module or "").startswith("stiction"), path
            if isinstance(node, ast.Import):
                assert all(a.name == "stiction" for a in node.names if "stiction" in a.name), (
                    path
                )
            if not (isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)):
                continue
            if node.value.id == "st":
                assert node.attr in public | {"__version__"}, f"{path}: st.{node.attr}"


@pytest.mark.parametrize(
    ("function", "exact"),
    [
        (estimates.mean, 2.0),
        (estimates.deviation, 1.0),
        (estimates.skewness, 0.0),
        (lambda v: estimates.quantile(v, 0.25), 2.0 - 0.67449),
        (estimates.lower_spread, 0.67449),
        (estimates.root_mean_square, 5.0**0.5),
        (lambda v: estimates.share(v > 2.0), 0.5),
    ],
)
def test_errors_are_the_scatter_of_repeated_samples(function, exact):
    samples = np.random.default_rng(0).normal(2.0, 1.0, (300, 400))
    found = [function(values) for values in samples]
    values = np.array([number.value for number in found])
    assert values.mean() == pytest.approx(exact, abs=5 * values.std() / 300**0.5 + 0.01)
    assert np.mean([n.error for n in found]) == pytest.approx(values.std(), rel=0.2)


def test_paired_changes_know_their_error():
    draws = np.random.default_rng(1).normal(size=(300, 400))
    found = [estimates.relative_changes(10 + 1.1 * x, 10 + x) for x in draws]
    spreads = np.array([number.value for _, number in found])
    assert spreads.mean() == pytest.approx(0.1, abs=1e-3)


def test_numbers_are_shown_to_two_digits_of_their_error():
    assert claims.rounded(Number(0.76812, 0.00031)) == "0.76812 ± 0.00031"
    assert claims.rounded(Number(-12.3, 1.4)) == "\N{MINUS SIGN}12.3 ± 1.4"
    assert claims.rounded(Number(0.66443)) == "0.6644"


def command(*arguments):
    script = [sys.executable, str(ROOT / "reproduction"), *arguments]
    return subprocess.run(script, capture_output=True, text=True, timeout=600, check=False)


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory):
    out = tmp_path_factory.mktemp("paper")
    result = command("--quick", "--out", str(out))
    assert result.returncode == 0, result.stderr
    return out, result.stdout


def test_the_page_holds_findings_figures_and_claims(pipeline):
    out, said = pipeline
    page = (out / "report.html").read_text(encoding="utf-8")
    order = [page.index(f'id="{name}"') for name in (
        "short", "departures", "paper", "figure-1", "figure-7", "new", "figure-8", "modulus",
        "claims", "errata", "provenance",
    )]  # fmt: skip
    assert order == sorted(order)
    assert len(list((out / "figures").glob("*.png"))) == page.count("<figure ") == 16
    assert 'src="http' not in page
    text = re.sub(r'data:image[^"]*', "", page)
    assert not re.search(r"\bnan\b", text)
    for line in page.splitlines():
        if "Computed:" in line:
            assert re.search(r"Computed: .*\d|nothing: too few samples", line), line
    assert re.search(r"^ +\d+ s  Onsets by exact equilibrium, ", said, flags=re.MULTILINE)


def test_the_table_of_claims_is_tidy(pipeline):
    out, _ = pipeline
    with (out / "claims.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["claim"] for row in rows} == {claim.name for claim in CLAIMS}
    assert {row["verdict"] for row in rows} <= {verdict.value for verdict in Verdict}
    for row in rows:
        float(row["value"]), float(row["error"])
    means = {
        float(row["xi_0/h_n"]): float(row["value"])
        for row in rows
        if row["claim"] == "lower-friction" and row["judged"] == "True"
    }
    assert list(means) == [0.25, 0.5, 1.0, 2.0]
    assert means[0.25] == pytest.approx(0.772, abs=0.01)
    assert means[2.0] == pytest.approx(0.692, abs=0.01)


def test_the_main_results_stand_and_the_bound_holds_in_every_sample(pipeline):
    out, _ = pipeline
    with (out / "claims.csv").open(encoding="utf-8") as file:
        verdicts = {row["claim"]: row["verdict"] for row in csv.DictReader(file)}
    for name in (
        "lower-friction",
        "good-prediction",
        "interaction-suffices",
        "neighbours-lower",
    ):
        assert verdicts[name] == HOLDS.value, name
    assert verdicts["effective-modulus"] == FAILS.value
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "above the exact onset in 2,000 of 2,000 samples" in " ".join(page.split())


def test_a_second_call_computes_nothing_and_figures_can_be_chosen(pipeline):
    out, _ = pipeline
    before = {path: path.stat().st_mtime_ns for path in (out / "studies").rglob("*.nc")}
    result = command("--quick", "--out", str(out), "--figures", "5,9")
    assert result.returncode == 0, result.stderr
    after = {path: path.stat().st_mtime_ns for path in (out / "studies").rglob("*.nc")}
    assert after == before


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--figures", "17"), "there are figures 1 to 16, not 17"),
        (("--quick", "--full"), "not allowed"),
    ],
)
def test_a_wrong_option_is_refused_before_anything_is_computed(arguments, text, tmp_path):
    result = command(*arguments, "--out", str(tmp_path / "none"))
    assert result.returncode == 2
    assert text in result.stderr
    assert not (tmp_path / "none").exists()
