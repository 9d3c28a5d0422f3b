"""Make peaks.csv: synthetic, with what a laboratory's table has and a simulation lacks.

Nothing here was measured. Twenty-five specimens of 100 mm and fifteen of 40 mm with the same random
strength are simulated by exact equilibrium; each peak gets the error of a load cell and is written
with four digits, in the order of the tests, in MPa and mm.

    python examples/data/make_peaks.py
"""

import dataclasses
from pathlib import Path

import numpy as np

import stiction as st

PROBLEM = st.paper.problem(nodes=512)
STRENGTH = st.paper.strength(PROBLEM, correlation_ratio=1.0)  # xi_0 = h_n = 3.08 mm
LOAD_CELL = 4e3  # Pa
TESTS = ((0.1, 512, 25), (0.04, 204, 15))  # length in m, nodes, tests


def peaks() -> list[tuple[float, float]]:
    """Length in mm and peak in MPa of each test, in random order."""
    rng = np.random.default_rng(15)
    found = []
    for length, nodes, tests in TESTS:
        interface = st.Interface(length=length, nodes=nodes)
        problem = dataclasses.replace(PROBLEM, interface=interface)
        options = {"samples": tests, "seed": 15, "first": nodes}
        onset = st.monte_carlo(problem, STRENGTH, method=st.Equilibrium(), **options)
        stress = onset.critical_stress.values + LOAD_CELL * rng.standard_normal(tests)
        found += [(length * 1e3, value * 1e-6) for value in stress]
    return [found[i] for i in rng.permutation(len(found))]


def main() -> None:
    """Write the table beside this script."""
    lines = [
        "# synthetic: made by make_peaks.py, not measured",
        "test; length [mm]; peak [MPa]",
    ]
    lines += [f"{i}; {length:g}; {peak:.4f}" for i, (length, peak) in enumerate(peaks(), 1)]
    path = Path(__file__).parent / "peaks.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
