"""One table in many dialects: read to the same numbers, or refused, but never to other numbers."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies
from recording import stored

import stiction as st
from stiction.problem.reading import files

LENGTHS = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "microns": 1e-6, "Millimeter": 1e-3}
STRESSES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm²": 1e6, "Megapascal": 1e6, "bar": 1e5}
DIALECTS = stored("dialects")
"""What may differ between two laboratories, the plainest dialect, and usual variants of it."""
HEADINGS = DIALECTS["headings"]


@strategies.composite
def dialects(draw):
    """How a table is written.

    Where points mark thousands, commas mark decimals, so that no comma separates columns.
    """
    choose = lambda *options: draw(strategies.sampled_from(options))  # noqa: E731
    mark = choose(".", ",")
    thousands = choose("", "", "", *{".", ","} - {mark}, "'", " ", "\N{NARROW NO-BREAK SPACE}")
    separators = (";", "\t") if thousands == "." else (";", "\t", ",", " ", "   ")
    chosen = {"mark": mark, "thousands": thousands, "separator": choose(*separators)}
    return chosen | {name: choose(*some) for name, some in DIALECTS["options"].items()}


def number_in(value, dialect):
    """Return a number as this laboratory writes it, and what it then is."""
    text = f"{value:.{dialect['digits']}e}" if dialect["exponent"] else (
        f"{value:,.{dialect['digits']}f}"
    )  # fmt: skip
    known = float(text.replace(",", ""))
    text = text.replace(",", "\0").replace(".", dialect["mark"])
    return text.replace("\0", dialect["thousands"]), known


def written(dialect, x, values):
    """Return the text of a table, and what is in it in SI: x, values."""
    separator, units = dialect["separator"], (dialect["length"], dialect["stress"])
    scales = LENGTHS[units[0]], STRESSES[units[1]]
    shuffled = np.random.default_rng(0).permutation(x.size)
    rising = np.arange(x.size)
    order = {"rising": rising, "falling": rising[::-1], "shuffled": shuffled}[dialect["order"]]
    head = [
        HEADINGS[dialect["heading"]].format(name, text)
        for name, text in zip(dialect["names"], units, strict=True)
    ]
    rows, known = [], []
    for place, i in enumerate(order):
        cells, numbers = [], []
        for value, scale in zip((x[i], values[i]), scales, strict=True):
            text, number = number_in(value / scale, dialect)
            cells.append(text)
            numbers.append(number * scale)
        if dialect["gap"] is not None and place == 3:
            cells[1], numbers[1] = dialect["gap"], np.nan
        known.append(numbers)
        rows.append(([str(place)] if dialect["index"] else []) + cells)
    index = [""] * dialect["index"]
    lines = [index + head]
    if dialect["heading"] == "below":
        lines.append(index + list(units))
    if dialect["blank"]:
        lines.append([""] * len(rows[0]))
    text = [separator.join(cells) + separator * dialect["trailing"] for cells in lines + rows]
    return dialect["end"].join([*dialect["before"], *text, ""]), np.array(known)


def is_same_or_refused(path, dialect, x, values, **options):
    """Whether a file was read: to the numbers that were written, or not at all."""
    text, known = written(dialect, x, values)
    try:
        content = text.encode(dialect["encoding"])
    except UnicodeEncodeError:
        return None
    path.write_bytes(content)
    try:
        profile = st.read_profile(path, **options)
    except st.InputError:
        return False
    known = known[np.argsort(known[:, 0], kind="stable")]
    np.testing.assert_allclose(profile.x, known[:, 0], rtol=1e-12, err_msg=text[:300])
    np.testing.assert_allclose(profile.values, known[:, 1], rtol=1e-12, err_msg=text[:300])
    return True


X = np.linspace(0.0, 0.0317, 9)
VALUES = np.array([0.98, 1.0205, 1.5, 2.25, 1.234, 1.111, 1.0, 0.999, 3.1]) * 1e6


@settings(max_examples=400, deadline=None)
@given(dialect=dialects())
def test_a_table_in_any_dialect(tmp_path_factory, dialect):
    """Numbers are the same, or the file is refused: also where a mark may be one of thousands."""
    path = tmp_path_factory.getbasetemp() / "dialect.csv"
    for values in (VALUES, np.round(VALUES, -3)):
        is_same_or_refused(path, dialect, X, values)


@pytest.mark.parametrize(
    ("separator", "mark", "heading"),
    [
        (separator, mark, heading)
        for separator, mark in [(";", ","), ("\t", ","), (",", "."), (" ", ".")]
        for heading in HEADINGS
        if separator != " " or heading not in ("slash", "in")  # where blanks separate all words
    ],
)
def test_usual_dialects_are_read(tmp_path, heading, separator, mark, monkeypatch):
    """None of these may be refused; the same by the reader of large files."""
    chosen = {"separator": separator, "mark": mark, "heading": heading}
    variants = DIALECTS["usual"] + (DIALECTS["of columns"] if separator != " " else [])
    for large, head in ((files.LARGE, files.HEAD), (0, 120)):
        monkeypatch.setattr(files, "LARGE", large)
        monkeypatch.setattr(files, "HEAD", head)
        for variant in variants:
            dialect = DIALECTS["plain"] | chosen | variant
            assert is_same_or_refused(tmp_path / "t.csv", dialect, X, VALUES), variant
