"""The paper, recomputed: rules, claims, and the quick pipeline from the command to the page."""

import collections
import contextlib
import csv
import importlib
import io
import re
import sys
import tomllib
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from checks import python
from matplotlib.figure import Figure
from recording import stored

import stiction as st
from reproduction import claims, measures, page, rules, runner
from reproduction import numbers_with_errors as estimates
from reproduction.__main__ import main
from reproduction.numbers_with_errors import Number
from reproduction.rules import Verdict

ROOT = Path(__file__).parents[2]
CLAIMS = list(claims.CLAIMS.values())
HOLDS, CORRECTED, FAILS, OPEN, TEXT = (
    Verdict.HOLDS, Verdict.CORRECTED, Verdict.FAILS, Verdict.OPEN, Verdict.TEXT,
)  # fmt: skip
HIGH, LOW = rules.above(1.0), rules.below(1.0)


@pytest.mark.parametrize(("rule", "verdict", "rows"), stored("rules"))
def test_each_rule_gives_each_of_its_verdicts(rule, verdict, rows):
    """On series of numbers with an error of 0.1."""
    found = eval(rule, globals())
    assert found.text
    assert found([[Number(value, 0.1) for value in row] for row in rows]) is Verdict[verdict]


@pytest.mark.parametrize(("function", "value", "error", "text"), stored("rounded"))
def test_numbers_are_rounded_by_their_error(function, value, error, text):
    assert getattr(estimates, function)(Number(value, error)) == text


def test_readings_that_differ_leave_a_statement_to_the_text_and_limits_are_varied():
    def finding(numbers, rule=LOW, error=0.1):
        rows = {
            key: [claims.Series(f"({key}) n", "", [("", Number(value, error))])]
            for key, value in numbers.items()
        }
        return claims.decide(claims.Claim("n", "N.", "Sec. 1", rule, []), rows)

    assert finding({"a": 0.2, "c": 0.3}).verdict is HOLDS
    found = finding({"a": 0.2, "c": 1.5})
    assert found.verdict is TEXT
    assert found.readings == {"a": HOLDS, "c": FAILS}
    # A reading that decides nothing does not make the others differ.
    assert finding({"a": 0.2, "c": 0.9}).verdict is OPEN
    assert [series.label for series in found.judged] == ["(a) n", "(c) n"]
    # A limit of a paper is varied if it is a choice, a share by its odds; zero is no such limit.
    for rule, number, otherwise in stored("limits"):
        rule, verdicts = eval(rule), {way: Verdict[name] for way, name in otherwise.items()}
        error = 0.1 if rule.text.startswith("below 1") else 0.005
        assert finding({"a": number}, rule, error).otherwise == verdicts, rule.text


def test_only_public_names_are_used():
    """Beyond them the style of figures and a smoothed density, which only figures use."""
    figures = r"from stiction\.(plot\.style|statistics) import "
    for path in (ROOT / "reproduction").rglob("*.py"):
        text = re.sub(figures, "", path.read_text())
        assert set(re.findall(r"\bst\.(\w+)", text)) <= {*st.__all__, "__version__"}, path
        assert not re.search(r"^\s*(from stiction|import stiction\.)", text, re.MULTILINE), path


@pytest.mark.parametrize(("function", "exact"), stored("estimates"))
def test_errors_are_the_scatter_of_repeated_samples(function, exact):
    samples = np.random.default_rng(0).normal(2.0, 1.0, (300, 400))
    found = list(map(eval(function), samples))
    values = np.array([number.value for number in found])
    assert values.mean() == pytest.approx(exact, abs=5 * values.std() / 300**0.5 + 0.01)
    assert np.mean([n.error for n in found]) == pytest.approx(values.std(), rel=0.2)


def test_so_many_events_at_a_rare_share_are_counted_exactly():
    """So many ruptures with an event where random strength alone has 19 of 10,000."""
    p, usual = 0.0019 + 3 * 0.0007, Number(0.0019, 0.0007)
    fewer = (1 - p) ** 8 + 8 * p * (1 - p) ** 7 + 28 * p**2 * (1 - p) ** 6
    for events, exact in ((3, 1.0 - fewer), (0, 1.0)):
        found = estimates.chance_of_so_many(np.arange(8) < events, usual)
        assert found.value == pytest.approx(exact, rel=1e-9)


