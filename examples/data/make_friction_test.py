"""Make friction_test/: a scan and eight curves as instruments write them, synthetic.

Nothing here was measured. Nine interfaces are samples of one random field. The first was scanned:
its strength gets the noise of a sensor and lost readings, -9999, and is written with few digits.
Eight were sheared in the rig of the tutorial: each equilibrium path gets sliding at its residual
strength and the noise of a load cell, and is written as by a testing machine that counts time.

    python examples/data/make_friction_test.py
"""

from pathlib import Path

import numpy as np

import stiction as st

DRIVE = st.Pusher(height=0.01, width=0.004, stiffness=2e7)
PROBLEM = st.Problem(
    solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
    interface=st.Interface(length=0.1, nodes=256),
    friction=st.LinearWeakening(weakening_rate=0.5e12, residual_strength=0.35e6),
    specimen=st.Blocks(height=0.05, thickness=0.006, drive=DRIVE, pressing="glued"),
    load=st.Load(pressing_force=3e3),
)
FIELD = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),  # Pa
    st.PowerLawSpectrum(correlation_length=1.75e-3),  # m
)
SENSOR, CELL = 20e3, 0.15  # noise, Pa and N
RATE, SPEED = 20.0, 1e-6  # readings per second, m/s
LOST = slice(140, 144)


def scan() -> list[str]:
    """The strength of the first interface, in MPa over mm with three digits."""
    strength = FIELD.sample(PROBLEM.interface, samples=9, seed=32)[0]
    strength = strength + SENSOR * np.random.default_rng(32).standard_normal(strength.size)
    values = strength * 1e-6
    values[LOST] = -9999.0
    rows = zip(PROBLEM.interface.x * 1e3 + 12.3, values, strict=True)
    head = [
        "Scanner 4;synthetic, made by make_friction_test.py;;",
        ";;",
        "x;strength;",
        "mm;MPa;",
    ]
    return head + [f"{x:.3f};{value:.4g};".replace(".", ",") for x, value in rows]


def curve(number: int, strength: np.ndarray) -> list[str]:
    """What the machine writes of one test: time in s, force in kN."""
    path = st.equilibrium_path(PROBLEM, strength, np.linspace(0.0, 2e6, 300))
    travel, force = st.plot.specimens.curve_of(path)[:2]
    known = np.isfinite(travel) & np.isfinite(force)
    travel, force = travel[known], force[known]
    rng = np.random.default_rng(number)
    at = np.arange(0.0, 1.3 * travel[-1], SPEED / RATE)
    sliding = PROBLEM.friction.residual_strength * 0.1 * 0.006  # N, on 100 mm by 6 mm
    values = np.where(at > travel[-1], sliding, np.interp(at, travel, force))
    values = values + CELL * rng.standard_normal(at.size)
    head = [f"Test;{number}", "Crosshead speed;1;um/s", "Time (s);Force (kN)"]
    return head + [f"{x / SPEED:.3f};{f * 1e-3:.6f}" for x, f in zip(at, values, strict=True)]


def main() -> None:
    """Write the files beside this script."""
    folder = Path(__file__).with_name("friction_test")
    (folder / "tests").mkdir(parents=True, exist_ok=True)
    (folder / "strength.csv").write_text("\n".join(scan()) + "\n", "utf-8")
    for number, strength in enumerate(
        FIELD.sample(PROBLEM.interface, samples=9, seed=32)[1:], 1
    ):
        text = "\n".join(curve(number, strength)) + "\n"
        (folder / "tests" / f"test_{number}.csv").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
