"""Recorded outputs: what is read from a laboratory's tables, files and arrays."""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from crooked import (
    LINE,
    LINE_GAP,
    LINE_STRENGTH,
    PLANE,
    PLANE_GAP,
    PLANE_STRENGTH,
    as_measured,
    write_table,
)
from recording import Calls, compared, refusal
from setups import EXACT, LOCAL

import stiction as st
from stiction.study.export import export

calls = Calls()
BACK = "values written out above, tests/oracle/test_crooked.py and tests/user/test_profiles.py"
SMALL = st.Interface(0.016, 8)
EIGHT = (0.81, 1.02, 0.97, 1.13, 0.88, 1.05, 0.93, 1.21)
TABLES = {
    "semicolons and commas": "x [mm];Festigkeit [MPa]\n"
    + "\n".join(f"{2 * i:d},0;{v:.2f}".replace(".", ",") for i, v in enumerate(EIGHT)),
    "comments and three columns": "# rig 4\n# force in kN\nstation\tx (cm)\tstrength (kPa)\n"
    + "\n".join(f"{i}\t{0.2 * i:.1f}\t{1e3 * v:.0f}" for i, v in enumerate(EIGHT)),
    "blanks without a heading": "# rig 4 of May\n"
    + "\n".join(f"{2e-3 * i:.4f} {1e6 * v:.0f}" for i, v in enumerate(EIGHT)),
    "comments and a first row without a value": "# rig 4, 12 bar\n# x (mm);strength (MPa)\n"
    + "\n".join(f"{2 * i};{'-' if i == 0 else v}" for i, v in enumerate(EIGHT)),
    "rows without values": "strength [MPa];run\n-;3\n-;-\n"
    + "\n".join(f"{v};{i}" for i, v in enumerate(EIGHT[2:])),
    "one column": "strength [MPa]\n" + "\n".join(f"{v}" for v in EIGHT),
    "unsorted with empty cells": "x (mm),strength (MPa),note\n"
    + "\n".join(f"{2 * i},{'' if i == 3 else EIGHT[i]},n{i}" for i in (4, 0, 7, 2, 1, 6, 5, 3)),
}


def table(text, **options):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.csv"
        path.write_text(text, encoding="utf-8")
        return st.read_profile(path, **options)


@calls(BACK)
def tables_of_a_laboratory():
    found = {}
    for name, text in TABLES.items():
        options = {"x": "x (cm)", "value": "strength (kPa)"} if "three" in name else {}
        found[name] = table(text, interface=SMALL, gaps="fill", **options)
    return found


@calls(BACK)
def other_places_and_units():
    shifted = "x (um);strength (kPa)\n" + "\n".join(
        f"{2e3 * i + 700:.0f};{1e3 * v}" for i, v in enumerate(EIGHT)
    )
    dense = [900.0 + 7.0 * i * i for i in range(16)]
    gap = "\n".join(f"{i} {'-' if 5 <= i <= 7 else v}" for i, v in enumerate(dense))
    between = {"x_unit": "mm", "unit": "kPa", "interpolate": True, "gaps": "skip"}
    return {
        "interpolated": table(shifted, interface=SMALL, interpolate=True),
        "beside a gap": table(gap, interface=SMALL, **between),
        "stated": table("\n".join(f"{v}" for v in EIGHT), unit="MPa", interface=SMALL),
        "as read": table(shifted),
        "bare": table(
            "\n".join(f"{2 * i} {1e3 * v}" for i, v in enumerate(EIGHT)),
            x_unit="mm",
            unit="kPa",
            interface=SMALL,
        ),
    }


@calls(BACK)
def friction_coefficients_and_pressures():
    text = "x (mm),coefficient (1)\n" + "\n".join(
        f"{2 * i},{v / 2}" for i, v in enumerate(EIGHT)
    )
    pressure = "x (mm),sigma (bar),pressure (bar)\n" + "\n".join(
        f"{2 * i},{9 + i},{30 * v}" for i, v in enumerate(EIGHT)
    )
    return {
        "coefficient": table(text, interface=SMALL, quantity="friction_coefficient"),
        "pressure": table(pressure, interface=SMALL, quantity="normal_pressure"),
    }


