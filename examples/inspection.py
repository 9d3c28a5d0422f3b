"""What is an inspection worth? Failure probabilities of specimens before and after a scan.

Each of forty simulated specimens is scanned over a tenth, a third and all of its length, with an
error of 20 kPa, and its failure probability computed given the scan.
Run: python examples/inspection.py
"""

import numpy as np
import xarray as xr

import stiction as st

SHARES = {"a tenth": 0.1, "a third": 1 / 3, "all": 1.0}
STRESS, NOISE = 0.68e6, 20e3  # Pa


def probabilities(
    specimens: int = 40, samples: int = 1000
) -> tuple[float, dict[str, np.ndarray]]:
    """Return P of an unknown specimen, and of each one given a scan of each share."""
    problem = st.paper.problem(nodes=512)
    strength = st.paper.strength(problem, correlation_ratio=1.0)
    x, rng = problem.interface.x, np.random.default_rng(0)

    def failing(field: st.RandomField, samples: int = samples, seed: int = 0) -> float:
        found = st.monte_carlo(
            problem, field, method=st.LocalCriterion(), samples=samples, seed=seed, pilot=False,
            progress=False,
        )  # fmt: skip
        return float((found.critical_stress < STRESS).mean())

    found: dict[str, list[float]] = {name: [] for name in SHARES}
    profiles = strength.sample(problem.interface, samples=specimens, seed=1)
    for number, specimen in enumerate(profiles):
        measured = specimen + NOISE * rng.standard_normal(x.size)
        for name, share in SHARES.items():
            scan = xr.DataArray(measured, {"x": x}, "x")[: round(share * x.size)]
            found[name].append(failing(strength.given(scan, noise=NOISE), seed=number))
    return failing(strength, 20_000), {name: np.array(each) for name, each in found.items()}


if __name__ == "__main__":
    before, after = probabilities()
    print(f"without a scan P = {before:.3f}")
    for name, values in after.items():
        print(
            f"{name} scanned: mean {values.mean():.3f} +- {values.std() / values.size**0.5:.3f},"
            f" {np.mean(values < 0.1 * before):.0%} of specimens below a tenth of it,"
            f" {np.mean(values > 0.9):.0%} above 0.9"
        )
