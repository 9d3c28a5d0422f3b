"""Bracket of the onset load of a plane: stable loads from below, eigenvectors from above.

The plain algorithm, robust and linear in the digits asked for: it starts `turning_point`, which
closes the bracket, and takes over where that fails.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import NEGATIVE, SOLVED
from stiction.elasticity.lowest_eigenvector import lowest_eigenvector
from stiction.elasticity.transform_operator import Operator, make_operator
from stiction.equilibrium.controlled_equilibrium import equilibrate
from stiction.equilibrium.minimal_cut import Cutter
from stiction.equilibrium.onset_certificates import (
    lifting_field,
    lower_bound,
    upper_bound,
)

ITERATIONS = 3000
"""Of conjugate gradients, for one equilibrium."""


@dataclass
class Bracket:
    """Programme of one sample on a plane, and what is known of its solution.

    Attributes
    ----------
    operator : Operator
    excess, profile : (nx, ny) arrays
        Strength less initial stress (Pa), and the load profile.
    lower, upper : float
        Rigorous bounds of the onset load, Pa.
    slip, multiplier : (nx, ny) arrays
        d (m) and y, <p, y> = 1, that prove them.
    iterations : int
        Of conjugate gradients or LOBPCG so far; each takes two pairs of transforms.
    """

    operator: Operator
    excess: Array
    profile: Array
    lower: float = field(init=False)
    upper: float = field(init=False)
    slip: Array = field(init=False)
    multiplier: Array = field(init=False)
    iterations: int = 0

    def __post_init__(self) -> None:
        shape = self.excess.shape
        self.workspace = np.empty((3, *shape))
        self.residual = np.empty(shape)
        self.inside = np.zeros(shape, dtype=np.bool_)
        self.slip = np.zeros(shape)
        self.lower = float((self.excess / self.profile).min())
        self.upper = np.inf
        self.multiplier = np.zeros(shape)
        self.lifting = lifting_field(self.operator)
        self.raise_multiplier(self.lifting[0])

    @property
    def gap(self) -> float:
        """Distance between the bounds, Pa."""
        return self.upper - self.lower

    @property
    def magnitude(self) -> float:
        """Load that relative gaps are measured by: the onset, unless that is next to nothing."""
        return max(abs(self.upper), 1e-2 * float(np.abs(self.excess).mean() / self.profile.mean()))

    def closed(self, gap: float) -> bool:
        """Whether the bounds are within a relative gap."""
        return self.gap <= gap * self.magnitude

    @property
    def scale(self) -> float:
        """Stress that errors are measured by, Pa."""
        return self.magnitude * float(self.profile.mean())

    def raise_slip(self, slip: Array) -> float:
        """Take a slip if it proves a higher lower bound; returns its bound."""
        trial = slip.copy()
        load = lower_bound(self.operator, self.excess, self.profile, trial, self.residual)
        if load > self.lower:
            self.lower, self.slip = load, trial
        return load

    def raise_multiplier(self, y: Array) -> float:
        """Take a multiplier if it proves a lower upper bound; returns its bound."""
        trial = y.copy()
        load = upper_bound(
            self.operator, self.excess, self.profile, trial, *self.lifting, self.residual
        )
        if load < self.upper:
            self.upper, self.multiplier = load, trial
        return load


def make_bracket(symbol: Array, rate: Array | float, excess: Array, profile: Array) -> Bracket:
    """The trivial bracket: nothing slips, and the whole slides at once."""
    return Bracket(make_operator(symbol, rate, excess.shape), excess, profile)


def bisect(
    bracket: Bracket, gap: float, accuracy: float, steps: int = 60, cuts: bool = False
) -> Array:
    """Narrow a bracket to a relative gap; returns the last unstable direction, unit norm.

    Parameters
    ----------
    bracket : Bracket
        Changed.
    gap : float
        As a share of the load.
    accuracy : float
        Largest residual stress as a share of the mean strength.
    steps : int
    cuts : bool
        Prove each load without equilibrium to be one, also where its eigenvector does not, or find
        its equilibrium where the set of slipping nodes was taken too large.
    """
    operator, excess, profile = bracket.operator, bracket.excess, bracket.profile
    none = np.zeros_like(excess)
    direction = bracket.multiplier / np.sqrt((bracket.multiplier**2).sum())
    low, high = bracket.lower, bracket.upper
    stable = bracket.slip.copy()
    for _ in range(steps):
        if high - low <= gap * bracket.magnitude:
            break
        load = 0.5 * (low + high)
        slip = stable.copy()
        inside = bracket.inside
        inside[:] = (slip > 0.0) | (excess < load * profile)
        status, taken = equilibrate(
            operator, load * profile - excess, 0.0, none, inside, slip, bracket.residual,
            bracket.workspace, accuracy * bracket.scale, ITERATIONS,
        )  # fmt: skip
        bracket.iterations += taken
        if status == SOLVED:
            low, stable = load, slip
            bracket.raise_slip(slip)
            continue
        high = load
        if status != NEGATIVE:
            continue
        vector = np.abs(bracket.workspace[1])
        value, taken = lowest_eigenvector(
            operator, inside, vector, 1e-4 * float(operator.rate.max()), 200
        )
        bracket.iterations += taken
        if value <= 0.0:
            direction = np.maximum(vector, 0.0)
            high = min(high, bracket.raise_multiplier(vector))
        if cuts and bracket.upper > load:
            cutter = Cutter(operator, accuracy * bracket.scale)
            y, slip = cutter.cut(load * profile - excess, stable)
            if y is not None:
                high = min(high, bracket.raise_multiplier(y))
            elif bracket.raise_slip(slip) > low:  # it was the rough solutions that looked unstable
                low, high, stable = bracket.lower, bracket.upper, bracket.slip.copy()
    return direction
