"""
Friction laws
=============

The exact onset with one weakening rate at zero slip and three laws.
"""

import dataclasses

import stiction as st

plain = st.paper.problem(nodes=1024)
strength = st.paper.strength(plain, correlation_ratio=0.25)
exponential = st.ExponentialWeakening(weakening_rate=0.5e12)
laws = {
    "linear": st.LinearWeakening(weakening_rate=0.5e12),
    "two pieces": st.PiecewiseWeakening(
        slip=[0.2, 1.0], strength=[0.4, 0.0], weakening_rate=0.5e12
    ),
    "exponential": st.PiecewiseWeakening.from_law(exponential, 16),
}
st.plot.monte_carlo(
    {
        name: st.monte_carlo(
            dataclasses.replace(plain, friction=law),
            strength,
            method=st.Equilibrium(),
            samples=150,
            seed=0,
            progress=False,
        )
        for name, law in laws.items()
    }
)
