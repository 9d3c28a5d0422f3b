"""Seventy small files after the formats of instruments: right, or refused with the argument to add.

The curves have 36 readings and the peak 65 at the 25th, in the unit of the file. The peaks and
profiles are written out below. `files` in the folder of tests holds them.
"""

from pathlib import Path

import numpy as np
import pytest
from recording import read
from refusals import refuses

import stiction as st

FILES = Path(__file__).parents[1] / "files"
KN = 1e3 * np.array([196.1, 173.4, 188.7, 183.6, 190.2, 179.9])
COF = np.array([0.33, 0.31, 0.32, 0.35])
STRENGTH = 1e6 * np.round(1.0 + 0.1 * (7 * np.arange(24) % 11) / 11, 4)
N, LBF, KGF = 65.0, 65.0 * 4.4482216152605, 65.0 * 9.80665
X = 5e-4 * np.arange(24)
ROWS = read(FILES.with_name("records") / "files_of_laboratories.json")
"""Of a file: what it holds, as text, the options that it needs, and its refusal without them.

A curve holds a peak and its place in SI, each with its unit.
"""


def curve(path, **options):
    first = st.read_curve(path, **options)[0]
    return first.peak, first.unit, first.peak_travel, first.travel_unit


def peaks(path, **options):
    return np.concatenate(st.read_peaks(path, **options).values)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ROWS)
def test_a_file_is_read_right_or_refused_with_the_argument_to_add(name):
    reader = {"curve": curve, "peaks": peaks, "profile": st.read_profile}[name.split("_")[0]]
    text, options, words = ROWS[name]
    if words:
        refuses(words, lambda: reader(FILES / name))
    expected = eval(text or "None")
    if isinstance(expected, tuple):
        value, unit, place, unit_of_place = reader(FILES / name, **options)
        assert (value, place) == pytest.approx(expected[::2], rel=1e-4)
        assert (unit, unit_of_place) == expected[1::2]
    elif expected is not None:
        given = reader(FILES / name, **options)
        np.testing.assert_allclose(given, expected, rtol=1e-9)
        np.testing.assert_allclose(getattr(given, "x", X), X, rtol=1e-9)


def test_the_table_holds_every_file():
    assert {path.name for path in FILES.iterdir()} == {*ROWS}


@pytest.mark.parametrize(
    "heading", ["COF", "Reibzahl", "friction coefficient", "\N{MICRO SIGN}"]
)
def test_a_coefficient_is_not_read_as_a_stress(tmp_path, heading):
    path = tmp_path / "profile.csv"
    path.write_text(f"x (mm),{heading}\n0,0.4\n1,0.5\n2,0.6\n", encoding="utf-8")
    refuses("friction_coefficient", lambda: st.read_profile(path))
    profile = st.read_profile(path, quantity="friction_coefficient")
    np.testing.assert_allclose(profile, [0.4, 0.5, 0.6])
