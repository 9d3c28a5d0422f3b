"""Laws of readers: each option counts, and a table has the same numbers in each format."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import openpyxl
import pandas as pd
import pytest
from contracts.bodies import BODIES, FIELD, attempt
from recording import evaluated
from refusals import warning_texts

import stiction as st

pytestmark = pytest.mark.filterwarnings("ignore")
MM, MPA = [0.5 * i for i in range(8)], [1.25, 1.5, 1.125, 1.75, 1.0625, 1.875, 1.375, 1.625]
PROFILE = [["x (mm)", "far (mm)", "strength (MPa)", "other (MPa)"]]
PROFILE += [[x, 2.0 * x, s, 3.0 - s] for x, s in zip(MM, MPA, strict=True)]
HEIGHTS = [["x (mm)", "height (um)"], *zip(MM, MPA, strict=True)]
TIMES = [i / 10 for i in range(40)]
FORCE = [10.0 * t if t < 2.5 else 8.0 + 0.01 * t for t in TIMES]
CURVE = [["time (s)", "travel (mm)", "friction (N)", "side (N)"]]
CURVE += [[t, 0.25 * t, f, 0.5 * f + 0.125 * t] for t, f in zip(TIMES, FORCE, strict=True)]
CYCLES = [["time (s)", "friction (N)"]]
CYCLES += [[0.1 * i, 4.0 + 0.5 * (i % 40) + 0.1 * (i // 40)] for i in range(320)]
PEAKS = [["specimen", "peak (kN)", "other (kN)", "normal (kN)"]]
PEAKS += [[i + 1, 10.0 * s, 12.0 * s, 40.0 + i] for i, s in enumerate(MPA)]


def headed(table: Any, *words: str) -> Any:
    """The table under other headings, '' for those that stay."""
    return [[word or old for word, old in zip(words, table[0], strict=True)], *table[1:]]


def of_three_digits(table: Any) -> Any:
    """Numbers as texts whose point could also mark thousands."""
    return [table[0], *([f"{1.0 + cell:.3f}" for cell in row] for row in table[1:])]


TURNED = [*PROFILE[:1], *PROFILE[2:], [4.0, *PROFILE[1][1:]]]
"""The first node at the end of the period."""
ABOVE = [["7", "8", "9", "1"], ["", "", "", ""]]
OPTIONS: dict[str, dict[str, Any]] = evaluated("options of readers", globals())
"""Of a reader, by option: a table in which it counts, and a value."""
BASE = {("read_peaks", "surfaces"): {"normal": "normal (kN)"}}
CASES = [(reader, option) for reader in OPTIONS for option in OPTIONS[reader]]


def as_text(table: Any, folder: Path) -> Path:
    path = folder / "table.csv"
    path.write_text("\n".join(";".join(map(str, row)) for row in table))
    return path


def as_workbook(table: Any, folder: Path) -> Path:
    """With a second sheet, whose numbers are twice as large."""
    book, path = openpyxl.Workbook(), folder / "table.xlsx"
    for sheet, factor in ((book.active, 1), (book.create_sheet("More"), 2)):
        for row in table:
            numbers = [c if isinstance(c, str) else factor * c for c in row]
            sheet.append([None if c == "" else c for c in numbers])
    book.save(path)
    return path


def as_frame(table: Any, folder: Path) -> pd.DataFrame:
    return pd.DataFrame(table[1:], columns=table[0])


FORMATS = {"text": as_text, "workbook": as_workbook, "frame": as_frame}
TAKEN = {  # option: the formats that it is about, if not all
    "decimal": ["text", "workbook"], "skip": ["text", "workbook"], "sheet": ["workbook"],
}  # fmt: skip


def numbers_of(result: Any) -> str:
    """All that a reader returns, but for names of files and of tests."""
    plain = result.to_dict()
    if "attrs" in plain:
        parts = [(plain | plain["attrs"])[key] for key in ("name", "coords", "data", "units")]
    else:
        parts = [part | {"read": 0, "name": ""} for part in plain.get("tests", [plain])]
    number = r"\d+\.\d+(e-\d+)?"
    return re.sub(number, lambda text: f"{float(text[0]):.12g}", repr(parts))


def read(reader: str, form: str, table: Any, folder: Path, **options: Any) -> tuple[str, str]:
    """The numbers that are read, or the refusal."""
    source = FORMATS[form](table, folder)
    result, refusal = attempt(lambda: getattr(st, reader)(source, **options))
    return ("" if refusal else numbers_of(result)), refusal


def test_every_option_of_a_reader_has_a_table():
    for reader, options in OPTIONS.items():
        names = [*inspect.signature(getattr(st, reader)).parameters][1:]
        assert {*names} == options.keys()


@pytest.mark.parametrize(("reader", "option"), CASES)
def test_each_option_of_a_reader_counts_in_each_format_and_gives_the_same_numbers(
    reader, option, tmp_path
):
    table, value = OPTIONS[reader][option]
    base, found = BASE.get((reader, option), {}), set()
    for form in FORMATS:
        if form == "frame" and reader == "read_peaks":
            continue
        plain = read(reader, form, table, tmp_path, **base)
        with_option = read(reader, form, table, tmp_path, **base, **{option: value})
        if form in TAKEN.get(option, FORMATS):
            assert with_option[0], with_option[1]
            assert with_option[0] != plain[0], f"{option} has no effect on a {form}"
            found.add(with_option[0])
        else:
            assert option in with_option[1] or with_option == plain
    assert len(found) == 1, found


@pytest.mark.parametrize("reader", OPTIONS)
def test_a_table_has_the_same_numbers_in_each_format(reader, tmp_path):
    """Every table above, with the options that it needs, also in a file with commas."""
    for option, (table, value) in OPTIONS[reader].items():
        if option in ("sheet", "decimal"):
            continue
        given = BASE.get((reader, option), {}) | {option: value}
        text = as_text(table, tmp_path).read_text()
        results = {read(reader, "text", table, tmp_path, **given)}
        path = tmp_path / "comma.csv"
        path.write_text(text.replace(".", ","))
        comma, refusal = attempt(lambda p=path, g=given: getattr(st, reader)(p, **g))
        results.add((numbers_of(comma) if not refusal else "", refusal))
        assert len(results) == 1, (option, results)


@pytest.mark.parametrize("reader", OPTIONS)
@pytest.mark.parametrize("form", ["text", "workbook"])
def test_the_last_of_several_tables_is_read_as_the_refusal_says(reader, form, tmp_path):
    """It names the lines of their first numbers; a heading is part of a table."""
    table = {"read_profile": PROFILE, "read_curve": CURVE, "read_peaks": PEAKS}[reader]
    other = [table[0], *([row[0], *(1.5 * cell for cell in row[1:])] for row in table[1:])]
    remark = ["and again", *[""] * (len(table[0]) - 1)]
    both = [*table, remark, *table, remark, *other]
    numbers, refusal = read(reader, form, both, tmp_path)
    assert not numbers
    size = len(table) + 1
    assert "holds 3 tables" in refusal
    assert f"lines 2, {2 + size}, {2 + 2 * size}." in refusal
    last = read(reader, form, both, tmp_path, skip=2 * size)
    assert last == read(reader, form, other, tmp_path)


@pytest.mark.parametrize("form", ["text", "workbook"])
@pytest.mark.parametrize("name", ["specimen", "Probe", "test", "No."])
def test_specimens_have_whole_numbers_or_names(name, form, tmp_path):
    """Otherwise the headings are swapped. A test without a specimen is no test of another."""
    rows = [[name, "peak (MPa)"], *([i + 1.0, value] for i, value in enumerate(MPA))]
    swapped = [rows[0], *(row[::-1] for row in rows[1:])]
    assert read("read_peaks", form, rows, tmp_path)[0]
    assert f"{name!r}: numbers of specimens must be whole" in read(
        "read_peaks", form, swapped, tmp_path)[1]  # fmt: skip
    for kind in (float, lambda number: f"P{number:g}"):
        gap = [rows[0], *([kind(row[0]), row[1]] for row in rows[1:])]
        gap[3][0] = ""
        _, refusal = read("read_peaks", form, gap, tmp_path)
        assert name in ("test", "No.") or "has no specimen in line 4" in refusal


LINE = BODIES["line"]
STRENGTH = [["x (m)", "strength (Pa)"]]
STRENGTH += [*zip(LINE.interface.x, FIELD.sample(LINE.interface, seed=2)[0], strict=True)]
FIT = {"noise": 0.0, "bootstrap": 20, "marginal": "normal", "progress": False}
READ: dict[str, Any] = {  # every call that reads a table, by a file of it, and a table
    "read_profile": (st.read_profile, STRENGTH),
    "read_curve": (st.read_curve, [row[1:3] for row in CURVE]),
    "read_peaks": (st.read_peaks, [row[1::-1] for row in PEAKS]),
    "fit_field": (lambda path: st.fit_field(pd.read_csv(path, sep=";"), **FIT), STRENGTH),
    "sample": (lambda path: LINE.sample({"strength": pd.read_csv(path, sep=";")}), STRENGTH),
}  # fmt: skip


@pytest.mark.parametrize("column", [0, 1])
@pytest.mark.parametrize("call", READ)
def test_no_number_whose_unit_is_not_stated_is_read_silently(call, column, tmp_path):
    """It is refused, or a warning says which unit is assumed. Stated units leave nothing to say."""
    (read, table), told = READ[call], []
    name, _, unit = table[0][column].partition(" (")
    plain = [text if n != column else name for n, text in enumerate(table[0])]
    for heading in (table[0], plain):
        path, refusals = as_text([heading, *table[1:]], tmp_path), []
        ask = lambda path=path, texts=refusals: texts.append(attempt(lambda: read(path))[1])  # noqa: E731
        doubts = [text for text in warning_texts(ask) if "no unit is stated" in text]
        told.append(" ".join(refusals + doubts))
    assert not told[0]
    assert (name in told[1] and "stated" in told[1]) == bool(unit)


BARE = [row[:1] + row[2:] for row in PROFILE[1:]]
"""Three columns without headings."""


@pytest.mark.parametrize("column", range(3))
@pytest.mark.parametrize("table", [BARE, PROFILE, CURVE, PEAKS], ids=["bare", *OPTIONS])
def test_values_that_repeat_in_a_column_change_no_choice_of_columns(table, column, tmp_path):
    """The same column is read, or the same words refuse the table; steps are no map."""
    steps = [list(row) for row in table]
    for number, row in enumerate(steps[1:] if table is not BARE else steps):
        row[column] = steps[number - number % 2 + (table is not BARE)][column]
    reader = {id(CURVE): "read_curve", id(PEAKS): "read_peaks"}.get(id(table), "read_profile")
    shapes = []
    for rows in (table, steps):
        path = as_text(rows, tmp_path)
        result, refusal = attempt(lambda p=path: getattr(st, reader)(p))
        shapes.append(re.sub(r"-?\d[\d.]*(e-?\d+)?", "#", refusal or numbers_of(result)))
    repeated = ("twice", "repeat", "only rises", "different")
    assert shapes[0] == shapes[1] or any(word in shapes[1] for word in repeated), shapes
