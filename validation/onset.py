"""Validation: onset by slow rupture against exact equilibrium, two independent solvers.

Random strength at xi_0/h_n = 0.25, 0.5 and 2: the difference is smooth in the loading rate and
vanishes with it.
Run: python validation/onset.py
"""

import warnings
from typing import Any

import numpy as np

import stiction as st

RATES = (1e3, 1e4, 1e5, 1e6, 2e7, 1e8, 1e9)


def compute(
    nodes: int = 512, samples: int = 5, rates: tuple[float, ...] = RATES
) -> dict[float, np.ndarray]:
    """Relative difference of the first instability, (rates, samples), by correlation ratio."""
    problem = st.paper.problem(nodes=nodes, plane="stress")

    def first(tau_p: np.ndarray, method: Any) -> np.ndarray:
        return st.onset(problem, tau_p, method=method)["first_instability"].values

    found = {}
    for ratio in (0.25, 0.5, 2.0):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", st.AccuracyWarning)
            field = st.paper.strength(problem, correlation_ratio=ratio)
            tau_p = field.sample(problem.interface, samples=samples, seed=3)
        exact = first(tau_p, st.Equilibrium())
        ruptures = [first(tau_p, st.Rupture(loading_rate=rate)) for rate in rates]
        found[ratio] = np.array(ruptures) / exact - 1.0
    return found


def main() -> None:
    """Print them."""
    found = compute()
    for ratio, difference in found.items():
        for rate, values in zip(RATES, difference, strict=True):
            print(f"xi_0/h_n = {ratio:4.2f}, {rate:7.0e} Pa/s: mean {values.mean():+.2e}, "
                  f"largest {np.abs(values).max():.2e}")  # fmt: skip


if __name__ == "__main__":
    main()
