"""Seventy small files after the formats of instruments: right, or refused with the argument to add.

The curves have 36 readings and the peak 65 at the 25th, in the unit of the file. The peaks and
profiles are written out below. `files` in the folder of tests holds them.
"""

from pathlib import Path

import numpy as np
import pytest

import stiction as st

FILES = Path(__file__).parents[1] / "files"
KN = 1e3 * np.array([196.1, 173.4, 188.7, 183.6, 190.2, 179.9])
COF = np.array([0.33, 0.31, 0.32, 0.35])
STRENGTH = 1e6 * np.round(1.0 + 0.1 * (7 * np.arange(24) % 11) / 11, 4)
N, LBF, KGF = 65.0, 65.0 * 4.4482216152605, 65.0 * 9.80665

CURVES = {  # name: peak in SI, unit, place of the peak in SI, unit
    "time_force.csv": (N, "N", 2.5, "s"),
    "load_beside_cof.csv": (0.325, "1", 2.5, "s"),
    "normal_and_friction_german.csv": (N, "N", 2.5, "s"),
    "din_headings.csv": (N, "N", 5e-4, "m"),
    "in_units.txt": (N, "N", 5e-4, "m"),
    "underscores.csv": (N, "N", 5e-4, "m"),
    "ff_and_fn.csv": (N, "N", 2.5, "s"),
    "minutes_lbf.csv": (LBF, "N", 2.5, "s"),
    "msec_kgf.csv": (KGF, "N", 2.5, "s"),
    "inches_kip.csv": (1e3 * LBF, "N", 5e-4, "m"),
    "mil_dan.csv": (650.0, "N", 0.5 * 2.54e-5, "m"),
    "labview.lvm": (N, "N", 5e-4, "m"),
    "labview_comma.lvm": (N, "N", 5e-4, "m"),
    "labview_two_forces.lvm": (N, "N", 2.5, "s"),
    "footer.csv": (N, "N", 2.5, "s"),
    "cut.csv": (N, "N", 2.5, "s"),
    "statistics.csv": (N, "N", 2.5, "s"),
    "latin1.csv": (N, "N", 2.5, "s"),
    "utf16.csv": (N, "N", 2.5, "s"),
    "dates.csv": (N, "N", 2.5, "s"),
    "moves_down.csv": (N, "N", 5e-4, "m"),
    "comments.csv": (N, "N", 2.5, "s"),
    "direct_shear.csv": (1e3 * N, "N", 5e-4, "m"),
    "shear_box.csv": (1e3 * N, "Pa", 5e-4, "m"),
    "french.csv": (N, "N", 5e-4, "m"),
    "spanish.csv": (N, "N", 5e-4, "m"),
    "blanks.txt": (N, "N", 5e-4, "m"),
    "quoted.csv": (N, "N", 5e-4, "m"),
    "excel_sep.csv": (N, "N", 2.5, "s"),
    "two_tests.csv": (N, "N", 5e-4, "m"),
    "numbered.csv": (N, "N", 5e-4, "m"),
}
CURVES_BY_ARGUMENT = {  # name: what the refusal names, the argument, the result
    "fx_and_fz.csv": ("force='Fx'", {"force": "Fx"}, (N, "N", 2.5, "s")),
    "force_and_cof.csv": ("force='Ff' or force='COF'", {"force": "Ff"}, (N, "N", 5e-4, "m")),
    "load_and_stress.csv": (
        "force='Load (N)' or force='Stress (MPa)'", {"force": "Load (N)"}, (N, "N", 5e-4, "m"),
    ),
    "side_by_side.csv": ("force=1 or force=3", {"force": 1, "travel": 0}, (N, "N", 5e-4, "m")),
    "steps.csv": ("split='tables'", {"split": "tables"}, (N, "N", 5e-4, "m")),
    "reciprocating.csv": ("split='strokes'", {"split": "strokes"}, (N, "N", 2.5, "s")),
    "stick_slip.csv": ("split='cycles'", {"split": "cycles"}, (39.0, "N", 3.9, "s")),
}  # fmt: skip
PEAKS = {
    "en1090.csv": KN, "en1090_german.csv": KN, "cof.csv": COF, "statistics.csv": KN / 1e3,
    "shear_box.csv": 1e3 * np.array([33, 61, 92, 125]), "x_s_n.csv": KN / 1e3,
    "dates.csv": KN / 1e3, "single.txt": KN, "single_comma.txt": KN, "test.csv": KN,
    "reibzahl.txt": COF, "lengths.csv": KN, "remarks.csv": KN, "french.csv": KN,
    "spanish.csv": KN,
}  # fmt: skip
PEAKS_BY_ARGUMENT = {
    "load_and_tension.csv": ("value='load (kN)'", {"value": "load (kN)"}, KN),
    "static_kinetic.csv": ("value='Static COF'", {"value": 1}, COF),
    "two_specimens.csv": ("2 specimens", None, None),
    "missing.csv": ("missing=", {"missing": ()}, KN),
}
PROFILES = {
    "plain.csv": STRENGTH, "slashes.csv": STRENGTH, "comment.txt": STRENGTH,
    "bare.txt": STRENGTH, "dates.csv": STRENGTH, "cut.csv": STRENGTH, "german.csv": STRENGTH,
    "gap.csv": np.where(np.isin(np.arange(24), (4, 5)), np.nan, STRENGTH),
    "temperature.csv": STRENGTH, "cof.txt": STRENGTH * 5e-7,
}  # fmt: skip
PROFILES_BY_ARGUMENT = {
    "twice.csv": ("value=1 or value=2", {"value": 1}, STRENGTH),
    "unnamed.csv": ("value='a (MPa)' or value='b (MPa)'", {"value": "a (MPa)"}, STRENGTH),
}
BARE = {"bare.txt": {"unit": "MPa", "x_unit": "mm"}}
"""Nothing in a file without headings states a unit: SI is assumed, and printed."""


