"""Validation: the elastodynamic memory kernel and its short sums of exponentials.

Prints the pairs needed at each tolerance and Poisson's ratio, and draws kernel and errors.
Run: python validation/kernels.py [folder for the figure]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from stiction.elasticity.exponential_sum import kernel_sum
from stiction.elasticity.memory_kernels import memory_kernel
from stiction.plot.style import PAGE, panel, paper_style, series

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


def draw(folder: Path) -> None:
    """Kernels of both modes, and the error of the sums over the times they must serve."""
    with paper_style():
        figure = Figure(figsize=(PAGE, 2.6))
        left, right = figure.subplots(1, 2)
        t = np.linspace(0.0, 25.0, 800)
        left.plot(t, memory_kernel(t, "II", PAPER), label=r"mode II, $\nu=0.33$", **series(0))
        left.plot(t, memory_kernel(t, "III", 1.0), label="mode III", **series(1))
        left.set(xlabel=r"$T = |k| c_s t$", ylabel="$C(T)$")
        left.legend()
        t = np.geomspace(1e-2, 1e6, 60_000)
        exact = memory_kernel(t, "II", PAPER)
        for i, tolerance in enumerate(TOLERANCES):
            kernel = kernel_sum("II", PAPER, tolerance)
            error = np.abs(kernel(t) - exact).reshape(300, -1).max(axis=1)
            style = series(i) | {"linewidth": 0.9}
            right.loglog(t[::200], error, label=f"{kernel.poles.size} pairs", **style)
        right.axvline(1e5, color="0.6", linewidth=0.7)
        right.set(xlabel="$T$", ylabel="largest error nearby", ylim=(1e-9, 1e-2))
        right.legend()
        panel(left, "a")
        panel(right, "b")
        figure.savefig(folder / "validation_kernels.png")


def main() -> None:
    """Print and draw."""
    for (name, tolerance), (pairs, error) in compute().items():
        print(f"{name:24s} tolerance {tolerance:7.0e}: {pairs:3d} pairs, error {error:.2e}")
    draw(Path(sys.argv[1] if len(sys.argv) > 1 else "."))


if __name__ == "__main__":
    main()
