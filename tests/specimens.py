"""Specimens for tests."""

from typing import Any

import numpy as np
from setups import beta_strength

import stiction as st


def crooked(
    *, nodes: int = 96, drive: Any = None, height: float = 0.031, mode: str = "II",
    nu: float = 0.33, plane: str = "stress", weakening_rate: float = 0.19e12,
    residual: float = 0.52e6, **more: Any,
) -> st.Problem:  # fmt: skip
    """A specimen with nothing symmetric about it."""
    x = (np.arange(nodes) + 0.5) / nodes
    load = st.Load(initial_stress=-2e4 + 9e4 * x * (1.0 - 0.7 * x), normal_pressure=2.1e6)
    return st.Problem(
        solid=st.Solid(youngs_modulus=2.7e9, poisson_ratio=nu, density=1180.0, plane=plane),
        interface=st.Interface(length=0.083, nodes=nodes),
        friction=st.LinearWeakening(weakening_rate=weakening_rate, residual_strength=residual),
        specimen=st.Blocks(height=height, thickness=0.0071, drive=drive or st.Platen()),
        load=more.pop("load", load), mode=mode, **more,
    )  # fmt: skip


def rough(problem: st.Problem, seed: int, samples: int = 1, length: float = 4e-3) -> np.ndarray:
    """Strengths of a few patches on the specimen."""
    field = beta_strength(length, 0.68e6, 1.61e6)
    return field.sample(problem.interface, samples=samples, seed=seed)
