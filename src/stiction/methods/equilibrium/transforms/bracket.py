"""Bracket the onset load with transforms: stable loads from below, eigenvectors from above.

Problem
-------
With A = K - diag(W) (Pa/m), slip d >= 0 (m), strength minus initial
stress s (Pa) and load profile p > 0, the onset without corners is

    max {load : d >= 0, A d + s - load p >= 0} = min {<s, y>/<p, y> : y >= 0, A y <= 0}.  (1)

Any d >= 0 gives the lower bound min (A d + s)/p. Any y >= 0 gives an
upper bound, after a multiple of a field z > 0 with A z < 0 has been
added to make A y <= 0. The bounds hold for any accuracy of d and y, and
for any signs of the entries in K.

Algorithm
---------
`bisect` halves the interval between a stable and an unstable load. Each
digit costs the same number of steps. Therefore `bisect` only prepares
for `turning_point`, which closes the bracket, and takes over if
`turning_point` fails.

1. Solve for the equilibrium at the middle of the interval, starting
   from the slip of the last stable load (`held_equilibrium`).
2. If there is an equilibrium, it gives a lower bound.
3. If a direction with negative curvature was met, the load is too high.
   The direction is the guess for the lowest eigenvector of A on the
   slipping nodes. If the eigenvalue is not positive, the eigenvector
   gives an upper bound, which becomes the upper end of the interval.
"""

import numpy as np

from stiction.base.arrays import Array
from stiction.elasticity.operator import (
    NEGATIVE_CURVATURE,
    SOLVED,
    Mask,
    Operator,
    filtered,
    inner,
    lowest_eigenvector,
    make_operator,
    product,
)
from stiction.methods.equilibrium.transforms.held_equilibrium import equilibrate

MAX_HALVINGS = 60
"""Most halvings of the interval, more than a double has binary digits."""
MIN_MAGNITUDE = 1e-2
"""Least load to which gaps refer, as a fraction of the mean ratio of
strength to load."""
LIFTING_SHARE = 0.4
"""Fraction of g in the lifting field. Below one half A z < 0 holds for
any W."""
EIGENVALUE_RTOL = 1e-4
"""Residual of the lowest eigenvector, as a fraction of the largest W."""
MAX_EIGENVECTOR_ITERATIONS = 200
LIFTING_RTOL = 1e-6
"""The same for the eigenvector by which multipliers of a part are
lifted, to be positive at its border."""


class TooSmallError(Exception):
    """Error: the part that can break is too small to become unstable at its weakening rates."""


def _lifting_part(operator: Operator, can_break: Mask, guess: Array) -> tuple[Array, Array]:
    """Do the same as `_lifting_field` for a part that can break: lowest eigenvector of A.

    On eight nodes with K d = 8 d - D, D the sum of d, the lowest eigenvector on three nodes is
    uniform, with the eigenvalue 8 - 3 - 5.5 Pa/m. On two nodes the eigenvalue is positive:

    >>> operator = make_operator(np.array([0.0, 8, 8, 8, 8]), 5.5, (8,))
    >>> y, lifted = _lifting_part(operator, np.arange(8) < 3, np.arange(1.0, 9.0))
    >>> np.abs(y[:4]).round(4).tolist()
    [0.5774, 0.5774, 0.5774, 0.0]
    >>> (lifted / y[0]).round(4).tolist()
    [0.5, 0.5, 0.5, 3.0, 3.0, 3.0, 3.0, 3.0]
    >>> try:
    ...     _lifting_part(operator, np.arange(8) < 2, np.ones(8))
    ... except TooSmallError:
    ...     print("too small")
    too small
    """
    lifting = np.where(can_break, guess, 0.0)
    tolerance = LIFTING_RTOL * float(operator.weakening_rate.max())
    # The eigenvector z > 0 has A z = lambda z on the part, so A z < 0
    # if lambda < 0.
    most = MAX_EIGENVECTOR_ITERATIONS
    if lowest_eigenvector(operator, can_break, lifting, tolerance, most) >= 0.0:
        raise TooSmallError
    image = np.empty_like(lifting)
    product(operator, lifting, image)
    return lifting, -image


