"""I have a criterion of my own: how does it fare against the exact onset?

A method is a frozen dataclass with the members of `stiction.extensions.Method`. This one says
that the interface slides when the mean strength over a window of given length is reached somewhere.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

import stiction as st
from stiction.extensions import Solver, Variable, onset_variables


@dataclass(frozen=True)
class WeakestWindow:
    """Weakest moving average, all places in the window counting alike."""

    length: float  # m
    type = "weakest_window"
    label = "weakest window"

    def variables(self, problem: st.Problem) -> dict[str, Variable]:
        return onset_variables(problem.interface)

    def seconds_per_sample(self, problem: st.Problem) -> float:
        return 1e-8 * problem.interface.size

    def supports(self, problem: st.Problem) -> list[str]:
        return ["it does not take planes"] if problem.interface.is_plane else []

    def prepare(self, problem: st.Problem) -> Solver:
        width = max(1, round(self.length / problem.interface.spacing))

        def solve(sample: Any) -> dict[str, np.ndarray]:
            excess = (sample.strength - sample.initial_stress) / sample.load_profile
            average = uniform_filter1d(excess, width, axis=1, mode="wrap")
            stress = sample.mean_stress(average.min(axis=1))
            return {
                "critical_load": average.min(axis=1),
                "critical_stress": stress,
                "first_instability": stress,
                "critical_position": problem.interface.x[average.argmin(axis=1)],
            }

        return solve


problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=1.0)
window = WeakestWindow(length=0.6 * problem.nucleation_length)
onsets = {
    method.label: st.monte_carlo(problem, strength, method=method, samples=500, seed=0)
    for method in (window, st.LocalCriterion(), st.Equilibrium())
}
exact = onsets["equilibrium"].critical_stress
for name, onset in onsets.items():
    error = 100.0 * np.abs(onset.critical_stress / exact - 1.0)
    print(f"{name}: mean error {float(error.mean()):.3f} %, largest {float(error.max()):.2f} %")
st.plot.monte_carlo(onsets)
