"""Validation: energy balance of a rupture, and its convergence with the time step.

Work of the load, less friction, less the static strain energy of the slip, is radiated: never
negative, and steady once everything rests.
Run: python validation/energy.py
"""

from dataclasses import replace

import numpy as np

import stiction as st

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0, plane="strain")
LOAD = 7.5e5


def rupture(steps: int, barrier: float = 1e6, end: float = 40e-6):
    """A weak spot under constant load; a high barrier arrests what it starts."""
    interface = st.Interface(length=0.1, nodes=256)
    friction = st.LinearWeakening(weakening_rate=2e11, residual_strength=2e5)
    problem = st.Problem(SOLID, interface, friction)
    strength = barrier - (barrier - 6.5e5) * np.exp(-(((interface.x - 0.05) / 0.012) ** 4))
    load = ([0.0, 1.0], [LOAD, LOAD])
    method = st.Rupture(load=load, implicit=False, stop="time", end_time=end)
    method = replace(method, courant=end / steps / method.medium(problem).largest_step)
    save = st.Save([], every=max(1, steps // 250))
    return st.simulate_rupture(problem, strength, method=method, save=save)


def compute() -> list[tuple[int, float]]:
    """Relative error of the radiated energy for ever smaller steps."""

    def radiated(steps: int) -> float:
        return float(rupture(steps)["radiated_energy"][-1])

    reference = radiated(8000)
    return [(steps, abs(radiated(steps) / reference - 1.0)) for steps in (400, 800, 1600)]


def main() -> None:
    """Print them."""
    errors = compute()
    for steps, error in errors:
        print(f"{steps:5d} steps: radiated energy off by {error:.2e}")
    print(f"order {np.log2(errors[0][1] / errors[1][1]):.2f}")
    held = rupture(4000, barrier=4e6, end=200e-6)["radiated_energy"].values
    print(f"arrested: radiated {held[-1]:.6f} J/m, smallest {held.min():.1e}, change over the last "
          f"half {abs(held[-1] / held[held.size // 2] - 1.0):.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
