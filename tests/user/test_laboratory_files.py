"""Files as instruments and spreadsheets write them: the same numbers, or a refusal that helps.

The curves in `tests/files` have 36 readings and the peak 65 at the 25th, in the unit of the file.
"""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from recording import stored
from refusals import refuses

import stiction as st
from stiction.problem.reading import files


def read(folder, text, **options):
    path = folder / "file.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return st.read_profile(path, **options)


def test_maps_without_headings(tmp_path):
    interface = st.Interface(length=(8e-3, 10e-3), nodes=(8, 10))
    heights = 1e6 + np.arange(80.0).reshape(8, 10)
    places = np.stack(np.meshgrid(*interface.coordinates.values(), indexing="ij")).reshape(
        2, 80
    )
    lines = [
        " ".join(f"{v:.12g}" for v in row) for row in np.vstack([places, heights.ravel()]).T
    ]
    for options in ({"interface": interface}, {}):
        given = read(tmp_path, "\n".join(lines), **options)
        np.testing.assert_array_equal(given, heights)


def test_a_large_table_is_read_as_a_small_one(tmp_path, monkeypatch):
    """pandas reads regular lines; any other file is read line by line, with the same refusals."""
    monkeypatch.setattr(files, "LARGE", 2**13)
    monkeypatch.setattr(files, "HEAD", 2**10)
    rng = np.random.default_rng(0)
    x, values = np.arange(1000) * 1e-3, np.round(1.0 + rng.random(1000), 6)
    lines = [f"{a:.3f};{b:.6f}" for a, b in zip(x, values, strict=True)]
    head = "x (mm);strength (MPa)"
    for text in ("\n".join([head, *lines]), "\n".join([head, *lines]).replace(".", ",")):
        assert len(text) > files.LARGE
        np.testing.assert_array_equal(read(tmp_path, text), values * 1e6)
    for wrong, words in stored("cases")["wrong lines"].items():
        lines[750] = wrong
        refuses(words, lambda: read(tmp_path, "\n".join([head, *lines])))
    lines[750] = "0.750;1.5;2"  # cells too many between blanks, too
    blank = "\n".join(lines).replace(";", " ")
    refuses("line", lambda: read(tmp_path, blank, x=0, value=1))
    lines[750] = "0.750;"
    assert np.flatnonzero(np.isnan(read(tmp_path, "\n".join([head, *lines])))) == [750]


def test_heights_become_strengths_by_a_map():
    heights = np.random.default_rng(0).normal(size=(6, 4)) * 1e-6
    places = {"x": 5e-7 * np.arange(6), "y": 2.5e-7 * np.arange(4)}
    scan = xr.DataArray(heights * 1e6, places, ("x", "y"), attrs={"units": "um"})
    strength = st.read_profile(scan, strength=lambda h: 1e6 + 1e11 * h)
    np.testing.assert_allclose(strength, 1e6 + 1e11 * heights, rtol=1e-12)


# -- seventy small files after the formats of instruments ------------------------------------------

FILES = Path(__file__).parents[1] / "files"
KN = 1e3 * np.array([196.1, 173.4, 188.7, 183.6, 190.2, 179.9])
COF = np.array([0.33, 0.31, 0.32, 0.35])
SCAN = 1e6 * np.round(1.0 + 0.1 * (7 * np.arange(24) % 11) / 11, 4)
N, LBF, KGF = 65.0, 65.0 * 4.4482216152605, 65.0 * 9.80665
PLACES = 5e-4 * np.arange(24)
FILES_READ = stored("laboratory_files")
"""Of a file: what it holds, as text, the options that it needs, and its refusal without them.

A curve holds a peak and its place in SI, each with its unit.
"""


def curve(path, **options):
    first = st.read_curve(path, **options)[0]
    return first.peak, first.unit, first.peak_travel, first.travel_unit


def peaks(path, **options):
    return np.concatenate(st.read_peaks(path, **options).values)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", FILES_READ)
def test_a_file_is_read_right_or_refused_with_the_argument_to_add(name):
    reader = {"curve": curve, "peaks": peaks, "profile": st.read_profile}[name.split("_")[0]]
    text, options, words = FILES_READ[name]
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
        np.testing.assert_allclose(getattr(given, "x", PLACES), PLACES, rtol=1e-9)


def test_the_table_holds_every_file():
    assert {path.name for path in FILES.iterdir()} == {*FILES_READ}
