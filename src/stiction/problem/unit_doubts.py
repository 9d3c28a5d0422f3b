"""Warnings about strengths and stresses whose units do not fit the rest of a problem."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction.base.units import Doubt, doubt_units
from stiction.problem.problem import Problem
from stiction.problem.resolution import check_resolution, warn_if_short
from stiction.problem.sample import FRICTION, Sample

RIGIDITY = (1e-8, 1.0), (0.0, math.inf)
"""Usual and possible ratios of strength and shear modulus. Steel (8e10 Pa) under 10 kPa at a
coefficient of 0.1 has 1e-8."""
INITIAL = (1e-5, math.inf), (0.0, math.inf)
"""Usual and possible sizes of an initial stress, if there is any, over the strength."""
SLIP = (1e-8, math.inf), (1e-10, math.inf)
"""Usual and possible slips over which strength falls, m. An atom measures 1e-10 m."""


def doubt_sample(problem: Problem, sample: Sample) -> None:
    """Warn about the units of given profiles, as `doubt_strengths` does."""
    pressure = float(sample.mean(sample.normal_pressure).mean())
    doubt_strengths(
        problem,
        sample.mean_strength,
        float(sample.residual_strength.mean()),
        pressure=None if math.isnan(pressure) else pressure,
        initial=float(np.abs(sample.initial_stress).max()),
    )


def doubt_strengths(
    problem: Problem,
    strength: float,
    residual: float = 0.0,
    scales: Mapping[str, Any] | None = None,
    pressure: float | None = None,
    initial: float | None = None,
) -> None:
    """Warn about mean peak and residual strengths (Pa) that do not fit the rest of the problem.

    Raise an `InputError` for strengths that cannot fit, and for
    scales of slip, given by name, that the grid does not resolve at
    these strengths. By default, `pressure` and `initial`, the size
    of the initial stress, come from the problem.
    """
    friction, modulus = problem.friction, problem.solid.shear_modulus
    pressure = problem.given_pressure if pressure is None else pressure
    compared = [("strength", strength, "shear modulus", modulus, RIGIDITY)]
    if pressure is not None:
        mean = float(np.mean(pressure))
        compared.append(("strength", strength, "normal pressure", mean, FRICTION))
    if residual:
        compared.append(("residual_strength", residual, "shear modulus", modulus, RIGIDITY))
    doubts = [
        Doubt(
            f"{name}: its mean, {mean:.4g} Pa, is {mean / of:.2g} times the {what}. Check the"
            " units of both (Pa). Friction coefficients need quantity='friction_coefficient'",
            mean / of,
            *limits,
        )
        for name, mean, what, of, limits in compared
    ]
    drop = strength - float(np.mean(friction.residual(np.array(strength))))
    if friction.weakening_rate is not None and drop > 0.0:
        slip = drop / float(np.median(friction.weakening_rate))
        text = (
            f"strength: its mean, {strength:.4g} Pa, falls within a slip of {slip:.2g} m, the"
            " size of a few atoms. Check the units of strength, pressure and weakening_rate"
        )
        doubts.append(Doubt(text, slip, *SLIP))
    if initial is None:
        initial = float(np.max(np.abs(problem.load.initial_stress)))
    if initial:
        text = (
            f"initial_stress: its largest size, {initial:.4g} Pa, is"
            f" {initial / strength:.2g} of the strength. Check its unit (Pa)"
        )
        doubts.append(Doubt(text, initial / strength, *INITIAL))
    if doubt_units(doubts):
        return
    given = friction.scale if friction.weakening_rate is None else None
    fixed = {} if given is None else dict([given])
    for scale, value in (scales or fixed).items():
        fall = np.array(strength - residual)
        W = max(float(friction.weakening_rate_of(fall, scale, np.median(value))), 1e-300)
        W *= friction.steepening
        warn_if_short(problem, W)
        check_resolution(problem, W)
