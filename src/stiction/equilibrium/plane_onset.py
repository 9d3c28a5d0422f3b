"""Exact onset of a plane: a coarse grid first, then the turning point on each finer one."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.transform_operator import stiffness_symbol
from stiction.equilibrium.onset_bracket import Bracket, bisect, make_bracket
from stiction.equilibrium.turning_point import close

COARSEST = 8.0
"""Least ratio of the largest K(k) to W on a coarse grid: about six nodes in h_n."""
FEWEST = 8
"""Least nodes along x and y on a coarse grid."""
ROUGH = 1e-4
"""Relative gap on coarse grids."""


class Plane(NamedTuple):
    """Periods (m), G (Pa), nu and the choice of wavenumbers of a plane."""

    lengths: tuple[float, float]
    shear_modulus: float
    poisson_ratio: float
    wavenumbers: Literal["spectral", "lattice"] = "spectral"


@functools.lru_cache(maxsize=16)
def symbol_of(plane: Plane, shape: tuple[int, int]) -> Array:
    """K(k) of a plane on a grid; see `stiffness_symbol`."""
    symbol = stiffness_symbol(shape, *plane)
    return symbol


def halved(fine: Array) -> Array:
    """Values on every other node, averaged with weights 1/4, 1/2, 1/4 along x and y."""
    for axis in (0, 1):
        even, odd = (
            (slice(None),) * axis + (slice(0, None, 2),),
            (slice(None),) * axis + (slice(1, None, 2),),
        )
        fine = 0.5 * fine[even] + 0.25 * (fine[odd] + np.roll(fine[odd], 1, axis))
    return fine


def doubled(coarse: Array) -> Array:
    """Linear interpolation to twice the nodes along x and y."""
    for axis in (0, 1):
        between = 0.5 * (coarse + np.roll(coarse, -1, axis))
        both = np.stack((coarse, between), axis + 1)
        coarse = both.reshape(tuple(2 * n if a == axis else n for a, n in enumerate(coarse.shape)))
    return coarse


@dataclass(frozen=True)
class PlaneOnset:
    """Onset of one sample on a plane.

    Attributes
    ----------
    lower, upper : float
        Rigorous bounds of the onset load tau_0, Pa.
    slip : (nx, ny) array
        d at onset, m; proves the lower bound.
    multiplier : (nx, ny) array
        y, with <p, y> = 1: derivative of the load by the strength; proves the upper bound.
    closed : bool
        Whether they are as close as was asked for. For spectral wavenumbers on a grid too coarse
        for the critical patch they may not be.
    iterations : int
        On the finest grid; each takes two pairs of transforms.
    """

    lower: float
    upper: float
    slip: Array
    multiplier: Array
    closed: bool
    iterations: int


def narrow(bracket: Bracket, gap: float) -> float:
    """Close a bracket from nothing: bisection until Newton's method succeeds; returns the bend."""
    share = 5e-3
    bend = 0.0
    cuts = False
    while not bracket.closed(gap):
        before = bracket.gap
        direction = bisect(bracket, share, 0.05 * min(share, 1e-4), cuts=cuts)
        if cuts and not bracket.closed(2.0 * share):
            break  # the bounds of a stiffness that is no Z-matrix may not meet
        closed, bend = close(bracket, direction, bracket.lower, bracket.slip, gap)
        cuts = cuts or (not closed and share <= 1e-3 and bracket.gap > 0.5 * before)
        share = max(0.2 * share, 0.1 * gap)
    return bend


def plane_onset(
    plane: Plane,
    excess: Array,
    profile: Array,
    rate: Array,
    gap: float = 1e-6,
    slip: Array | None = None,
) -> PlaneOnset:
    """Largest load with an equilibrium while no node has reached its residual strength.

    Parameters
    ----------
    plane : Plane
    excess : (nx, ny) array
        Peak strength less initial stress, Pa.
    profile : (nx, ny) array
        Load profile p > 0.
    rate : (nx, ny) array
        W, Pa/m; zero at nodes that have reached their residual strength.
    gap : float
        Relative gap between the bounds at which to stop.
    slip : (nx, ny) array, optional
        Equilibrium at a lower load to start from, m, instead of coarse grids.
    """
    excess, profile, rate = (
        np.ascontiguousarray(given, dtype=np.float64) for given in (excess, profile, rate)
    )
    levels = [(excess, profile, rate)]
    while slip is None:
        shape = levels[-1][0].shape
        largest = float(symbol_of(plane, shape).max())
        odd = shape[0] % 2 or shape[1] % 2
        if odd or min(shape) < 2 * FEWEST or 0.5 * largest < COARSEST * float(levels[-1][2].max()):
            break
        strength, load_profile, weakening = levels[-1]
        levels.append((halved(strength), halved(load_profile), halved(weakening)))
    bracket = None
    bend = 0.0
    for number in range(len(levels) - 1, -1, -1):
        goal = gap if number == 0 else max(ROUGH, gap)
        coarse = bracket
        strength, load_profile, weakening = levels[number]
        bracket = make_bracket(symbol_of(plane, strength.shape), weakening, strength, load_profile)
        if slip is not None:
            bracket.raise_slip(slip)
        closed = False
        if coarse is not None:
            guess, held = doubled(coarse.slip), doubled(coarse.multiplier)
            held *= 1.0 / np.sqrt((held**2).sum())
            closed, bend = close(bracket, held, coarse.lower, guess, goal, bend)
        if not closed:
            bend = narrow(bracket, goal)
    assert bracket is not None
    return PlaneOnset(
        bracket.lower, bracket.upper, bracket.slip, bracket.multiplier, bracket.closed(gap),
        bracket.iterations,
    )  # fmt: skip