@calls(BACK)
def heights_of_a_matrix_without_a_unit():
    heights = 1e-3 * np.cos(np.arange(96.0)).reshape(12, 8)
    heights[5, 3] = np.nan
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "h.npy", heights)
        return st.read_profile(Path(folder) / "h.npy", quantity="height")


@calls(BACK)
def gaps_across_the_seam():
    holes = as_measured(LINE.interface, np.where(LINE_GAP, np.nan, LINE_STRENGTH))
    read = st.read_profile(holes, interface=LINE.interface, gaps="fill")
    local, onset = (
        st.onset(LINE, holes, method=method, gaps="fill") for method in (LOCAL, EXACT)
    )
    with tempfile.TemporaryDirectory() as folder:
        export(onset, Path(folder) / "onset.csv")
        table = pd.read_csv(Path(folder) / "onset.csv")
    of_line = {"read": read, "local": local, "exact": onset, "table": table}
    of_plane = as_measured(PLANE.interface, np.where(PLANE_GAP, np.nan, PLANE_STRENGTH))
    read = st.read_profile(of_plane, interface=PLANE.interface, gaps="skip")
    return {"line": of_line, "plane": {"read": read}}


@calls(BACK)
def arrays_and_files_of_a_plane():
    with tempfile.TemporaryDirectory() as folder:
        measured = as_measured(PLANE.interface, PLANE_STRENGTH, unit="kPa", scale=1e3)
        measured.rename("strength").to_netcdf(Path(folder) / "scan.nc")
        np.save(Path(folder) / "scan.npy", PLANE_STRENGTH)
        path = write_table(Path(folder) / "scan.csv", measured)
        return {
            "nc": st.read_profile(Path(folder) / "scan.nc", interface=PLANE.interface),
            "npy": st.read_profile(Path(folder) / "scan.npy", interface=PLANE.interface),
            "csv": st.read_profile(path, interface=PLANE.interface),
            "transposed": st.read_profile(measured.transpose(), interface=PLANE.interface),
        }


@calls(BACK)
def peaks_of_tests():
    texts = {
        "forces": "joint;length (mm);peak (kN)\nA;31;0,21\nB;31;0,25\nC;62;0,47\nD;62;0,44\n",
        "stresses": "# rig 2\npeak [MPa]\n0.71\n0.76\n0.69\n",
        "by unit": "test;Kraft [kN]\n1;0,21\n2;0,25\n3;0,22\n",
        "two": "Kraft [kN];Reibzahl [-]\n21;0,31\n25;0,29\n22;0,3\n",
        "coefficients": "test,friction coefficient (1)\n1,0.31\n2,0.29\n3,0.335\n",
    }
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts.items():
            path = Path(folder) / f"{name}.csv"
            path.write_text(text)
        each = {name: (name, None) for name in texts} | {
            f"{name} in {unit}": (name, unit)
            for name, unit in (("stresses", "kPa"), ("forces", "N"), ("stresses", "MPa"))
        }
        for called, (name, unit) in each.items():
            path = Path(folder) / f"{name}.csv"
            given = refusal(lambda path=path, unit=unit: st.read_peaks(path, unit=unit))
            found[called] = given.replace(folder, "") if isinstance(given, str) else given
    return found


@calls("the same profile as an array, to the bit")
def onsets_of_labelled_arrays():
    measured = as_measured(LINE.interface, LINE_STRENGTH)
    both = xr.Dataset({"strength": measured, "residual_strength": 0.21 * measured})
    return st.onset(LINE, both, method=EXACT)


test_outputs_are_as_recorded = compared(calls, __file__)
