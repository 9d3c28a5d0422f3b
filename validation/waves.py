"""Validation: a wave of slip released on a frictionless interface, against its Laplace solution.

Slip a_0 cos(kx), held in equilibrium and let go: a = a_0 (1 - D0/D)/s in Laplace space.
Run: python validation/waves.py
"""

from dataclasses import replace

try:
    import mpmath
except ImportError:
    raise SystemExit("validation/waves.py needs mpmath: pip install mpmath") from None
import numpy as np

import stiction as st
from stiction.methods.dynamics.method import make_run

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
ETA = SOLID.wave_speed_ratio
INTERFACE = st.Interface(length=0.1, nodes=32)
K = INTERFACE.wavenumbers[2]
UNIT = 1.0 / (K * SOLID.shear_wave_speed)  # s; time in units of 1/(k c_s)
END = 20.0


def exact(t: float) -> float:
    """a/a_0 by numerical inversion (Talbot) with 40 digits."""

    def transform(s):
        shear = mpmath.sqrt(s - 1j) * mpmath.sqrt(s + 1j)
        fast = mpmath.sqrt(s - 1j * ETA) * mpmath.sqrt(s + 1j * ETA) / ETA
        symbol = ((2 + s * s) ** 2 - 4 * shear * fast) / (s * s * shear)
        return (1 - 2 * (1 - 1 / ETA**2) / symbol) / s

    if t == 0.0:
        return 1.0
    with mpmath.workdps(40):
        return float(mpmath.invertlaplace(transform, t, method="talbot", degree=90))


def simulated(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (in 1/(k c_s)) and a/a_0 of an explicit run; everything slides at its residual."""
    friction = st.LinearWeakening(weakening_rate=1e9, residual_strength=1e6)
    problem = st.Problem(SOLID, INTERFACE, friction)
    load = ([0.0, 1.0], [2e6, 2e6])
    method = st.Rupture(load=load, implicit=False, stop="time", end_time=END * UNIT)
    method = replace(method, courant=END * UNIT / steps / method.medium(problem).largest_step)
    rows = problem.sample(np.full(INTERFACE.nodes, 1.001e6), accept=method.accepts)
    run = make_run(method, method.medium(problem), rows, 0)
    state = run.start(0.0, 1e-3 + 1e-6 * np.cos(K * INTERFACE.x))
    times, slips = [0.0], [state.slip.copy()]
    for _ in range(steps):
        run.advance(state, 1)
        times.append(float(state.now["time"]))
        slips.append(state.slip.copy())
    mode = np.fft.rfft(slips, axis=1)[:, 2].real / (INTERFACE.nodes / 2) / 1e-6
    return np.array(times) / UNIT, mode


def compute() -> list[tuple[int, float]]:
    """Error at the end for ever smaller steps."""
    target = exact(END)
    return [(steps, abs(simulated(steps)[1][-1] - target)) for steps in (200, 400, 800, 1600)]


def main() -> None:
    """Print them."""
    errors = compute()
    for (steps, error), (_, next_error) in zip(errors, [*errors[1:], (0, np.nan)], strict=True):
        ratio = error / next_error
        print(f"{steps:5d} steps: error {error:.2e}, ratio to the next {ratio:.3f}")


if __name__ == "__main__":
    main()