def curve(path, **options):
    first = st.read_curve(path, **options)[0]
    return first.peak, first.unit, first.peak_travel, first.travel_unit


def peaks(path, **options):
    return np.concatenate(st.read_peaks(path, **options).values)


def profile(path, **options):
    quantity = "friction_coefficient" if "cof" in path.name else "strength"
    options |= BARE.get(path.name.removeprefix("profile_"), {})
    return st.read_profile(path, quantity=quantity, **options)


def refusal_of(call):
    """The text with which a call is refused, '' if it is not."""
    try:
        call()
    except st.InputError as error:
        return str(error)
    return ""


def is_right(given, expected):
    if isinstance(expected, tuple):
        return given[1::2] == expected[1::2] and np.allclose(
            given[::2], expected[::2], rtol=1e-4
        )
    if not np.allclose(given, expected, rtol=1e-9, equal_nan=True):
        return False
    return not hasattr(given, "x") or np.allclose(given.x, 5e-4 * np.arange(24), rtol=1e-9)


@pytest.mark.filterwarnings("ignore")
def test_every_file_is_read_right_or_refused_with_the_argument_to_add():
    kinds = (
        ("curve", curve, CURVES, CURVES_BY_ARGUMENT), ("peaks", peaks, PEAKS, PEAKS_BY_ARGUMENT),
        ("profile", profile, PROFILES, PROFILES_BY_ARGUMENT),
    )  # fmt: skip
    read, refused, wrong = 0, 0, []
    for kind, reader, clear, by_argument in kinds:
        for name, expected in clear.items():
            try:
                right = is_right(reader(FILES / f"{kind}_{name}"), expected)
            except st.InputError as error:
                right, name = False, f"{name}: {error}"
            read += right
            wrong += [f"{kind}_{name}"] * (not right)
        for name, (words, options, expected) in by_argument.items():
            path = FILES / f"{kind}_{name}"
            refusal = refusal_of(lambda path=path, reader=reader: reader(path))
            right = words in refusal and (
                options is None or is_right(reader(path, **options), expected)
            )
            refused += right
            wrong += [f"{path.name}: {refusal}"] * (not right)
    print(f"{read} read, {refused} refused with the argument to add, {len(wrong)} wrong")
    assert not wrong, "\n".join(wrong)
    assert (read, read + refused) >= (50, 60)
    assert read + refused == len([*FILES.iterdir()])


@pytest.mark.parametrize(
    "heading", ["COF", "Reibzahl", "friction coefficient", "\N{MICRO SIGN}"]
)
def test_a_coefficient_is_not_read_as_a_stress(tmp_path, heading):
    path = tmp_path / "profile.csv"
    path.write_text(f"x (mm),{heading}\n0,0.4\n1,0.5\n2,0.6\n", encoding="utf-8")
    assert "friction_coefficient" in refusal_of(lambda: st.read_profile(path))
    read = st.read_profile(path, quantity="friction_coefficient")
    np.testing.assert_allclose(read, [0.4, 0.5, 0.6])


@pytest.mark.parametrize("mark", ["9.9E37", "-9.9e37", "9.91E37"])
def test_marks_of_an_overload_are_no_forces(tmp_path, mark):
    path = tmp_path / "record.csv"
    rows = "\n".join(f"{0.1 * i:.1f},{min(i, 60)}" for i in range(100))
    path.write_text(f"Time (s),Friction force (N)\n{rows}\n10.0,{mark}\n", encoding="utf-8")
    assert "overload" in refusal_of(lambda: st.read_curve(path))