def _lifting_field(operator: Operator) -> tuple[Array, Array]:
    """Return a field z > 0 with A z < 0 at every node, and -A z (Pa/m), to lift multipliers.

    If W > 0 everywhere, z is uniform: K 1 = 0, so -A 1 = W. Otherwise z
    = 1 - 0.4 g. Here (K + w) g is w at nodes with W = 0 and zero at
    other nodes, and w is the smallest positive W. For a Z-matrix, 0 <=
    g < 1. Then -A z is 0.4 w (1 - g) at nodes with W = 0, and at least
    W - 0.4 (w + W) g > 0 at other nodes.

    Node 0 does not weaken. (K + 5.5) g is 5.5 there and the sum of g is 1, so
    g is 6.5/13.5, and 1/13.5 at the other nodes:

    >>> K = np.array([0.0, 8, 8, 8, 8])
    >>> z, lifted = _lifting_field(make_operator(K, np.array([0.0] + [5.5] * 7), (8,)))
    >>> np.round([1 - 0.4 * 6.5 / 13.5, 1 - 0.4 / 13.5] - z[:2], 9).tolist()
    [0.0, 0.0]
    >>> np.round([2.2 * (1 - 6.5 / 13.5), 5.5 - 4.4 / 13.5] - lifted[:2], 9).tolist()
    [0.0, 0.0]
    >>> z, lifted = _lifting_field(make_operator(K, 5.5, (8,)))
    >>> z.tolist() == [1.0] * 8
    True
    >>> lifted.round(9).tolist() == [5.5] * 8
    True
    """
    lifting = np.ones(operator.weakening_rate.shape)
    free = operator.weakening_rate <= 0.0
    if free.any() and not free.all():
        w = float(operator.weakening_rate[~free].min())
        g = np.empty_like(lifting)
        filtered(operator, w / (operator.symbol + w), free.astype(np.float64), g)
        # A step down at the nodes that do not weaken, smoothed so that
        # A z < 0 also there.
        lifting -= LIFTING_SHARE * g
    image = np.empty_like(lifting)
    product(operator, lifting, image)
    return lifting, -image


class Bracket:
    """The programme for a sample on a grid, with the best bounds so far.

    `lower` and `upper` are rigorous bounds of the onset load
    (Pa). The slip (m) proves the lower bound, and the
    multiplier, with <p, y> = 1, proves the upper bound. The
    initial bounds are that no node slips, and that all nodes
    slide at once. K(k), W (Pa/m), strength minus initial stress
    (Pa) and load profile are fields (*shape). At nodes with
    infinite strength, slip and multiplier are zero. `lifting` is
    then a guess of the lowest eigenvector on all other nodes.

    Eight nodes have K d = 8 d - D, with the sum D of d, and W = 5.5 Pa/m. The
    first bounds are the least strength over load profile, and the mean
    strength over the mean load profile:

    >>> K, p = np.array([0.0, 8, 8, 8, 8]), np.ones(8)
    >>> excess = np.array([1.0, 2, 3, 9, 9, 9, 9, 9])
    >>> bracket = Bracket(K, 5.5, excess, p)
    >>> bracket.lower, round(bracket.upper, 6)
    (1.0, 6.375)
    >>> double = Bracket(K, 5.5, excess, np.array([1.0, 4, 1, 1, 1, 1, 1, 1]))
    >>> double.lower, round(double.upper - 51 / 11, 6)
    (0.5, 0.0)

    Slip of 0.4 m at node 0 proves min (1 + 1.5 x 0.4, 2 - 0.4) Pa. A worse slip changes nothing:

    >>> bracket.raise_slip(np.array([0.4, 0, 0, 0, 0, 0, 0, -3.0]))
    >>> bracket.raise_slip(np.zeros(8))
    >>> round(bracket.lower, 6)
    1.6
    >>> bracket.slip[[0, 7]].tolist()
    [0.4, 0.0]

    y = (2, 2, 1) has A y = (0, 0, -2.5) on nodes 0 to 2. Its bound is (2 + 4 +
    3)/5. y = 1 at node 0 has A y = 1.5, so 1.5/5.5 is added everywhere:

    >>> y = np.array([2.0, 2, 1, 0, 0, 0, 0, 0])
    >>> round(bracket.raise_multiplier(y), 6)
    1.8
    >>> round(bracket.upper, 6)
    1.8
    >>> round(bracket.gap, 6)
    0.2
    >>> e, lift = np.eye(8)[0], 3 / 11
    >>> abs(bracket.raise_multiplier(e) - (1 + 51 * lift) / (1 + 8 * lift)) < 1e-9
    True
    >>> round(bracket.upper, 6), bracket.raise_multiplier(-e)
    (1.8, inf)
    >>> bracket.closed(0.11), bracket.closed(0.12)
    (False, True)

    If the onset is close to zero, gaps refer to a hundredth of the strength,
    10.5/4 Pa, over the load profile. Nodes that cannot break do not count:

    >>> excess = np.array([-2.75, -1.75, -0.75, 5.25] + [np.inf] * 4)
    >>> part = Bracket(K, 5.5, excess, np.append(2 * p[:4], p[4:]))
    >>> round(abs(part.upper), 6)
    0.0
    >>> round(part.magnitude, 6)
    0.013125
    >>> round(part.scale, 6)
    0.02625
    >>> part.raise_multiplier(-part.excess) < np.inf
    True
    >>> part.multiplier[4:].tolist()
    [0.0, 0.0, 0.0, 0.0]
    """

    def __init__(
        self,
        symbol: Array,
        weakening_rate: Array | float,
        excess: Array,
        profile: Array,
        lifting: Array | None = None,
    ) -> None:
        self.operator = make_operator(symbol, weakening_rate, excess.shape)
        self.excess, self.profile = excess.flatten(), profile.flatten()
        # The residual and the mask are workspaces of solvers.
        self.residual, self.slip, self.multiplier = np.zeros((3, excess.size))
        self.inside = np.zeros(excess.size, dtype=np.bool_)
        self.lower = float((self.excess / self.profile).min())
        self.upper = np.inf
        self.can_break = np.isfinite(self.excess)
        self._mean_profile = float(self.profile[self.can_break].mean())
        # Where nothing can break y = 0, and inf times 0 must count as 0.
        self.finite_excess = np.where(self.can_break, self.excess, 0.0)
        if self.can_break.all():
            self.lifting = _lifting_field(self.operator)
        else:
            guess = np.ones(excess.size) if lifting is None else lifting
            self.lifting = _lifting_part(self.operator, self.can_break, guess)
        # The first upper bound: all nodes slide at once.
        self.raise_multiplier(self.lifting[0])

    @property
    def gap(self) -> float:
        """Distance between the bounds, Pa."""
        return self.upper - self.lower

    @property
    def magnitude(self) -> float:
        """Load to which relative gaps refer: the onset, unless the onset is close to zero."""
        return max(
            abs(self.upper),
            MIN_MAGNITUDE
            * float(np.abs(self.excess[self.can_break]).mean() / self._mean_profile),
        )

    def closed(self, gap: float) -> bool:
        """Return whether the bounds are within a relative gap."""
        return self.gap <= gap * self.magnitude

    @property
    def scale(self) -> float:
        """Stress to which errors refer, Pa."""
        return self.magnitude * self._mean_profile

    def raise_slip(self, slip: Array) -> None:
        """Accept a slip, cut off at zero, if it proves a higher lower bound."""
        # A d + s - load p >= 0 at every node gives the largest load
        # that this slip proves.
        trial = np.maximum(slip, 0.0)
        product(self.operator, trial, self.residual)
        load = float(((self.residual + self.excess) / self.profile).min())
        if load > self.lower:
            self.lower, self.slip = load, trial

    def raise_multiplier(self, y: Array) -> float:
        """Accept a multiplier if it proves a lower upper bound.

        Return its bound.

        The least multiple of z that makes A y <= 0 is added. If there
        is no such multiple, the bound is infinite.
        """
        trial = np.maximum(y, 0.0)
        product(self.operator, trial, self.residual)
        lifting, lifted = self.lifting
        # Only nodes that can break need A y <= 0. The other nodes never slip.
        infeasible, liftable = (self.residual > 0.0) & self.can_break, lifted > 0.0
        if (infeasible & ~liftable).any():
            return np.inf
        if infeasible.any():
            trial += float((self.residual[infeasible] / lifted[infeasible]).max()) * lifting
        p_y = inner(self.profile, trial)
        if not p_y > 0.0:
            return np.inf
        load = inner(self.finite_excess, trial) / p_y
        if load < self.upper:
            self.upper, self.multiplier = load, trial / p_y
        return load


