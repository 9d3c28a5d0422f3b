"""Validation: memory by exponentials against direct convolution over the whole history.

The same predictor-corrector steps through a rupture: with sums of exponentials, with the full
history, and with a history cut off at |k| c_s t = 100, as tables of the kernel are.
Run: python validation/memory.py
"""

from dataclasses import replace

import numpy as np

import stiction as st
from stiction.elasticity.memory_kernels import arc_quadrature

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
NODES, STEPS, LOADING = 128, 1200, 3e9
PROBLEM = st.Problem(
    SOLID, st.Interface(length=0.05, nodes=NODES), st.LinearWeakening(weakening_rate=0.2e12)
)
X = PROBLEM.interface.x
TAU_P = 1e6 - 2e5 * np.exp(-(((X - 0.02) / 0.004) ** 2)) - 5e4 * np.cos(600.0 * X)


def by_exponentials(tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and slip at every step."""
    step = 0.37 * PROBLEM.interface.spacing / SOLID.shear_wave_speed
    method = st.Rupture(
        loading_rate=LOADING, implicit=False, kernel_tolerance=tolerance,
        stop="time", end_time=TAU_P.min() / LOADING + STEPS * step,
    )  # fmt: skip
    method = replace(method, courant=step / method.medium(PROBLEM).largest_step)
    run = st.simulate_rupture(PROBLEM, TAU_P, method=method, save=st.Save(["slip"], every=1))
    return run["time"].values, run["slip"].values


def by_convolution(times: np.ndarray, cut: float = np.inf) -> np.ndarray:
    """Slip at every step, from the whole history or from |k| c_s t < cut only."""
    h = times[1] - times[0]
    wavenumbers = PROBLEM.interface.wavenumbers[1:]
    pace = wavenumbers * SOLID.shear_wave_speed
    nodes, weights = arc_quadrature("II", SOLID.wave_speed_ratio)
    sk = np.multiply.outer(nodes, pace)
    first = weights[:, None] * np.expm1(sk * h) / sk
    kernel = np.empty((STEPS + 1, pace.size))
    for m in range(STEPS + 1):
        kernel[m] = np.where(m * h * pace < cut, first.sum(axis=0).real, 0.0)
        first *= np.exp(sk * h)
    static = 0.5 * PROBLEM.effective_modulus * wavenumbers
    dynamic = 0.5 * SOLID.shear_modulus * wavenumbers
    impedance = 0.5 * SOLID.shear_modulus / SOLID.shear_wave_speed
    slip, rate = np.zeros(NODES), np.zeros(NODES)
    past, slips = np.zeros((STEPS, pace.size), dtype=complex), [slip]
    for i in range(STEPS):
        lag = np.einsum("mk,mk->k", kernel[1 : i + 1], past[:i][::-1])

        def step(mean, i=i, lag=lag, slip=slip):
            fresh = slip + h * mean
            moved = dynamic * (lag + kernel[0] * np.fft.rfft(mean)[1:])
            moved = np.fft.irfft(np.r_[0.0, moved - static * np.fft.rfft(fresh)[1:]], NODES)
            excess = moved + LOADING * times[i + 1] - np.maximum(TAU_P - 0.2e12 * fresh, 0.0)
            return fresh, np.maximum(excess, 0.0) / impedance

        _, guess = step(rate)
        mean = 0.5 * (rate + guess)
        slip, rate = step(mean)
        past[i] = np.fft.rfft(mean)[1:]
        slips.append(slip)
    return np.array(slips)


def compute() -> dict[str, np.ndarray]:
    """Largest difference of the slip from that of the full history, in units of its maximum."""
    times, _ = by_exponentials(1e-6)
    full = by_convolution(times)
    slips = {f"exponentials, {tol:.0e}": by_exponentials(tol)[1] for tol in (1e-4, 1e-6)}
    slips["history cut at 100"] = by_convolution(times, 100.0)
    return {name: np.abs(slip - full).max(axis=1) / full.max() for name, slip in slips.items()}


def main() -> None:
    """Print them."""
    found = compute()
    for name, error in found.items():
        print(f"{name:22s} largest difference in slip {error.max():.1e} of the largest slip")


if __name__ == "__main__":
    main()
