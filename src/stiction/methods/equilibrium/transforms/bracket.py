"""Bracket of the onset load by transforms: stable loads from below, eigenvectors from above.

For A = K - W, strength less initial stress s and load profile p, the onset is

    max {tau_0 : d >= 0, A d + s - tau_0 p >= 0} = min {<s, y>/<p, y> : y >= 0, A y <= 0}.

Any d >= 0 bounds it from below and any y from above, whatever they were computed with: A need not
be a Z-matrix. Bisection is robust, and its steps are proportional to the number of digits: it
starts `turning_point`, which closes the bracket, and takes over where that fails.
"""

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import (
    NEGATIVE_CURVATURE,
    SOLVED,
    Operator,
    filtered,
    inner,
    lowest_eigenvector,
    make_operator,
    product,
)
from stiction.methods.equilibrium.transforms.held_equilibrium import equilibrate

STEPS = 60
"""Most halvings: more than a double has digits."""
NEAR_ZERO = 1e-2
"""Share of the mean ratio of strength to load below which gaps do not refer to the load itself."""
LIFTED = 0.4
"""Share of g in the lifting field, below one half: then A z < 0 for any W."""


def _lifting_field(operator: Operator) -> tuple[Array, Array]:
    """A field z > 0 with A z < 0 at every node, and -A z (Pa/m), to make multipliers feasible.

    Where W > 0 everywhere it is uniform: K 1 = 0, so -A 1 = W. Otherwise z = 1 - 0.4 g with
    (K + w) g = w where W = 0 and zero elsewhere, w the smallest positive W: for a Z-matrix
    0 <= g < 1, and -A z is 0.4 w (1 - g) where W = 0 and at least W - 0.4 (w + W) g > 0 elsewhere.
    """
    lifting = np.ones(operator.rate.shape)
    free = operator.rate <= 0.0
    if free.any() and not free.all():
        least = float(operator.rate[~free].min())
        pushed = np.empty_like(lifting)
        filtered(operator, least / (operator.symbol + least), free.astype(np.float64), pushed)
        lifting -= LIFTED * pushed
    image = np.empty_like(lifting)
    product(operator, lifting, image)
    return lifting, -image


class Bracket:
    """Programme of one sample on a grid, with the bounds of its solution found so far.

    They are rigorous bounds of the onset load (Pa), `lower` and `upper`, with the slip (m) and the
    multiplier, <p, y> = 1, that prove them: at first no node slips, or all slide at once. All of
    K(k), W (Pa/m), strength less initial stress (Pa) and load profile are given as fields (*shape).
    """

    def __init__(
        self, symbol: Array, rate: Array | float, excess: Array, profile: Array
    ) -> None:
        self.operator = make_operator(symbol, rate, excess.shape)
        self.excess, self.profile = excess.flatten(), profile.flatten()
        self.residual, self.slip, self.multiplier = np.zeros((3, excess.size))
        self.inside = np.zeros(excess.size, dtype=np.bool_)
        self.lower = float((self.excess / self.profile).min())
        self.upper = np.inf
        self.lifting = _lifting_field(self.operator)
        self.raise_multiplier(self.lifting[0])

    @property
    def gap(self) -> float:
        """Distance between the bounds, Pa."""
        return self.upper - self.lower

    @property
    def magnitude(self) -> float:
        """Load to which relative gaps refer: the onset, unless it is close to zero."""
        return max(
            abs(self.upper),
            NEAR_ZERO * float(np.abs(self.excess).mean() / self.profile.mean()),
        )

    def closed(self, gap: float) -> bool:
        """Return whether the bounds are within a relative gap."""
        return self.gap <= gap * self.magnitude

    @property
    def scale(self) -> float:
        """Stress to which errors refer, Pa."""
        return self.magnitude * float(self.profile.mean())

    def raise_slip(self, slip: Array) -> None:
        """Take a slip, cut at zero, if it proves a higher lower bound: it overloads no node."""
        trial = np.maximum(slip, 0.0)
        product(self.operator, trial, self.residual)
        load = float(((self.residual + self.excess) / self.profile).min())
        if load > self.lower:
            self.lower, self.slip = load, trial

    def raise_multiplier(self, y: Array) -> float:
        """Take a multiplier if it proves a lower upper bound, and return its bound.

        The least multiple of z is added that makes A y <= 0; the bound is infinite without one.
        """
        trial = np.maximum(y, 0.0)
        product(self.operator, trial, self.residual)
        lifting, lifted = self.lifting
        high, liftable = self.residual > 0.0, lifted > 0.0
        if (high & ~liftable).any():
            return np.inf
        if high.any():
            trial += float((self.residual[high] / lifted[high]).max()) * lifting
        weight = inner(self.profile, trial)
        if not weight > 0.0:
            return np.inf
        load = inner(self.excess, trial) / weight
        if load < self.upper:
            self.upper, self.multiplier = load, trial / weight
        return load


def bisect(bracket: Bracket, gap: float, accuracy: float) -> Array:
    """Narrow a bracket to a relative gap; return the last unstable direction, of unit norm.

    The accuracy is the largest residual stress as a share of the mean strength.
    """
    operator, excess, profile = bracket.operator, bracket.excess, bracket.profile
    direction = bracket.multiplier / np.sqrt((bracket.multiplier**2).sum())
    low, high = bracket.lower, bracket.upper
    stable = bracket.slip.copy()
    for _ in range(STEPS):
        if high - low <= gap * bracket.magnitude:
            break
        load = 0.5 * (low + high)
        slip = stable.copy()
        inside = bracket.inside
        inside[:] = (slip > 0.0) | (excess < load * profile)
        status, _ = equilibrate(
            operator, load * profile - excess, inside, slip, bracket.residual,
            accuracy * bracket.scale,
        )  # fmt: skip
        if status == SOLVED:
            low, stable = load, slip
            bracket.raise_slip(slip)
            continue
        high = load
        if status != NEGATIVE_CURVATURE:
            continue
        vector = np.abs(operator.direction)
        value, _ = lowest_eigenvector(
            operator, inside, vector, 1e-4 * float(operator.rate.max()), 200
        )
        if value <= 0.0:
            direction = np.maximum(vector, 0.0)
            high = min(high, bracket.raise_multiplier(vector))
    return direction
