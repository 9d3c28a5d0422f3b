"""The page about a run."""

import dataclasses

import stiction as st
from stiction.report import Page, shown, write_report


def test_entries():
    assert [shown(each) for each in (1234567, 0.123456789, -0.5, None, float("nan"), "a")] == [
        "1,234,567",
        "0.12346",
        "\N{MINUS SIGN}0.5",
        "\N{EN DASH}",
        "\N{EN DASH}",
        "a",
    ]


def test_a_page_escapes_what_it_is_given():
    page = Page("<T>")
    page.text("1 & 2", warning=True)
    page.table("Table", ["<b>"], [["<i>"]])
    page.listing("File", "<script>")
    html = page.html()
    for text in ("<T>", "<b>", "<i>", "<script>", "1 & 2"):
        assert text not in html
    assert "&lt;script&gt;" in html


def test_figures_of_a_run_show_coefficients_where_there_is_a_pressure(tmp_path):
    plain = st.paper.problem(nodes=256)
    strength = st.paper.strength(plain, correlation_ratio=0.5)
    lengths = [{"random.strength.spectrum.correlation_length": [1e-3, 2e-3]}]
    for pressure in (None, 5e6):
        study = st.Study(
            problem=dataclasses.replace(plain, load=st.Load(normal_pressure=pressure)),
            random=strength,
            method=st.LocalCriterion(),
            ensemble=st.Ensemble(samples=40),
            sweep=lengths if pressure else [],
        )
        run = tmp_path / f"run-{pressure}"
        study.run(out=run)
        write_report(st.open_run(run), tmp_path / "report.html")
        html = (tmp_path / "report.html").read_text()
        assert html.count("<img") == 1 + bool(pressure)
        assert ("Densities of the static friction coefficient" in html) == bool(pressure)
        assert "[problem.solid]" in html