def test_a_change_of_the_spread_of_pairs_is_that_of_each():
    x = np.random.default_rng(1).normal(size=400)
    _, spread = estimates.relative_changes(10 + 1.1 * x, 10 + x)
    assert (spread.value, spread.error) == pytest.approx((0.1, 0.0), abs=1e-9)


FEWER = runner.QUICK._replace(readings=60, vanishing=60, what_if=16)


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory):
    """The folder and what is printed, with fewer samples where tests ask for no number."""
    folder, said = tmp_path_factory.mktemp("reproduction"), io.StringIO()
    out, pages = folder / "paper", folder / "pages"
    pages.mkdir()
    save, write = Figure.savefig, page.write

    def coarse(figure, file, **_):
        figure.set_layout_engine("none")  # which draws everything twice
        save(figure, file, dpi=30)

    def record(path, *arguments, **options):
        write(path, *arguments, **options)
        text = re.sub(r'data:image[^"]*', "", path.read_text(encoding="utf-8"))
        (pages / f"{len(list(pages.iterdir())):02}.html").write_text(text, encoding="utf-8")

    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.setattr(runner, "QUICK", FEWER)
        patch.setattr(page, "write", record)
        patch.setattr(Figure, "savefig", coarse)
        main(["--quick", "--full", "--out", str(out)])
    return out, said.getvalue()


def test_the_page_holds_findings_figures_and_claims(pipeline):
    out, said = pipeline
    page = (out / "report.html").read_text(encoding="utf-8")
    names = (
        "abstract short paper figure-1 figure-7 new figure-8 departures modulus claims errata"
        " provenance"
    )
    order = [page.index(f'id="{name}"') for name in names.split()]
    assert order == sorted(order)
    assert len(list((out / "figures").glob("*.png"))) == page.count("<figure ") == 13
    assert 'src="http' not in page
    text = re.sub(r'data:image[^"]*', "", page)
    assert not re.search(r"\bnan\b|{{|{%", text)
    for line in page.splitlines():
        if "Computed:" in line:
            assert re.search(r"Computed: .*(\d|too few samples)", line), line
    assert re.search(r"^ +\d+ s  Onsets by exact equilibrium", said, flags=re.MULTILINE)


