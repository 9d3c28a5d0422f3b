"""How likely does a joint let go below a stress, and which stress may it be given?

A joint of 0.1 m whose peak strength varies between 0.66 and 1.66 MPa along the interface
(Albertini et al., 2020, xi_0/h_n = 0.5). Prints the probability that it lets go below 0.664 MPa,
by two independent algorithms, the stress with a failure probability of 1e-6, and what the weakest
interfaces have in common.

Run: ``python examples/failure_probability.py``
"""

import numpy as np

import stiction as st


def main():
    problem = st.paper.problem(nodes=1024)
    strength = st.paper.strength(problem, correlation_ratio=0.5)

    stress = 0.664e6
    found = st.failure_probability(
        problem, strength, stress, method=st.Equilibrium(), target_cov=0.2
    )
    print(found)
    print(f"  {found.algorithm}, because of {found.reason}")
    again = st.failure_probability(
        problem, strength, stress, method=st.Equilibrium(), algorithm="importance", target_cov=0.1
    )
    print(again)

    design = st.design_stress(
        problem, strength, probability=1e-6, method=st.Equilibrium(), target_cov=0.2
    )
    print(design)

    # What does a weak interface look like? Move each failing one so that it lets go at the middle.
    weak = found.failing_profiles
    middle = problem.interface.nodes // 2
    nodes = np.rint(weak["critical_position"].values / problem.interface.spacing).astype(int)
    pairs = zip(weak["strength"].values, nodes, strict=True)
    moved = np.array([np.roll(row, middle - node) for row, node in pairs])
    half = round(0.5 * problem.nucleation_length / problem.interface.spacing)
    spot = moved[:, middle - half : middle + half].mean()
    print(f"mean strength over the critical patch {spot / 1e6:.4f} MPa, elsewhere", end=" ")
    print(f"{np.delete(moved, np.s_[middle - half : middle + half], axis=1).mean() / 1e6:.4f} MPa")
    return found, again, design


if __name__ == "__main__":
    main()
