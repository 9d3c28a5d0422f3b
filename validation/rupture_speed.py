"""Validation: rupture speed against driving, S = (tau_p - tau_0)/(tau_0 - tau_r).

Uniform interface, a weak patch that breaks at once. For weak driving the speed tends to the
Rayleigh speed from below; for strong driving the rupture becomes supershear (Burridge 1973,
Andrews 1976: in an unbounded medium below S of about 1.77).
Run: python validation/rupture_speed.py
"""

import numpy as np

import stiction as st
from stiction.methods.dynamics.summary import rupture_speed

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0, plane="strain")
RATE, STRENGTH = 1e12, 1e6


def speed(ratio: float, nodes: int = 4096) -> tuple[np.ndarray, np.ndarray]:
    """Distance from the patch's centre in h_n, and speed in c_R, up to 0.85 of the half period."""
    modulus = SOLID.effective_modulus("II")
    spacing = 1.158 * modulus / RATE / 20.0
    interface = st.Interface(length=nodes * spacing, nodes=nodes)
    problem = st.Problem(SOLID, interface, st.LinearWeakening(weakening_rate=RATE))
    load = STRENGTH / (1.0 + ratio)
    # Griffith length of a crack with fracture energy tau_p^2/(2 W) under the drop tau_0.
    griffith = 2.0 * modulus * STRENGTH**2 / (np.pi * RATE * load**2)
    x = problem.interface.x - 0.5 * problem.interface.length
    run = st.simulate_rupture(
        problem,
        np.where(np.abs(x) < 0.75 * griffith, 0.98 * load, STRENGTH),
        method=st.Rupture(load=([0.0, 1.0], [load, load]), implicit=False),
        save=st.Save([], every=500),
    )
    found = rupture_speed(run["arrival_time"].values, spacing, problem.nucleation_length)
    right = slice(nodes // 2, nodes // 2 + int(0.425 * nodes))
    return x[right] / problem.nucleation_length, found[right] / SOLID.rayleigh_wave_speed


def compute(ratios: tuple[float, ...] = (0.5, 0.8, 1.2, 1.6, 2.0, 3.5)) -> dict[float, tuple]:
    """Speed along the interface for each driving ratio."""
    return {ratio: speed(ratio) for ratio in ratios}


def main() -> None:
    """Print them."""
    curves = compute()
    for ratio, (_, found) in curves.items():
        last = found[np.isfinite(found)][-20:]
        kind = "supershear" if last.mean() > 1.1 else "below c_R"
        print(f"S = {ratio:3.1f}: final speed {last.mean():.4f} c_R, {kind}")


if __name__ == "__main__":
    main()
