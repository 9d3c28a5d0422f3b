"""Friction laws: strength that falls with slip from tau_p to tau_r.

To add a law, write a subclass of `FrictionLaw`. Call `register` to
allow it in study files.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property, lru_cache
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.kinds import Kinds, OneOf, register
from stiction.base.model import (
    Count,
    Listed,
    OptionalProfile,
    Profile,
    Real,
    checked,
    is_unplaced,
    model,
)
from stiction.problem.friction.parameters import Exponential, Linear, Parameters, Polygon

SCALES = ("weakening_rate", "critical_slip", "fracture_energy")
"""Names of scales. A single scale sets how fast a law weakens."""
NEARLY_RESIDUAL = 0.01
"""Remaining fraction of tau_p - tau_r at which a law that never ends
counts as residual."""
MIN_STEEPENING = 1.001
"""Ratio of slopes up to which a law of the user counts as falling most
steeply at first."""
MAX_REACH = 1e9
"""Largest slip u at which a law of the user may reach a fraction of its
strength."""
SLIPS = 4097
"""Number of slips up to `FrictionLaw.reach` at which a law of the user
is examined."""
LAWS = Kinds("laws")
"""The laws of study files by their `type`."""
_VALID = {
    **dict.fromkeys(SCALES, (lambda value: value > 0.0, "be positive everywhere")),
    "residual_strength": (lambda value: value >= 0.0, "not be negative"),
    "residual_ratio": (lambda value: (value >= 0.0) & (value < 1.0), "lie in [0, 1)"),
}


@model
class FrictionLaw(Listed):
    """Strength tau_f(d) = tau_r + (tau_p - tau_r) f(d/d_c), in which f falls from 1 to 0.

    A law consists of the function f in its `parameters`. Its integral
    (`area`) and its inverse (`slip_at`) are computed from f, unless the
    law defines them by formulas. A law takes the arguments of
    `LinearWeakening`, with Gamma = (tau_p - tau_r) d_c times the
    integral of f.

    The weakening rate W of the package is the rate at which the
    strength first falls, W = `initial_slope` (tau_p - tau_r)/d_c. This
    is the rate at zero slip, unless the law begins with a plateau.
    """

    family: ClassVar[str] = "laws"
    _shown: ClassVar[tuple[str, ...]] = (
        "area", "fraction", "initial_slope", "integral", "parameters", "slip_at", "steepening",
    )  # fmt: skip
    weakening_rate: OptionalProfile = None  # type: ignore[assignment]  # converted
    critical_slip: OptionalProfile = None  # type: ignore[assignment]
    residual_strength: Profile = 0.0  # type: ignore[assignment]
    fracture_energy: OptionalProfile = None  # type: ignore[assignment]
    residual_ratio: OptionalProfile = None  # type: ignore[assignment]

    @model_validator(mode="after")
    def _one_scale(self) -> Any:
        r"""Refuse values that cannot be, two scales, and two residual strengths.

        >>> def refused(**given):
        ...     try:
        ...         LinearWeakening(**given)
        ...     except InputError as error:
        ...         print(*[text.partition(": ")[2][:81] for text in error.problems], sep="\n")
        >>> refused(residual_ratio=0.0, residual_strength=0.0)
        >>> refused(residual_ratio=[0.5, 1.0], critical_slip=[2.0, 0.0, -3.0])
        critical_slip must be positive everywhere, got -3
        residual_ratio must lie in [0, 1), got 1
        >>> refused(residual_strength=[3.0, -1.0], weakening_rate=1.0, fracture_energy=2.0)
        residual_strength must not be negative, got -1
        give one of weakening_rate, critical_slip, fracture_energy, got weakening_rate an
        >>> refused(residual_ratio=0.0, residual_strength=[0.0, 3.0])
        give either residual_strength or residual_ratio, got both
        """
        problems = []
        values = {name: getattr(self, name) for name in _VALID}
        given = {name: value for name, value in values.items() if value is not None}
        for name, value in given.items():
            valid, words = _VALID[name]
            # A profile is checked once it is placed.
            if not is_unplaced(value) and not valid(np.ravel(value)).all():
                worst = np.ravel(value)[~valid(np.ravel(value))].min()
                problems.append(f"{name} must {words}, got {worst:g}")
        scales = [name for name in SCALES if name in given]
        if len(scales) > 1:
            problems.append(f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}")
        residual = self.residual_strength
        if "residual_ratio" in given and (is_unplaced(residual) or np.any(residual)):
            problems.append("give either residual_strength or residual_ratio, got both")
        if problems:
            raise InputError(problems)
        return self

    @property
    @abstractmethod
    def parameters(self) -> Parameters:
        """The part of the law for kernels: its own type of NamedTuple, with f."""

    def area(self, u: Any) -> Array:
        """Return the integral of f from 0 to u, where u is slip over d_c, with any shape.

        Up to the `reach`, cubic Hermite pieces through f and f' are
        integrated (relative error about 1e-12 for a smooth f). Beyond
        the reach, f is integrated by adaptive quadrature.

        The exponential law has the integral 1 - exp(-u) and the reach 4.6:

        >>> FrictionLaw.area(ExponentialWeakening(), [[0.5, 6.0]]).round(8).tolist()
        [[0.39346934, 0.99752125]]
        >>> (1.0 - np.exp([-0.5, -6.0])).round(8).tolist()
        [0.39346934, 0.99752125]
        """
        from scipy.integrate import quad  # few laws need it

        reach, flat = self.reach, np.ravel(np.asarray(u, dtype=np.float64))
        area = _antiderivative(self)(np.minimum(flat, reach))
        beyond = flat > reach
        area[beyond] += [quad(self.fraction, reach, end)[0] for end in flat[beyond]]
        return np.asarray(area.reshape(np.shape(u)))

    def slip_at(self, fraction: float) -> float:
        """Return the first slip u, over d_c, at which f has fallen to a fraction in [0, 1].

        The result is `math.inf` if f stays above the fraction. The slip
        is found by bisection.

        >>> from types import SimpleNamespace
        >>> law = SimpleNamespace(fraction=lambda u: 0.3 + 0.7 / (1.0 + u))
        >>> [round(FrictionLaw.slip_at(law, fraction), 9) for fraction in (0.8, 0.44, 0.3)]
        [0.4, 4.0, inf]
        """
        above, below = 0.0, 1.0
        while self.fraction(below) > fraction:
            above, below = below, 2.0 * below
            if below > MAX_REACH:
                return math.inf
        while (middle := 0.5 * (above + below)) not in (above, below):
            higher = self.fraction(middle) > fraction
            above, below = (middle, below) if higher else (above, middle)
        return below

    def fraction(self, u: Any) -> Array:
        """Return f(u), where u is slip over d_c, with any shape.

        >>> LinearWeakening().fraction([[0.0, 0.25, 1.5]]).tolist()
        [[1.0, 0.75, 0.0]]
        """
        f = self.parameters.f
        return np.vectorize(lambda slip: f(slip)[0], otypes=[float])(u)

    @property
    def initial_slope(self) -> float:
        """-f' where f first falls: at zero slip, or after a plateau.

        >>> PiecewiseWeakening(slip=[0.25, 1.0], strength=[0.5, 0.0]).initial_slope
        2.0
        """
        return float(self.parameters.initial_slope)

    @cached_property
    def steepening(self) -> float:
        """Steepest slope over the initial slope, at least 1.

        This ratio controls stability.
        """
        if isinstance(self.parameters, Linear | Exponential):
            return 1.0
        # The examined slopes of a law of the user have some error.
        ratio = float(_examined(self)[2].max()) / self.initial_slope
        return ratio if ratio > MIN_STEEPENING else 1.0

    @property
    def plateau(self) -> float:
        """Slip u up to which the strength does not fall, 0 for most laws.

        >>> LinearWeakening().plateau
        0.0
        """
        return 0.0

    @property
    def integral(self) -> float:
        """Integral of f(u) over all u >= 0.

        >>> LinearWeakening().integral, ExponentialWeakening().integral
        (0.5, 1.0)
        """
        return float(self.area(np.inf))

    @property
    def linear(self) -> bool:
        """Whether strength falls along a straight line to the residual strength.

        >>> LinearWeakening().linear, ExponentialWeakening().linear
        (True, False)
        """
        return isinstance(self.parameters, Linear)

    @property
    def reach(self) -> float:
        """Slip u at which f reaches 0, or else 1 %, and the strength counts as residual.

        >>> round(ExponentialWeakening().reach, 6), LinearWeakening().reach  # ln 100 and 1
        (4.60517, 1.0)
        """
        end = self.slip_at(0.0)
        return end if np.isfinite(end) else self.slip_at(NEARLY_RESIDUAL)

    @cached_property
    def scale(self) -> tuple[str, Any] | None:
        """Name and value of the given scale (W, d_c or Gamma), or None if it is in the profiles."""
        given = ((name, getattr(self, name)) for name in SCALES)
        return next((pair for pair in given if pair[1] is not None), None)

    def residual(self, strength: Array) -> Array:
        """Return tau_r, Pa, for a peak strength (Pa, with any shape).

        >>> strength = np.array([4.0, 6.0])
        >>> LinearWeakening(residual_ratio=0.25).residual(strength).tolist()
        [1.0, 1.5]
        >>> float(LinearWeakening(residual_strength=3.0).residual(strength))
        3.0
        """
        if self.residual_ratio is None:
            return np.asarray(self.residual_strength, dtype=np.float64)
        return np.asarray(self.residual_ratio) * strength

    def weakening_rate_of(self, drop: Array, scale: str, value: Any) -> Array:
        """Return the weakening rate W at zero slip, Pa/m.

        `drop` is tau_p - tau_r, Pa. `value` is the value of a scale, in
        Pa/m, m or J/m².

        A law that falls at first with the slope 7, and has the integral 0.2:

        >>> law = PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.3, 0.0])
        >>> drop = np.array([4.0, 6.0])
        >>> for scale, value in (("critical_slip", [2.0, 3.0]), ("fracture_energy", 0.7)):
        ...     print(law.weakening_rate_of(drop, scale, value).round(9).tolist())
        [14.0, 14.0]
        [32.0, 72.0]
        >>> law.weakening_rate_of(drop, "weakening_rate", 5.0).tolist()
        [5.0, 5.0]
        """
        value = np.asarray(value, dtype=np.float64)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            if scale == "critical_slip":
                return self.initial_slope * drop / value
            if scale == "fracture_energy":
                return self.initial_slope * self.integral * drop**2 / value
        return np.broadcast_to(value, np.broadcast_shapes(value.shape, drop.shape))

    @property
    def uniform_weakening_rate(self) -> float | None:
        """The weakening rate, Pa/m, if it is given and the same at all nodes.

        >>> rates = None, 3.0, [3.0, 3.0], [3.0, 5.0]
        >>> [LinearWeakening(weakening_rate=W).uniform_weakening_rate or "-" for W in rates]
        ['-', 3.0, 3.0, '-']
        """
        W = self.weakening_rate
        return None if W is None or np.ptp(W) > 0.0 else float(np.max(W))

    def critical_slip_of(self, drop: Array, weakening_rate: Array) -> Array:
        """Return d_c, m, from tau_p - tau_r (Pa) and the weakening rate W (Pa/m).

        A law that falls at first with the slope 7:

        >>> law = PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.3, 0.0])
        >>> round(float(law.critical_slip_of(np.array(4.0), np.array(14.0))), 9)
        2.0
        """
        return self.initial_slope * drop / weakening_rate

    def dissipated(self, slip: Array, drop: Array, weakening_rate: Array) -> Array:
        """Return the energy that slip up to `slip` dissipates above the residual strength, J/m².

        `slip` (m) has shape (..., nodes). `drop` = tau_p - tau_r (Pa)
        and `weakening_rate` = W (Pa/m) have shape (nodes,).

        The critical slip is 4 Pa / (2 Pa/m) = 2 m. The second node does not
        weaken:

        >>> slips, drop = np.array([[1.0, 1.0], [9.0, 9.0]]), np.array([4.0, 0.0])
        >>> LinearWeakening().dissipated(slips, drop, np.array([2.0, 2.0])).tolist()
        [[3.0, 0.0], [4.0, 0.0]]
        >>> ExponentialWeakening().dissipated(slips, drop, np.array([2.0, 2.0])).round(6).tolist()
        [[3.147755, 0.0], [7.911128, 0.0]]
        >>> [round(8.0 * (1.0 - math.exp(-u)), 6) for u in (0.5, 4.5)]
        [3.147755, 7.911128]
        """
        if self.linear:
            # Slip beyond d_c dissipates no more.
            weakened = np.minimum(slip, drop / weakening_rate)
            return weakened * (drop - 0.5 * weakening_rate * weakened)
        critical = self.critical_slip_of(drop, weakening_rate)
        u = np.divide(slip, critical, out=np.zeros(np.shape(slip)), where=critical > 0.0)
        return drop * critical * self.area(u)


@register
@model
class LinearWeakening(FrictionLaw):
    """Strength that falls linearly with slip: max(tau_p - W d, tau_r).

    Parameters
    ----------
    weakening_rate, critical_slip, fracture_energy : float or (nodes,) array, optional
        W (Pa/m), d_c (m) or Gamma (J/m²), positive. With d_c, W =
        (tau_p - tau_r)/d_c varies with the strength. With Gamma, W =
        (tau_p - tau_r)²/(2 Gamma) also varies. Leave all three out if
        the scale is a profile or random (`RandomInterface`).
    residual_strength, residual_ratio : float or (nodes,) array, optional
        tau_r (Pa) or tau_r/tau_p in [0, 1).

    Notes
    -----
    Linear slip weakening after Ida (1972) and Palmer and Rice (1973).

    Examples
    --------
    >>> import stiction as st
    >>> st.LinearWeakening(critical_slip=2e-6, residual_strength=0.4e6).scale
    ('critical_slip', 2e-06)
    """

    type: Literal["linear"] = "linear"
    parameters: ClassVar[Linear] = Linear()

    def area(self, u: Any) -> Array:
        """Return w - w²/2 with w = min(u, 1).

        >>> LinearWeakening().area([0.5, 1.0, 3.0]).tolist()
        [0.375, 0.5, 0.5]
        """
        w = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        return w - 0.5 * w * w

    def slip_at(self, fraction: float) -> float:
        """Return u = 1 - f.

        >>> LinearWeakening().slip_at(0.25)
        0.75
        """
        return 1.0 - fraction


@register
@model
class ExponentialWeakening(FrictionLaw):
    """Strength that decays with slip: tau_r + (tau_p - tau_r) exp(-d/d_c).

    The law has the same parameters as `LinearWeakening`. W is the rate
    at zero slip. At the slip d_c, 1/e of tau_p - tau_r remains. Gamma
    is (tau_p - tau_r) d_c.

    Examples
    --------
    >>> import stiction as st
    >>> law = st.ExponentialWeakening(critical_slip=1e-6)
    >>> float(law.fraction(1.0).round(4))
    0.3679
    """

    type: Literal["exponential"] = "exponential"
    parameters: ClassVar[Exponential] = Exponential()

    def area(self, u: Any) -> Array:
        """Return 1 - exp(-u).

        >>> float(ExponentialWeakening().area(math.log(4.0)).round(9))
        0.75
        """
        return -np.expm1(-np.asarray(u, dtype=np.float64))

    def slip_at(self, fraction: float) -> float:
        """Return u = -ln f.

        >>> law = ExponentialWeakening()
        >>> round(law.slip_at(0.25) / math.log(2.0), 9), law.slip_at(0.0)
        (2.0, inf)
        """
        return -math.log(fraction) if fraction > 0.0 else math.inf


def _listed(value: Any) -> Any:
    """Return an array as a list, and another value as given.

    >>> _listed(np.array([3.0, 4.5])), _listed((3.0, 4.5)), _listed(np.array(3.0))
    ([3.0, 4.5], (3.0, 4.5), array(3.))
    """
    return value.tolist() if isinstance(value, np.ndarray) and value.ndim else value


Corners: TypeAlias = Annotated[tuple[Real, ...], BeforeValidator(_listed)]
Pieces: TypeAlias = Annotated[Count, Field(ge=2)]


@register
@model(kw_only=True)
class PiecewiseWeakening(FrictionLaw):
    """Strength that falls piecewise linearly with slip, such as dual-scale weakening.

    Parameters
    ----------
    slip : sequence of float
        Corners u = d/d_c, rising from above 0 to 1. The corner at zero
        slip is implied.
    strength : sequence of float
        (tau_f - tau_r)/(tau_p - tau_r) at these corners, falling to 0.
        The first number may be 1: the strength then begins with a
        plateau.
    weakening_rate, critical_slip, fracture_energy, residual_strength, residual_ratio : optional
        As for `LinearWeakening`. W is the rate of the first piece that falls. The
        strength is residual if the slip exceeds d_c.

    Examples
    --------
    A strength that loses 70 % within a tenth of the critical slip, and then falls
    slowly:

    >>> import stiction as st
    >>> law = st.PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.3, 0.0], critical_slip=1e-5)
    >>> round(law.initial_slope, 9), round(law.integral, 9)
    (7.0, 0.2)
    """

    slip: Corners
    strength: Corners
    type: Literal["piecewise"] = "piecewise"
    _shown = "fraction", "from_law", "initial_slope", "integral"

    @model_validator(mode="after")
    def _falling(self) -> PiecewiseWeakening:
        """Refuse corners that do not fall from 1 to 0 while the slip rises to 1.

        >>> def refused(slip, strength):
        ...     try:
        ...         PiecewiseWeakening(slip=slip, strength=strength)
        ...     except InputError as error:
        ...         return str(error).partition(": ")[2][:33]
        >>> refused([1.0], [0.0]) or refused([0.5, 1.0], [1.0, 0.0])
        >>> refused([0.5, 1.0], [0.0]), refused([], [])
        ('slip and strength: must have equa', 'slip and strength: must have equa')
        >>> refused([0.0, 1.0], [0.5, 0.0]), refused([0.5, 0.9], [0.5, 0.0])
        ('slip: must increase from above 0 ', 'slip: must increase from above 0 ')
        >>> [refused([0.25, 0.5, 1.0], f) for f in ([1.0, 1.0, 0.0], [0.5, 0.5, 0.0])]
        ['strength: must decrease at every ', 'strength: must decrease at every ']
        >>> refused([0.5, 1.0], [1.1, 0.0]), refused([0.5, 1.0], [0.5, 0.1])
        ('strength: must decrease at every ', 'strength: must decrease at every ')
        """
        slip, strength = self.corners
        if slip.size != strength.size or slip.size < 2:
            given = f"{slip.size - 1} and {strength.size - 1}"
            raise InputError(f"slip and strength: must have equal lengths, got {given}")
        if np.any(np.diff(slip) <= 0.0) or slip[-1] != 1.0:
            raise InputError(f"slip: must increase from above 0 to exactly 1, got {self.slip}")
        falls = -np.diff(strength)
        if np.any(falls[1:] <= 0.0) or falls[0] < 0.0 or strength[-1] != 0.0:
            raise InputError(
                "strength: must decrease at every corner and end at exactly 0. Only the first value"
                f" may be 1, got {self.strength}. Start the law at the top of a hump"
            )
        return self

    @property
    def corners(self) -> tuple[Array, Array]:
        """u and f at all corners, including the corner at zero slip.

        >>> law = PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.9, 0.0])
        >>> [numbers.tolist() for numbers in law.corners]
        [[0.0, 0.5, 1.0], [1.0, 0.9, 0.0]]
        """
        return np.array((0.0, *self.slip)), np.array((1.0, *self.strength))

    @property
    def _pieces(self) -> tuple[Array, Array]:
        # Slopes and areas of the pieces.
        """Slopes and areas of the pieces.

        >>> law = PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.9, 0.0])
        >>> [numbers.round(9).tolist() for numbers in law._pieces], round(law.steepening, 9)
        ([[0.2, 1.8], [0.475, 0.225]], 9.0)
        """
        u, f = self.corners
        return -np.diff(f) / np.diff(u), 0.5 * (f[1:] + f[:-1]) * np.diff(u)

    @property
    def plateau(self) -> float:
        """The slip u up to which the strength does not fall.

        >>> [PiecewiseWeakening(slip=[0.2, 1.0], strength=[f, 0.0]).plateau for f in (1.0, 0.9)]
        [0.2, 0.0]
        """
        return self.slip[0] if self.strength[0] == 1.0 else 0.0

    @cached_property
    def steepening(self) -> float:
        """Slope of the steepest piece over the slope of the first that falls."""
        return float(self._pieces[0].max()) / self.initial_slope

    @property
    def integral(self) -> float:
        """Area under f.

        >>> round(PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.9, 0.0]).integral, 9)
        0.7
        """
        return float(np.sum(self._pieces[1]))

    def area(self, u: Any) -> Array:
        """Return the area under f up to u.

        >>> law = PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.9, 0.0])
        >>> law.area([0.0, 0.25, 0.5, 0.75, 2.0]).round(9).tolist()
        [0.0, 0.24375, 0.475, 0.64375, 0.7]
        """
        (corners, f), (slopes, areas) = self.corners, self._pieces
        # The area up to the corner before u, and a trapezium from this
        # corner to u.
        at_corners = np.append(0.0, np.cumsum(areas))
        u = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        piece = np.clip(np.searchsorted(corners, u, side="right") - 1, 0, len(self.slip) - 1)
        into = u - corners[piece]
        return at_corners[piece] + into * (f[piece] - 0.5 * slopes[piece] * into)

    def slip_at(self, fraction: float) -> float:
        """Return the slip u at which f has the given value.

        >>> law = PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.9, 0.0])
        >>> [round(law.slip_at(fraction), 9) for fraction in (1.0, 0.95, 0.45, 0.0)]
        [0.0, 0.25, 0.75, 1.0]
        """
        # `interp` needs rising numbers, and f falls.
        u, f = self.corners
        return float(np.interp(fraction, f[::-1], u[::-1]))

    @property
    def parameters(self) -> Polygon | Linear:
        """Parameters for the kernels. A single piece gives the linear law, to the bit.

        >>> PiecewiseWeakening(slip=[1.0], strength=[0.0]).parameters
        Linear(initial_slope=1.0)
        >>> law = PiecewiseWeakening(slip=[0.2, 0.6, 1.0], strength=[1.0, 0.1, 0.0])
        >>> round(law.parameters.initial_slope, 9)
        2.25
        """
        if len(self.slip) == 1:
            return Linear()
        slopes = self._pieces[0]
        return Polygon(*self.corners, float(slopes[slopes > 0.0][0]))

    @classmethod
    @checked
    def from_law(cls, law: FrictionLaw, pieces: Pieces) -> PiecewiseWeakening:
        """Approximate a law by linear pieces. `pieces` is their number, at least 2.

        The corners lie on the curve of the law, at equal strength steps. If the
        law never reaches its residual strength, the last piece dissipates the
        same energy as the remaining part of the law.

        Examples
        --------
        >>> import stiction as st
        >>> law = st.ExponentialWeakening(weakening_rate=0.5e12)
        >>> pieces = st.PiecewiseWeakening.from_law(law, 32)
        >>> round(float(pieces.weakening_rate) / 0.5e12, 3)
        0.984

        Two pieces of the exponential law end at u = ln 2 and ln 2 + 2. The
        second is a triangle with the area 1/2:

        >>> for scale in SCALES:
        ...     law = st.ExponentialWeakening(**{scale: 3.0})
        ...     pieces = st.PiecewiseWeakening.from_law(law, 2)
        ...     print(f"{pieces.scale[1]:.6f} {pieces.slip[0]:.6f}", pieces.strength)
        2.164043 0.257374 (0.5, 0.0)
        8.079442 0.257374 (0.5, 0.0)
        3.059581 0.257374 (0.5, 0.0)
        >>> law = st.LinearWeakening(fracture_energy=3.0)
        >>> float(st.PiecewiseWeakening.from_law(law, 2).fracture_energy)
        3.0
        """
        if problems := contradictions(law):
            raise InputError([f"law: {text}" for text in problems])
        fraction = 1.0 - np.arange(1, pieces + 1) / pieces
        fraction[-1] = 0.0
        u = np.array([law.slip_at(float(f)) for f in fraction])
        if not np.isfinite(u[-1]):
            # The last piece is a triangle with the energy of the tail.
            u[-1] = u[-2] + 2.0 * pieces * (law.integral - float(law.area(u[-2])))
        # A scale of the law becomes the same scale of its pieces.
        chord = (1.0 - float(fraction[0])) / float(u[0])
        area = float(np.trapezoid(np.append(1.0, fraction), np.append(0.0, u)))
        factors = {
            "weakening_rate": chord / law.initial_slope,
            "critical_slip": float(u[-1]),
            "fracture_energy": area / law.integral,
        }
        scales = [law.scale] if law.scale is not None else []
        return cls(
            slip=tuple((u / u[-1]).tolist()),
            strength=tuple(fraction.tolist()),
            residual_strength=law.residual_strength,
            residual_ratio=law.residual_ratio,
            **{scale: factors[scale] * value for scale, value in scales},
        )


@lru_cache(maxsize=64)
def _examined(law: FrictionLaw) -> tuple[Array, Array, Array]:
    """Return slips u up to the reach of a law, with the compiled f and -f' at these slips.

    >>> u, f, slopes = _examined(LinearWeakening())
    >>> u.size, [float(numbers[1024]) for numbers in (u, f, slopes)]
    (4097, [0.25, 0.75, 1.0])
    """
    from stiction.problem.friction.kernels import compiled  # imports numba

    parameters = law.parameters
    f, u = compiled(type(parameters)), np.linspace(0.0, law.reach, SLIPS)
    values, slopes = np.array([f(parameters, slip) for slip in u], dtype=float).T
    return u, values, slopes


@lru_cache(maxsize=64)
def _antiderivative(law: FrictionLaw) -> Any:
    """Return the integral of cubic Hermite pieces through f and f', up to the reach of a law.

    >>> round(float(_antiderivative(LinearWeakening())(0.25)), 9)  # 1/4 - 1/32
    0.21875
    """
    from scipy.interpolate import CubicHermiteSpline

    slips, f, slopes = _examined(law)
    return CubicHermiteSpline(slips, f, -slopes).antiderivative()


def contradictions(law: FrictionLaw) -> list[str]:
    """Return messages about mistakes in a user's law, such as an f that rises.

    >>> class Law:
    ...     __module__ = "users.laws"
    ...     parameters, reach, integral, initial_slope = Linear(), 1.0, 0.5, 1.0
    >>> mistakes = [("integral", 0.0), ("integral", np.inf), ("initial_slope", 1.01)]
    >>> mistakes += [("initial_slope", 0.0), ("reach", 0.0), ("reach", np.inf)]
    >>> mistakes += [("parameters", ())]
    >>> for name, value in mistakes + [("reach", 0.5), ("initial_slope", 1.0005)]:
    ...     law = Law()
    ...     setattr(law, name, value)
    ...     print([text[:43] for text in contradictions(law)])
    ['Law: the integral of f, area(inf), must be ']
    ['Law: the integral of f, area(inf), must be ']
    ["Law: initial_slope is 1.01, but -f'(0) is 1"]
    ["Law: f must fall from zero slip on, got -f'"]
    ['Law: slip_at(0), or slip_at(0.01) if that i']
    ['Law: slip_at(0), or slip_at(0.01) if that i']
    ['Law: parameters must be a NamedTuple with i']
    []
    []
    """
    if type(law).__module__.startswith("stiction."):
        return []
    # Check first what the later checks need: parameters, and f that
    # compiles.
    name, parameters = type(law).__name__, law.parameters
    if not all(hasattr(parameters, name) for name in ("_fields", "f", "initial_slope")):
        return [f"{name}: parameters must be a NamedTuple with initial_slope and f(self, u)"]
    if not 0.0 < law.reach < np.inf:
        return [
            f"{name}: slip_at(0), or slip_at({NEARLY_RESIDUAL}) if that is infinite, must be"
            f" positive and finite, got {law.reach:g}. Let f fall with slip, from 1 towards 0"
        ]
    try:
        u, f, slope = _examined(law)
    except Exception as error:  # of any kind: the code is another's
        lines = [line for line in str(error).splitlines() if line.strip()]
        reason = next((line for line in lines if "pipeline" not in line), type(error).__name__)
        return [f"{name}: f must return f and -f', but numba cannot compile it: {reason}"]
    # The first violation is reported: the later checks may follow from
    # it. f states its slope too, which kernels need.
    rising = u[:-1][np.diff(f) > 1e-9]
    fall, near = float(np.trapezoid(slope, u)), 1e-3 * max(1.0, slope.max())
    wrong = {
        f"f and -f' must be finite up to u = {u[-1]:.4g}": not np.isfinite([f, slope]).all(),
        f"f(0) must be 1, got {f[0]:g}": not abs(f[0] - 1.0) <= 1e-9,
        f"f must fall from zero slip on, got -f'(0) = {slope[0]:g}, the weakening rate":
            not min(slope[0], law.initial_slope) > 0.0,
        f"strength must not rise with slip, but rises at u = {rising.min(initial=u[-1]):.4g}. Begin"
        " at the top of the hump, with tau_p there": rising.size,
        f"the integral of f, area(inf), must be finite, got {law.integral:g}. Let f end at 0":
            not 0.0 < law.integral < np.inf,
        f"initial_slope is {law.initial_slope:.3g}, but -f'(0) is {slope[0]:.3g}":
            not abs(law.initial_slope - slope[0]) <= near,
        f"the integral of -f' is {fall:.3g}, but f falls by {1.0 - f[-1]:.3g}":
            not abs(fall - 1.0 + f[-1]) <= near,
    }  # fmt: skip
    return [f"{name}: {text}" for text, is_so in wrong.items() if is_so][:1]


def _law(value: Any) -> Any:
    if not isinstance(value, FrictionLaw | dict):
        raise ValueError("must be a friction law such as st.LinearWeakening(critical_slip=...)")
    return NotImplemented if isinstance(value, dict) else value


Friction: TypeAlias = Annotated[FrictionLaw, OneOf(LAWS, _law, default="linear"), "FrictionLaw"]
"""Any friction law. In a study file ``type`` selects it (default: linear)."""