def bisect(bracket: Bracket, gap: float, accuracy: float) -> Array:
    """Narrow a bracket to a relative gap.

    Return the last unstable direction, with unit norm.

    The accuracy is the largest residual
    stress as a fraction of the mean strength.

    The onset is 1.8 Pa, as in `fold.follow_to_turn`:

    >>> K, excess = np.array([0.0, 8, 8, 8, 8]), np.array([1.0, 2, 3, 9, 9, 9, 9, 9])
    >>> bracket = Bracket(K, 5.5, excess, np.ones(8))
    >>> direction = bisect(bracket, 1e-3, 1e-6)
    >>> 1.797 < bracket.lower < 1.8 + 1e-9
    True
    >>> round(bracket.upper, 6)
    2.0
    >>> round(float((direction**2).sum()), 6)
    1.0
    """
    operator, excess, profile = bracket.operator, bracket.excess, bracket.profile
    direction = bracket.multiplier / np.sqrt((bracket.multiplier**2).sum())
    # The ends of the interval differ from the bounds: `low` was found
    # to be stable only to the accuracy, and `high` to be unstable
    # without a multiplier.
    low, high = bracket.lower, bracket.upper
    stable = bracket.slip.copy()
    for _ in range(MAX_HALVINGS):
        if high - low <= gap * bracket.magnitude:
            break
        # 1.
        load = 0.5 * (low + high)
        slip = stable.copy()
        inside = bracket.inside
        # Nodes whose strength is below the load alone would be
        # overloaded without slip.
        inside[:] = (slip > 0.0) | (excess < load * profile)
        right, tolerance = load * profile - excess, accuracy * bracket.scale
        status = equilibrate(operator, right, inside, slip, tolerance)
        if status == SOLVED:  # 2.
            low, stable = load, slip
            bracket.raise_slip(slip)
            continue
        # 3. Without a direction the iterations were exhausted, as they
        # are close to the onset.
        high = load
        if status != NEGATIVE_CURVATURE:
            continue
        vector = np.abs(operator.direction)
        tolerance = EIGENVALUE_RTOL * float(operator.weakening_rate.max())
        most = MAX_EIGENVECTOR_ITERATIONS
        if lowest_eigenvector(operator, inside, vector, tolerance, most) <= 0.0:
            direction = np.maximum(vector, 0.0)
            high = min(high, bracket.raise_multiplier(vector))
    return direction
