"""Validation: a wave of slip released on a frictionless interface, against its Laplace solution.

Slip a_0 cos(kx), held in equilibrium and let go: a = a_0 (1 - D0/D)/s in Laplace space.
Run: python validation/waves.py [folder for the figure]
"""

import sys
from dataclasses import replace
from pathlib import Path

try:
    import mpmath
except ImportError:
    raise SystemExit("validation/waves.py needs mpmath: pip install mpmath") from None
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import stiction as st
from stiction.methods.dynamics.method import make_run
from stiction.plot.style import PAGE, panel, paper_style, series

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


def draw(folder: Path, errors: list[tuple[int, float]]) -> None:
    """Amplitude over time, and its error over the step."""
    with paper_style():
        figure = Figure(figsize=(PAGE, 2.6))
        left, right = figure.subplots(1, 2)
        t, a = simulated(200)
        left.plot(t, a, label="200 steps", **series(0))
        points = np.linspace(0.0, END, 41)
        left.plot(points, [exact(p) for p in points], "o", color="0.5", markersize=2.5,
                  label="Laplace inversion")  # fmt: skip
        left.set(xlabel="$|k| c_s t$", ylabel="$a/a_0$")
        left.legend()
        steps = END / np.array([s for s, _ in errors])
        right.loglog(steps, [e for _, e in errors], **series(0, marker=True))
        right.loglog(steps, errors[0][1] * (steps / steps[0]) ** 2, color="0.6", linewidth=0.8)
        right.text(steps[2], 1.6 * errors[2][1], "order 2", ha="right")
        right.set(xlabel=r"$|k| c_s \Delta t$", ylabel="error at the end")
        right.xaxis.set_minor_formatter(NullFormatter())
        right.set_xticks(steps, [f"{step:g}" for step in steps])
        panel(left, "a")
        panel(right, "b")
        figure.savefig(folder / "validation_waves.png")


def main() -> None:
    """Print and draw."""
    errors = compute()
    for (steps, error), (_, next_error) in zip(errors, [*errors[1:], (0, np.nan)], strict=True):
        ratio = error / next_error
        print(f"{steps:5d} steps: error {error:.2e}, ratio to the next {ratio:.3f}")
    draw(Path(sys.argv[1] if len(sys.argv) > 1 else "."), errors)


if __name__ == "__main__":
    main()
