"""What the lower tail hangs on: correlation length, interface length, the least strengths."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats
import xarray as xr

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.methods import Method
from stiction.problem import Problem
from stiction.progress import Meter, Show
from stiction.random.marginals import Beta
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, as_random_interface
from stiction.random.spectra import CustomSpectrum
from stiction.reliability.curve import failure_curve
from stiction.reliability.limit_state import Event

CORRELATION_RATIOS = (0.25, 0.5, 1.0, 2.0)
LONGER = 4
"""Ratio of the two interface lengths that are compared."""


@dataclass(frozen=True, eq=False)
class TailStudy:
    """Failure curves of one system with one thing changed at a time.

    Attributes
    ----------
    correlation : dict of Dataset
        By xi_0/h_n.
    length : dict of Dataset
        By the length over that of the system: 1 and 4.
    lower_end : dict of Dataset
        By name of the marginal; all have the same mean and standard deviation.
    """

    correlation: Mapping[float, xr.Dataset]
    length: Mapping[int, xr.Dataset]
    lower_end: Mapping[str, xr.Dataset]


def weakest_link(probability: Array, ratio: float) -> Array:
    """P of an interface `ratio` times longer, were it a chain of independent pieces.

    The survival probability to the power of the length ratio (Weibull, 1939), without loss of
    digits for small probabilities.

    Parameters
    ----------
    probability : (k,) array
    ratio : float
    """
    result: Array = -np.expm1(ratio * np.log1p(-np.asarray(probability, dtype=np.float64)))
    return result


def longer(problem: Problem, ratio: int) -> Problem:
    """The same system with `ratio` times the length at the same spacing.

    Of a plane it is `ratio` times the area, at the same proportions if that is a square number and
    along x otherwise.

    Raises
    ------
    InputError
        If something varies along the interface: there is no one way to continue it.
    """
    load, friction = problem.load, problem.friction
    parts = {
        "load.profile": problem.load_profile,
        "load.initial_stress": load.initial_stress,
        "load.normal_pressure": load.normal_pressure,
        "friction.weakening_rate": friction.weakening_rate,
        "friction.critical_slip": friction.critical_slip,
        "friction.fracture_energy": friction.fracture_energy,
        "friction.residual_strength": friction.residual_strength,
        "friction.residual_ratio": friction.residual_ratio,
    }
    varying = [name for name, value in parts.items() if isinstance(value, np.ndarray)]
    if varying:
        raise InputError([f"{name}: is given node by node; give a number" for name in varying])
    old = problem.interface
    if isinstance(old.length, tuple) and isinstance(old.nodes, tuple):
        side = math.isqrt(ratio)
        along, across = (side, side) if side * side == ratio else (ratio, 1)
        (length, width), (nodes, rows) = old.length, old.nodes
        interface = Interface((along * length, across * width), (along * nodes, across * rows))
    else:
        interface = Interface(ratio * old.extent, ratio * old.size)
    return Problem(problem.solid, interface, friction, load, problem.mode)


def alike_marginals(strength: RandomField) -> dict[str, Any]:
    """Marginals of the same mean and standard deviation that end differently below.

    The field's own; a beta distribution of twice its shape parameters, which ends lower and more
    gently (Beta(3, 6) where the own one is not beta); and a log-normal one, which ends at zero.
    """
    mean, deviation = strength.mean, strength.standard_deviation
    own = strength.marginal
    a, b = (2.0 * own.alpha, 2.0 * own.beta) if isinstance(own, Beta) else (3.0, 6.0)
    spread = deviation * (a + b) * np.sqrt((a + b + 1.0) / (a * b))
    low = mean - spread * a / (a + b)
    shape = float(np.sqrt(np.log1p((deviation / mean) ** 2)))
    scale = float(mean * np.exp(-0.5 * shape**2))
    name = f"beta({own.alpha:g}, {own.beta:g})" if isinstance(own, Beta) else own.type
    return {
        name: own,
        f"beta({a:g}, {b:g})": Beta(alpha=a, beta=b, low=low, high=low + spread),
        "log-normal": scipy.stats.lognorm(shape, scale=scale),
    }


def tail_study(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    method: Method,
    smallest: float = 1e-9,
    target_cv: float = 0.3,
    plain_samples: int = 10_000,
    seed: int = 0,
    event: Event = "critical_stress",
    workers: int | None = None,
    time_limit: float | None = None,
    progress: Show = True,
) -> TailStudy:
    """Failure curves for several correlation lengths, two lengths and three lower ends.

    Parameters
    ----------
    problem : Problem
        Uniform along the interface.
    random : RandomInterface or RandomField
        What is random; the spectrum of the strength must have a correlation length, and only the
        strength differs between the curves.
    method : LocalCriterion or Equilibrium
    smallest, target_cv, plain_samples, seed, event, workers, progress
        As in `failure_curve`.
    time_limit : float, optional
        Seconds for each curve.

    Returns
    -------
    TailStudy

    Raises
    ------
    InputError
        If something varies along the interface, or the spectrum has no correlation length.
    """
    random = as_random_interface(random)
    strength = random.strength
    if isinstance(strength.spectrum, CustomSpectrum):
        raise InputError("strength.spectrum: a spectrum of your own has no correlation length")
    options: dict[str, Any] = {
        "method": method,
        "smallest": smallest,
        "target_cv": target_cv,
        "plain_samples": plain_samples,
        "seed": seed,
        "event": event,
        "workers": workers,
        "time_limit": time_limit,
        "progress": progress is True,
    }
    long = longer(problem, LONGER)

    own_spectrum = strength.spectrum

    def curve(field: RandomField, system: Problem = problem) -> xr.Dataset:
        return failure_curve(system, dataclasses.replace(random, strength=field), **options)

    def of_length(ratio: float) -> RandomField:
        spectrum = own_spectrum.with_correlation_length(ratio * problem.nucleation_length)
        return dataclasses.replace(strength, spectrum=spectrum)

    others = list(alike_marginals(strength).items())
    total = len(others) + len(CORRELATION_RATIOS) + 1
    with Meter("tail_study", total, progress, unit="curves") as meter:

        def curve(field: RandomField, system: Problem = problem) -> xr.Dataset:
            own = dataclasses.replace(random, strength=field)
            found = failure_curve(system, own, **options)
            meter.advance()
            return found

        own = curve(strength)
        ends = {others[0][0]: own}
        for name, marginal in others[1:]:
            ends[name] = curve(dataclasses.replace(strength, marginal=marginal))
        return TailStudy(
            correlation={ratio: curve(of_length(ratio)) for ratio in CORRELATION_RATIOS},
            length={1: own, LONGER: curve(strength, long)},
            lower_end=ends,
        )
