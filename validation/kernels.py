"""Validation: the elastodynamic memory kernel and its short sums of exponentials.

Prints the pairs needed at each tolerance and Poisson's ratio.
Run: python validation/kernels.py
"""

import numpy as np

from stiction.elasticity.exponential_sum import kernel_sum
from stiction.elasticity.memory_kernels import memory_kernel

PAPER = np.sqrt(2.0 / 0.67)  # c_d/c_s in plane stress at nu = 0.33
SOLIDS = {
    "II, stress, nu = 0.33": ("II", PAPER),
    "II, strain, nu = 0": ("II", np.sqrt(2.0)),
    "II, strain, nu = 0.25": ("II", np.sqrt(3.0)),
    "II, strain, nu = 0.49": ("II", np.sqrt(51.0)),
    "III": ("III", 1.0),
}
TOLERANCES = (5e-5, 1e-6)


def compute() -> dict[tuple[str, float], tuple[int, float]]:
    """Pairs, and the largest error on times that no fit has seen, by solid and tolerance."""
    times = np.concatenate([np.linspace(0.0, 100.0, 5001), np.geomspace(100.0, 1e5, 20_001)])
    found = {}
    for name, (mode, eta) in SOLIDS.items():
        exact = memory_kernel(times, mode, eta)
        for tolerance in TOLERANCES:
            kernel = kernel_sum(mode, eta, tolerance)
            found[name, tolerance] = (kernel.poles.size, np.abs(kernel(times) - exact).max())
    return found


def main() -> None:
    """Print them."""
    for (name, tolerance), (pairs, error) in compute().items():
        print(f"{name:24s} tolerance {tolerance:7.0e}: {pairs:3d} pairs, error {error:.2e}")


if __name__ == "__main__":
    main()
