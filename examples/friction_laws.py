"""The same interface and the same weakening at first slip, with three friction laws.

Strength that falls ever less steeply lets go later, and dissipates more.
Run: python examples/friction_laws.py
"""

import dataclasses

import stiction as st


def main(nodes: int = 512) -> None:
    linear = st.paper.problem(nodes=nodes)
    tau_p = st.paper.strength(linear, correlation_ratio=1.0).sample(linear.interface, seed=1)[0]
    W = linear.friction.weakening_rate
    laws = {
        "linear": linear.friction,
        "exponential": st.ExponentialWeakening(weakening_rate=W),
        "dual": st.PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.4, 0.0], weakening_rate=W),
    }
    for name, law in laws.items():
        problem = dataclasses.replace(linear, friction=law)
        run = st.onset(problem, tau_p, method=st.Rupture(loading_rate=2e7)).isel(sample=0)
        # Equilibrium follows straight pieces: 32 of them stand for the exponential law.
        pieces = st.PiecewiseWeakening.from_law(law, 32) if name == "exponential" else law
        problem = dataclasses.replace(linear, friction=pieces)
        still = st.onset(problem, tau_p, method=st.Equilibrium()).isel(sample=0)
        print(
            f"{name:12s} static friction {run.critical_stress / 1e6:.4f} MPa"
            f" (at rest {still.critical_stress / 1e6:.4f}), dissipated {run.fracture_energy:.3f},"
            f" radiated {run.radiated_energy:.3f} J/m"
        )


if __name__ == "__main__":
    main()
