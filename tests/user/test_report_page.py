"""Tables and text of the report."""

import pytest

from stiction.report.page import ShownClaim, render, thinned
from stiction.report.tables import Table, shown
from stiction.report.text import mathematics


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("tau_cr", "<i>τ</i><sub>cr</sub>"),
        ("xi_0/h_n", "<i>ξ</i><sub>0</sub>/<i>h</i><sub>n</sub>"),
        ("<tau_p>", "⟨<i>τ</i><sub>p</sub>⟩"),
        ("k^-8", "<i>k</i><sup>\N{MINUS SIGN}8</sup>"),
        ("L >> xi_0", "<i>L</i> ≫ <i>ξ</i><sub>0</sub>"),
        ("G* = G (1+nu)", "<i>G</i>* = <i>G</i> (1+<i>\N{GREEK SMALL LETTER NU}</i>)"),
        ("at -0.5", "at \N{MINUS SIGN}0.5"),
        ("Secs. 3-4, the Cauchy", "Secs. 3-4, the Cauchy"),
        ("a < b & c", "a &lt; b &amp; c"),
        ("<script>", "&lt;script&gt;"),
    ],
)
def test_symbols(text, html):
    assert str(mathematics(text)) == html


def test_entries():
    assert [shown(each) for each in (1234567, 0.123456789, True, None, float("nan"), "a")] == [
        "1,234,567",
        "0.12346",
        "yes",
        "\N{EN DASH}",
        "\N{EN DASH}",
        "a",
    ]


def test_table(tmp_path):
    table = Table.of("t", "T", ("a", "b"), ((i, i / 3.0) for i in range(100)))
    lines = table.write_csv(tmp_path).read_text().splitlines()
    assert len(lines) == 101
    assert float(lines[2].split(",")[1]) == 1.0 / 3.0  # full precision
    rows, step = thinned(table)
    assert (len(rows), step) == (50, 2)
    with pytest.raises(ValueError, match="columns"):
        Table.of("t", "T", ("a", "b"), [(1,)])


def test_page_escapes_what_it_is_given():
    claim = ShownClaim("Sec. 1", "<b>bold</b>", "", ("1 & 2",), "does not hold", "", "below 1 %")
    html = render(
        title="<T>",
        lead="lead",
        headline=[("does not hold", 1)],
        points=["point"],
        exceptions=[],
        key_tables=[],
        figures=[],
        claims=[("Subject", [claim])],
        limits=Table.of("limits", "Limits", ("word", "limit"), [("well", "1 %")]),
        parameters=[],
        notes=[],
        provenance=[],
    )
    assert "<b>bold" not in html
    assert "&lt;T&gt;" in html
    assert 'class="does-not-hold"' in html
