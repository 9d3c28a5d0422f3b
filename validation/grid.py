"""Validation: what a grid costs in accuracy, on the rough and smooth fields of the paper.

The same continuous strength, sampled by ever more nodes, against the finest grid: slip when the
mean stress has fallen by 5 % of the mean of tau_p - tau_r after its peak, and critical stress.
Run: python validation/grid.py
"""

import warnings

import numpy as np

import stiction as st

FALL = 0.05


def after_onset(nodes: int, ratio: float, sample: int) -> tuple[np.ndarray, float]:
    """Slip, m, at the given fall of the mean stress, and critical stress, Pa."""
    problem = st.paper.problem(nodes=nodes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.AccuracyWarning)
        field = st.paper.strength(problem, correlation_ratio=ratio)
        tau_p = field.sample(problem.interface, samples=1, seed=5, first=sample)[0]
        method, save = st.Rupture(loading_rate=2e7), st.Save(["slip"], every=1)
        run = st.simulate_rupture(problem, tau_p, method=method, save=save)
    drop = FALL * np.mean(tau_p - problem.friction.residual_strength)
    stress, slip = run["mean_stress"].values, run["slip"].values
    peak = int(np.argmax(stress))
    limit = stress[peak] - drop
    last = peak + int(np.argmax(stress[peak:] < limit))
    share = (stress[last - 1] - limit) / (stress[last - 1] - stress[last])
    return slip[last - 1] + share * (slip[last] - slip[last - 1]), float(run["critical_stress"])


def compute(
    ratios: tuple[float, ...] = (0.25, 0.5, 2.0),
    grids: tuple[int, ...] = (256, 512, 1024, 2048, 4096),
    samples: int = 6,
) -> dict[tuple[float, int], np.ndarray]:
    """Relative errors (slip, critical stress), (2, samples), by ratio and nodes."""
    found: dict[tuple[float, int], np.ndarray] = {}
    for ratio in ratios:
        reference = [after_onset(grids[-1], ratio, i) for i in range(samples)]
        for nodes in grids[:-1]:
            errors = []
            for i, (fine, critical) in enumerate(reference):
                slip, stress = after_onset(nodes, ratio, i)
                change = np.abs(slip - fine[:: grids[-1] // nodes]).max() / fine.max()
                errors.append((change, abs(stress / critical - 1)))
            found[ratio, nodes] = np.array(errors).T
    return found


def main() -> None:
    """Print the table."""
    for (ratio, nodes), (slip, stress) in compute().items():
        problem = st.paper.problem(nodes=nodes)
        resolution = problem.nucleation_length / problem.interface.spacing
        print(
            f"xi_0/h_n = {ratio:4.2f}, {resolution:4.1f} nodes to h_n: slip median "
            f"{np.median(slip):.4f}, largest {slip.max():.4f}; critical stress, largest "
            f"{stress.max():.1e}"
        )


if __name__ == "__main__":
    main()
