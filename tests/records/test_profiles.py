"""Recorded outputs: what is read from a laboratory's tables, files and arrays."""

import dataclasses
from functools import partial
from pathlib import Path

from crooked import (
    LINE,
    LINE_STRENGTH,
    as_measured,
)
from recording import Calls, compared, inside, refusal
from setups import LOCAL

import stiction as st
from stiction.base.units import parse

calls = Calls()
BACK = "values written out above, tests/oracle/test_crooked.py and tests/user/test_profiles.py"
SMALL = st.Interface(0.016, 8)
EIGHT = (0.81, 1.02, 0.97, 1.13, 0.88, 1.05, 0.93, 1.21)


def table(text, **options):
    with inside():
        Path("scan.csv").write_text(text, encoding="utf-8")
        return st.read_profile("scan.csv", **options)


@calls(BACK)
def other_places_and_units():
    dense = [900.0 + 7.0 * i * i for i in range(16)]
    gap = "\n".join(f"{i} {'-' if 5 <= i <= 7 else v}" for i, v in enumerate(dense))
    between = {"x_unit": "mm", "unit": "kPa"}
    return {
        "beside a gap": table(gap, **between),
        "stated": table("\n".join(f"{v}" for v in EIGHT), unit="MPa", interface=SMALL),
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
        "pressure": table(pressure, interface=SMALL, quantity="normal_pressure", value=2),
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
    with inside():
        for name, text in texts.items():
            Path(f"{name}.csv").write_text(text)
            found[name] = refusal(partial(st.read_peaks, f"{name}.csv"))
        for name, unit in (("stresses", "kPa"), ("forces", "N"), ("stresses", "MPa")):
            read = partial(st.read_peaks, f"{name}.csv", unit=unit)
            found[f"{name} in {unit}"] = refusal(read)
    return found


@calls("read: only what follows a slash at once is divided by")
def powers_and_slashes_of_units():
    texts = ["kPa/mm/s", "N/mm s", "kN m/cm^2", "1/s", "mJ mm⁻²", "%", "MPa·um", "N**2/m**3"]
    return {text: [parse(text).factor, parse(text).powers] for text in texts}


@calls("coefficients times the pressure")
def onsets_of_coefficients():
    """In per cent, in another order, with the unit kept by a product."""
    law = st.LinearWeakening(weakening_rate=0.28e12, residual_ratio=0.1)
    ratio = dataclasses.replace(LINE, friction=law)
    pressure = LINE.load.normal_pressure
    percent = as_measured(LINE.interface, LINE_STRENGTH / pressure, "%", 0.01)
    mu = st.read_profile(percent, interface=LINE.interface, quantity="friction_coefficient")
    product = (mu * pressure).assign_attrs(units="1")
    found = {
        "reversed": st.onset(LINE, mu[::-1], method=LOCAL),
        "product": refusal(lambda: st.onset(ratio, product, method=LOCAL)),
    }
    return found


test_outputs_are_as_recorded = compared(calls, __file__)