def table_of(out):
    with (out / "claims.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_table_of_claims_is_tidy_and_the_main_results_stand(pipeline):
    out, _ = pipeline
    rows = table_of(out)
    verdicts = {row["claim"]: row["verdict"] for row in rows}
    assert set(verdicts) == {claim.name for claim in CLAIMS}
    assert len(verdicts) == len(CLAIMS)
    assert set(verdicts.values()) <= {verdict.value for verdict in Verdict}
    spread = collections.defaultdict(list)
    for row in rows:
        if row["claim"] == "variability" and row["judged"] == "True":
            spread[row["quantity"]].append(Number(float(row["value"]), float(row["error"])))
    # The rule, the table of the abstract and the statement of the headline trend agree.
    text = " ".join((out / "report.html").read_text(encoding="utf-8").split())
    assert rules.alike(rules.rising())([*spread.values()]).value == verdicts["variability"]
    start, end = text.index('id="abstract"'), text.index('id="short"')
    table = re.findall(r"<tr>(.*?)</tr>", text[start:end])
    (line,) = (line for line in table if "A shorter correlation length makes" in line)
    assert f">{verdicts['variability']}</span>" in line
    assert all(re.search(r"\d", re.sub("<[^>]*>", "", line)) for line in table[1:])
    # What is new: sentences with a few rounded numbers each, without errors.
    lines = re.findall(r"<li>(.*?)</li>", text[: text.index('id="paper"')])
    assert len(lines) == 7
    assert all(line.endswith(".") and re.search(r"\d", line) for line in lines)
    assert not any("±" in line for line in lines)
    assert stored("verdicts").items() <= verdicts.items()


def cells(path, start):
    """Cells of the rows of a table that begin like this."""
    text = (ROOT / path).read_text(encoding="utf-8")
    return [
        line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith(start)
    ]


def test_numbers_in_the_documentation_are_those_that_are_computed(pipeline):
    """Within five joint standard errors of few samples; the other pages quote the table."""
    computed = {}
    for row in table_of(pipeline[0]):
        key = f"{float(row['xi_0/h_n']):g}" if row["xi_0/h_n"] else row["case"]
        computed[row["claim"], row["quantity"], key] = row
    mean, rms = {}, {}
    table = [row for row in cells("docs/evidence/paper.md", "| `") if len(row) == 4]
    for name, quantity, at, value in table:
        number, error, unit = re.match(r"(\S+) ± (\S+) ?(.*)", value).groups()
        row = computed[name.strip("`"), quantity, at]
        joint = float(error) + float(row["error"])
        assert row["unit"] == unit
        assert abs(float(number) - float(row["value"])) < 5.0 * joint, (name, at)
        mean |= {at: float(number)} if quantity == "one modulus, all samples" else {}
        rms |= {at: float(number)} if quantity.startswith("one modulus, against") else {}
    assert len(table) > 20
    for at in ("0.25", "0.5", "1", "2"):
        row = next(
            row for row in cells("docs/evidence/accuracy.md", f"| {at} |") if len(row) == 9
        )
        for cell, number in zip(row[1:3], (mean[at], rms[at]), strict=True):
            assert cell == f"{float(f'{number:.2g}'):.{len(cell.split('.')[1]) - 2}f} %"
    methods = " ".join(
        (ROOT / "docs/start/choose-a-method.md").read_text(encoding="utf-8").split()
    )
    quoted = [f"{float(f'{number:.1g}'):g}" for number in mean.values()]
    assert f"{', '.join(quoted[:3])} and {quoted[3]} % too high on average" in methods


def test_an_interrupted_study_repeats_none_of_its_parts(tmp_path):
    """The third of four parts fails. The second call computes it and the fourth, a third none."""
    computed, failing = [], [2]

    @runner.kept()
    def study(run):
        def part(number):
            if number in failing:
                raise KeyboardInterrupt
            computed.append(number)
            return xr.Dataset({"square": number**2})

        parts = run.map(part, [(number,) for number in range(4)])
        return xr.Dataset({"total": sum(int(one.square) for one in parts)})

    def total():
        run = runner.Runner(tmp_path, FEWER, seed=0, workers=1)
        with run.started([("study", "a study", study)]) as studies:
            return int(studies["study"].result().total)

    with pytest.raises(KeyboardInterrupt), contextlib.redirect_stdout(io.StringIO()):
        total()
    failing.clear()
    assert [total(), total()] == [14, 14]
    assert sorted(computed) == [0, 1, 2, 3]
    assert not [path for path in (tmp_path / "studies").iterdir() if path.is_dir()]


def test_the_page_is_written_with_every_figure_and_one_figure_needs_its_studies_only(
    pipeline, tmp_path, monkeypatch
):
    pages = pipeline[0].parent / "pages"
    texts = [path.read_text(encoding="utf-8") for path in sorted(pages.iterdir())]
    assert [text.count("<figure ") for text in texts] == [*range(1, 14), 13]
    assert ["Still being computed" in text for text in texts] == [True] * 13 + [False]
    monkeypatch.setattr(runner, "QUICK", FEWER)
    main(["--quick", "--figure", "7", "--out", str(tmp_path)])
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["figure_07.png"]
    studies = {path.name.split("-")[0] for path in (tmp_path / "studies").iterdir()}
    assert studies == {"theory", "moments"}


SETS = {
    path.stem: path.read_text("utf-8")
    for folder in ("reproduction/parameters", "tests/records")
    for path in (ROOT / folder).glob("*.toml")
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "parts"), stored("own_parameters"))
def test_samples_and_parameters_of_ones_own(name, parts, tmp_path):
    """The page speaks of these parameters, with units by the size of the numbers."""
    (tmp_path / "my.toml").write_text(SETS[name])
    call = ("--quick", "--parameters", tmp_path / "my.toml", "--out", tmp_path / "out")
    assert "figure 12" in python(ROOT / "reproduction", *call)
    page = re.sub(r'data:image[^"]*', "", (tmp_path / "out/report.html").read_text("utf-8"))
    page = " ".join(page.split())
    for part in (*parts, "were tested with these parameters", "not the paper's"):
        assert part in page, part
    assert not re.search(r"\bnan\b|{{|{%|Figure 13\.|We find|The paper found", page)
    shown = page[: page.index('id="departures"')]  # below are limits and warnings
    assert not re.search(r"\de[+-]\d\d\b", shown)
    links = set(re.findall(r'href="#([^"]+)"', page))
    assert links <= set(re.findall(r'id="([^"]+)"', page))
    assert "Not explained" not in page


