"""Make strength_profile.csv: synthetic, with what a laboratory's record has and a simulation lacks.

Nothing here was measured. A piece of a simulated field (lognormal above 0.3 MPa, power law with
exponent 2) gets a tilt, as of a specimen that was not quite level, white noise of the sensor, a
stretch where the sensor lost the surface, single readings that were rejected, and the rounding of a
file that is written with four digits.

    python examples/data/make_strength_profile.py
"""

from pathlib import Path

import numpy as np

import stiction as st

POINTS, SPACING = 1200, 0.1e-3  # 120 mm
FIELD = st.RandomField(
    st.Lognormal(mean=1.0e6, cv=0.18, low=0.3e6),  # Pa
    st.PowerLawSpectrum(correlation_length=2.4e-3, exponent=2.0, power_kept=0.999),  # m
    mean_mode=True,
)
TILT = 0.1e6 / (POINTS * SPACING)  # Pa/m
NOISE = 0.03e6  # Pa
LOST = slice(640, 672)


def record() -> tuple[np.ndarray, np.ndarray]:
    """x in mm and strength in MPa, NaN where there is no reading."""
    period = st.Interface(length=3 * POINTS * SPACING, nodes=3 * POINTS)
    strength = FIELD.sample(period, seed=20)[0, :POINTS]
    x = period.x[:POINTS]
    rng = np.random.default_rng(20)
    strength = strength + TILT * (x - x.mean()) + NOISE * rng.standard_normal(POINTS)
    strength[LOST] = np.nan
    strength[rng.choice(POINTS, 6, replace=False)] = np.nan
    return x * 1e3, strength * 1e-6


def main() -> None:
    """Write the file beside this script."""
    first = "# synthetic: made by make_strength_profile.py, not measured"
    lines = [first, "x (mm); strength (MPa)"]
    for x, strength in zip(*record(), strict=True):
        lines.append(f"{x:.1f}; " + ("" if np.isnan(strength) else f"{strength:.4f}"))
    path = Path(__file__).with_name("strength_profile.csv")
    path.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