def begun(monkeypatch):
    """Forget the modules, each of which reads its parameters once."""
    for name in [name for name in sys.modules if name.startswith("reproduction")]:
        monkeypatch.delitem(sys.modules, name)


def setting_of(text, monkeypatch):
    """The setting with other parameters."""
    begun(monkeypatch)
    importlib.import_module("reproduction").PARAMETERS.update(tomllib.loads(text))
    return importlib.import_module("reproduction.setting")


def test_the_parameters_of_the_documentation_are_taken(monkeypatch):
    text = (ROOT / "docs/evidence/paper.md").read_text("utf-8")
    (table,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    setting = setting_of(table, monkeypatch)
    assert setting.L == 1.0
    assert setting.residual(5e6) == 2e6
    assert (setting.LOW, setting.HIGH, setting.LOADING_RATE) == (4e6, 12e6, 6e7)


def test_a_fault_of_100_km_has_its_correlation_lengths_from_its_nucleation_length(monkeypatch):
    """The strength is checked with xi_0 in proportion to h_n, and dips stay above tau_r."""
    setting = setting_of(SETS["fault"], monkeypatch)
    assert setting.FIELD.spectrum.correlation_length == pytest.approx(0.25 * setting.H)
    assert pytest.approx(setting.MEAN - 60e6) == setting.DROP
    studies = importlib.import_module("reproduction.studies")
    dip = studies.dips(0.0)
    assert dip.min() == pytest.approx(60e6 + 0.7 * setting.DROP)


def test_pairs_are_compared_without_samples_in_which_an_event_is_arrested():
    """The first event of equilibrium need not be the first event of a rupture."""

    def study(events, stress):
        rows = {"arrested_events": events, "critical_stress": stress}
        made = {name: (("correlation_ratio", "sample"), [row]) for name, row in rows.items()}
        done = Future()
        done.set_result(xr.Dataset(made, {"correlation_ratio": [0.25]}))
        return done

    studies = {
        "ruptures": study([0, 1, 0], [1.0, 3.0, 4.0]),
        "exact": study([0, 0, 2, 0], [2.0, 2.0, 2.0, 2.0]),
    }
    data = runner.Data(studies, runner.QUICK)
    assert measures.offsets(data, 0.25, "exact").tolist() == [1.0]


@pytest.mark.parametrize(("arguments", "own", "text"), stored("wrong_options"))
def test_a_wrong_option_is_refused_before_anything_is_computed(
    arguments, own, text, tmp_path, monkeypatch, capsys
):
    (tmp_path / "my.toml").write_text(own)
    begun(monkeypatch)
    command = importlib.import_module("reproduction.__main__")
    files = ("--parameters", str(tmp_path / "my.toml"), "--out", str(tmp_path / "none"))
    with pytest.raises(SystemExit) as ended:
        command.main([*arguments, *files])
    complaint = capsys.readouterr().err
    assert ended.value.code == 2
    assert text in complaint
    assert len(complaint.splitlines()[-1]) > len(text)
    assert not (tmp_path / "none").exists()
