"""Friction laws: strength that falls with slip from tau_p to tau_r.

To add one, derive from `FrictionLaw`, register its kernels in `kernels.py` and add it to `LAWS`; in
Python, an object of any class that derives from `FrictionLaw` serves.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import (
    BeforeValidator,
    Discriminator,
    GetJsonSchemaHandler,
    Tag,
    WrapSerializer,
    WrapValidator,
    model_validator,
)
from pydantic_core import CoreSchema

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.friction.parameters import FUNCTIONS, Exponential, Linear, Polygon
from stiction.model import (
    OptionalProfile,
    Profile,
    Real,
    as_list,
    at_least,
    checked,
    is_unplaced,
    model,
)

SCALES = ("weakening_rate", "critical_slip", "fracture_energy")
"""Any one of them sets how fast a law weakens."""
NEARLY_RESIDUAL = 0.01
"""Share of tau_p - tau_r that is left where a law that never ends counts as at its residual."""


def _known(value: Any) -> Array:
    """The numbers to check now; a profile that is not placed yet is checked once it is."""
    return np.empty(0) if value is None or is_unplaced(value) else np.asarray(value)


@model
class FrictionLaw(ABC):
    """Strength tau_f(d) = tau_r + (tau_p - tau_r) f(d/d_c), f falling from 1 to 0.

    A law is the function f, with its slope at zero slip -f'(0) and its integral. The scale of slip
    follows from one of W, d_c and Gamma.

    Parameters
    ----------
    weakening_rate : float or (nodes,) array, optional
        W = -f'(0) (tau_p - tau_r)/d_c, at zero slip, Pa/m, positive.
    critical_slip : float or (nodes,) array, optional
        d_c, m, positive.
    residual_strength : float or (nodes,) array
        tau_r, Pa, not negative.
    fracture_energy : float or (nodes,) array, optional
        Gamma = (tau_p - tau_r) d_c times the integral of f, J/m², positive.
    residual_ratio : float or (nodes,) array, optional
        tau_r/tau_p in [0, 1), instead of `residual_strength`.

    Raises
    ------
    InputError
        If none or several of W, d_c and Gamma are given, or a value is out of range.
    """

    weakening_rate: OptionalProfile = None
    critical_slip: OptionalProfile = None
    residual_strength: Profile = 0.0
    fracture_energy: OptionalProfile = None
    residual_ratio: OptionalProfile = None

    linear: ClassVar[bool] = False
    """Whether strength falls along one straight line, to the residual strength."""

    @model_validator(mode="after")
    def _one_scale(self) -> Any:
        given = [name for name in SCALES if getattr(self, name) is not None]
        problems = []
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            problems.append(
                f"give one of weakening_rate, critical_slip and fracture_energy, got {found}"
            )
        for name in given:
            value = _known(getattr(self, name))
            if not np.all(value > 0.0):
                problems.append(
                    f"{name} must be positive everywhere, smallest given is {value.min():g}"
                )
        residual, ratio = _known(self.residual_strength), _known(self.residual_ratio)
        if not np.all(residual >= 0.0):
            problems.append(
                f"residual_strength must not be negative, smallest given is {residual.min():g}"
            )
        if not np.all((ratio >= 0.0) & (ratio < 1.0)):
            problems.append(
                "residual_ratio must lie in [0, 1), given are values from"
                f" {ratio.min():g} to {ratio.max():g}"
            )
        both = is_unplaced(self.residual_strength) or np.any(residual != 0.0)
        if self.residual_ratio is not None and both:
            problems.append("give either residual_strength or residual_ratio, got both")
        if problems:
            raise InputError(problems)
        return self

    @property
    @abstractmethod
    def initial_slope(self) -> float:
        """-f'(0)."""

    @property
    def steepest_slope(self) -> float:
        """The largest -f'(u)."""
        return self.initial_slope

    @property
    def steepens(self) -> bool:
        """Whether strength falls more steeply later than at zero slip."""
        return self.steepest_slope > self.initial_slope

    @property
    @abstractmethod
    def integral(self) -> float:
        """Integral of f(u) over all u >= 0."""

    @abstractmethod
    def fraction(self, u: Any) -> Array:
        """Return f(u) at slips u in units of d_c, any shape."""

    @abstractmethod
    def area(self, u: Any) -> Array:
        """Return the integral of f from 0 to slips u in units of d_c, any shape."""

    @abstractmethod
    def slip_at(self, fraction: float) -> float:
        """Return u at which f has fallen to a fraction in [0, 1]; infinite if it never does."""

    @property
    @abstractmethod
    def parameters(self) -> NamedTuple:
        """What compiled kernels are given; see `stiction.friction.kernels`."""

    @property
    def reach(self) -> float:
        """u from which strength counts as residual: 1 % is left of a law that never ends."""
        end = self.slip_at(0.0)
        return end if np.isfinite(end) else self.slip_at(NEARLY_RESIDUAL)

    def residual(self, strength: Array) -> Array:
        """Return tau_r, Pa, of a peak strength (Pa, any shape)."""
        if self.residual_ratio is None:
            return np.asarray(self.residual_strength, dtype=np.float64)
        return np.asarray(self.residual_ratio) * strength

    def rate(self, drop: Array, scale: str, value: Any) -> Array:
        """Return the weakening rate W at zero slip, Pa/m.

        Parameters
        ----------
        drop : array
            tau_p - tau_r, Pa.
        scale : {"weakening_rate", "critical_slip", "fracture_energy"}
        value : array
            In Pa/m, m or J/m².
        """
        value = np.asarray(value, dtype=np.float64)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            if scale == "critical_slip":
                return self.initial_slope * drop / value
            if scale == "fracture_energy":
                return self.initial_slope * self.integral * drop**2 / value
        return np.broadcast_to(value, np.broadcast_shapes(value.shape, drop.shape))

    @property
    def scale(self) -> tuple[str, Any]:
        """Which of W, d_c and Gamma was given, and its value."""
        name = next(name for name in SCALES if getattr(self, name) is not None)
        return name, getattr(self, name)

    def critical_slip_of(self, drop: Array, rate: Array) -> Array:
        """Return d_c, m, from tau_p - tau_r (Pa) and the weakening rate W (Pa/m)."""
        return self.initial_slope * drop / rate

    def dissipated(self, slip: Array, drop: Array, rate: Array) -> Array:
        """Return the energy dissipated above the residual strength up to a slip, J/m².

        Parameters
        ----------
        slip : (..., nodes) array
            m.
        drop, rate : (nodes,) arrays
            tau_p - tau_r (Pa), W (Pa/m).

        Returns
        -------
        (..., nodes) array
            (tau_p - tau_r) d_c times the integral of f.
        """
        if self.linear:
            weakened = np.minimum(slip, drop / rate)
            return weakened * (drop - 0.5 * rate * weakened)
        critical = self.critical_slip_of(drop, rate)
        u = np.divide(slip, critical, out=np.zeros(np.shape(slip)), where=critical > 0.0)
        return drop * critical * self.area(u)

    def fracture_energy_of(self, drop: Array, rate: Array) -> Array:
        """Return Gamma, J/m², from tau_p - tau_r (Pa) and the weakening rate W (Pa/m)."""
        return self.initial_slope * self.integral * drop**2 / rate


@model
class LinearWeakening(FrictionLaw):
    """Strength that falls linearly with slip: max(tau_p - W d, tau_r).

    Parameters
    ----------
    weakening_rate, critical_slip, fracture_energy : float or (nodes,) array, optional
        One of W (Pa/m), d_c (m; then W = (tau_p - tau_r)/d_c varies with the strength) and Gamma
        (J/m²; then W = (tau_p - tau_r)²/(2 Gamma) varies with the strength), positive.
    residual_strength, residual_ratio : float or (nodes,) array, optional
        tau_r (Pa) or tau_r/tau_p in [0, 1).

    Raises
    ------
    InputError
        If none or several of W, d_c and Gamma are given, or a value is out of range.

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

    linear: ClassVar[bool] = True
    initial_slope: ClassVar[float] = 1.0
    integral: ClassVar[float] = 0.5

    def fraction(self, u: Any) -> Array:
        """Return f(u) = max(1 - u, 0)."""
        return np.maximum(1.0 - np.asarray(u, dtype=np.float64), 0.0)

    def area(self, u: Any) -> Array:
        """Return w - w²/2 with w = min(u, 1)."""
        w = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        return w - 0.5 * w * w

    def slip_at(self, fraction: float) -> float:
        """Return u = 1 - f."""
        return 1.0 - fraction

    @property
    def parameters(self) -> Linear:
        """For kernels."""
        return Linear()


@model
class ExponentialWeakening(FrictionLaw):
    """Strength that decays with slip: tau_r + (tau_p - tau_r) exp(-d/d_c).

    Parameters
    ----------
    weakening_rate, critical_slip, fracture_energy : float or (nodes,) array, optional
        One of W at zero slip (Pa/m), d_c (m; slip at which 1/e of tau_p - tau_r is left) and
        Gamma = (tau_p - tau_r) d_c (J/m²), positive.
    residual_strength, residual_ratio : float or (nodes,) array, optional
        tau_r (Pa) or tau_r/tau_p in [0, 1); approached and never reached.

    Raises
    ------
    InputError
        If none or several of W, d_c and Gamma are given, or a value is out of range.

    Examples
    --------
    >>> import stiction as st
    >>> law = st.ExponentialWeakening(critical_slip=1e-6)
    >>> float(law.fraction(1.0).round(4))
    0.3679
    """

    type: Literal["exponential"] = "exponential"

    initial_slope: ClassVar[float] = 1.0
    integral: ClassVar[float] = 1.0

    def fraction(self, u: Any) -> Array:
        """Return f(u) = exp(-u)."""
        return np.exp(-np.asarray(u, dtype=np.float64))

    def area(self, u: Any) -> Array:
        """Return 1 - exp(-u)."""
        return -np.expm1(-np.asarray(u, dtype=np.float64))

    def slip_at(self, fraction: float) -> float:
        """Return u = -ln f."""
        return -math.log(fraction) if fraction > 0.0 else math.inf

    @property
    def parameters(self) -> Exponential:
        """For kernels."""
        return Exponential()


Corners: TypeAlias = Annotated[tuple[Real, ...], BeforeValidator(as_list)]


@model(kw_only=True)
class PiecewiseWeakening(FrictionLaw):
    """Strength that falls along a polygon of slip, such as dual-scale weakening.

    Parameters
    ----------
    slip : sequence of float
        Corners u = d/d_c, rising from above 0 to 1; the corner at zero slip is understood.
    strength : sequence of float
        (tau_f - tau_r)/(tau_p - tau_r) at these corners, falling from below 1 to 0.
    weakening_rate, critical_slip, fracture_energy : float or (nodes,) array, optional
        One of W of the first piece (Pa/m), d_c (m; slip at which the residual strength is
        reached) and Gamma (J/m²), positive.
    residual_strength, residual_ratio : float or (nodes,) array, optional
        tau_r (Pa) or tau_r/tau_p in [0, 1).

    Raises
    ------
    InputError
        If the corners do not make a falling polygon, none or several of W, d_c and Gamma are
        given, or a value is out of range.

    Examples
    --------
    Strength that loses 70 % within a tenth of the critical slip and the rest slowly:

    >>> import stiction as st
    >>> law = st.PiecewiseWeakening(slip=[0.1, 1.0], strength=[0.3, 0.0], critical_slip=1e-5)
    >>> round(law.initial_slope, 9), round(law.integral, 9)
    (7.0, 0.2)
    """

    slip: Corners
    strength: Corners
    type: Literal["piecewise"] = "piecewise"

    @model_validator(mode="after")
    def _falling(self) -> PiecewiseWeakening:
        problems = []
        slip, strength = np.array((0.0, *self.slip)), np.array((1.0, *self.strength))
        if slip.size != strength.size or slip.size < 2:
            problems.append(
                "slip and strength: must have one entry for each corner, got"
                f" {slip.size - 1} and {strength.size - 1}"
            )
        else:
            if not (np.diff(slip) > 0.0).all() or slip[-1] != 1.0:
                problems.append(
                    f"slip: must rise from above 0 to exactly 1 (d = d_c), got {self.slip}"
                )
            if not (np.diff(strength) < 0.0).all() or strength[-1] != 0.0:
                problems.append(
                    "strength: must fall from below 1 to exactly 0 (the residual strength), got"
                    f" {self.strength}"
                )
        if problems:
            raise InputError(problems)
        return self

    @property
    def corners(self) -> tuple[Array, Array]:
        """u and f at all corners, those at zero slip included."""
        return np.array((0.0, *self.slip)), np.array((1.0, *self.strength))

    @property
    def slopes(self) -> Array:
        """-f' of each piece."""
        u, f = self.corners
        return -np.diff(f) / np.diff(u)

    @property
    def linear(self) -> bool:  # type: ignore[override]  # here it depends on the corners
        """Whether it is a single piece: the linear law."""
        return len(self.slip) == 1

    @property
    def initial_slope(self) -> float:
        """-f'(0), that of the first piece."""
        return float(self.slopes[0])

    @property
    def steepest_slope(self) -> float:
        """-f' of the steepest piece."""
        return float(self.slopes.max())

    @property
    def integral(self) -> float:
        """Area under f."""
        u, f = self.corners
        return float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(u)))

    def fraction(self, u: Any) -> Array:
        """Return f(u) by interpolation between the corners."""
        return np.interp(np.asarray(u, dtype=np.float64), *self.corners)

    def area(self, u: Any) -> Array:
        """Return the area under the polygon up to u."""
        corners, f = self.corners
        at_corners = np.append(0.0, np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(corners)))
        u = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        piece = np.clip(np.searchsorted(corners, u, side="right") - 1, 0, len(self.slip) - 1)
        into = u - corners[piece]
        return at_corners[piece] + into * (f[piece] - 0.5 * self.slopes[piece] * into)

    def slip_at(self, fraction: float) -> float:
        """Return u on the polygon."""
        u, f = self.corners
        return float(np.interp(fraction, f[::-1], u[::-1]))

    @classmethod
    def from_law(cls, law: FrictionLaw, pieces: int) -> PiecewiseWeakening:
        """Make a polygon that follows another law.

        Parameters
        ----------
        law : FrictionLaw
            Such as `ExponentialWeakening`.
        pieces : int
            How many straight pieces, at least 2. Corners lie on the law where it has lost equal
            shares of strength; the last piece of a law that never ends is so long that it
            dissipates as much as all the rest of the law.

        Returns
        -------
        PiecewiseWeakening
            With the residual strength of `law`, and its weakening rate, critical slip or fracture
            energy, whichever was given, as the polygon has it: the first piece is a chord, less
            steep than the law at zero slip (by 1/(2 pieces) of an exponential one).

        Raises
        ------
        InputError
            If `law` is not a friction law or contradicts itself, or `pieces` is too small.

        Examples
        --------
        >>> import stiction as st
        >>> law = st.ExponentialWeakening(weakening_rate=0.5e12)
        >>> polygon = st.PiecewiseWeakening.from_law(law, 32)
        >>> round(float(polygon.weakening_rate) / 0.5e12, 3)
        0.984
        """
        pieces = _check_pieces(law, pieces)
        fraction = 1.0 - np.arange(1, pieces + 1) / pieces
        u = np.array([law.slip_at(float(f)) for f in fraction])
        if not np.isfinite(u[-1]):
            rest = law.integral - float(law.area(u[-2]))
            u[-1] = u[-2] + 2.0 * pieces * rest
        fraction[-1] = 0.0
        end = float(u[-1])
        slip = u / end
        slip[-1] = 1.0
        chord = (1.0 - float(fraction[0])) / float(u[0])
        area = float(np.trapezoid(np.append(1.0, fraction), np.append(0.0, u)))
        factors = {
            "weakening_rate": chord / law.initial_slope,
            "critical_slip": end,
            "fracture_energy": area / law.integral,
        }
        scale, value = law.scale
        return cls(
            slip=tuple(map(float, slip)),
            strength=tuple(map(float, fraction)),
            residual_strength=law.residual_strength,
            residual_ratio=law.residual_ratio,
            **{scale: factors[scale] * value},
        )

    @property
    def parameters(self) -> Polygon | Linear:
        """For kernels; a single piece is the linear law to the bit."""
        return Linear() if self.linear else Polygon(*self.corners)


Pieces: TypeAlias = at_least(2)  # type: ignore[valid-type]  # a call makes it


@checked
def _check_pieces(law: FrictionLaw, pieces: Pieces) -> int:
    problems = contradictions(law)
    scale, value = law.scale
    if is_unplaced(value):
        problems.append(
            f"{scale} has points of its own; take the friction of a problem, which puts them on"
            " its nodes"
        )
    if problems:
        raise InputError([f"law: {text}" for text in problems])
    return pieces


LAWS = {
    "linear": LinearWeakening,
    "exponential": ExponentialWeakening,
    "piecewise": PiecewiseWeakening,
}
"""The laws of study files by their `type`."""


def contradictions(law: FrictionLaw) -> list[str]:
    """Return in what a law of somebody else breaks the promises that every method relies on.

    Strength begins at tau_p and never rises with slip; slope, integral and inverse are those of
    `fraction`, and so are the functions registered for kernels.
    """
    if type(law) in LAWS.values():
        return []
    name = type(law).__name__
    u = np.linspace(0.0, law.reach, 4097)
    f = np.asarray(law.fraction(u), dtype=np.float64)
    rising = np.diff(f) > 1e-9
    if abs(f[0] - 1.0) > 1e-9:
        return [f"{name}.fraction(0) must be 1, got {f[0]:g}"]
    if rising.any():
        first = int(np.argmax(rising))
        top = first + int(np.argmax(f[first:]))
        return [
            f"{name}: strength must not rise with slip; fraction rises from {f[first]:.4g} to"
            f" {f[top]:.4g} between u = {u[first]:.4g} and {u[top]:.4g}"
        ]
    step = 1e-6 * law.reach
    pairs = {
        "initial_slope": (law.initial_slope, (1.0 - float(law.fraction(step))) / step),
        "area(reach)": (float(law.area(law.reach)), float(np.trapezoid(f, u))),
        "fraction(slip_at(0.5))": (float(law.fraction(law.slip_at(0.5))), 0.5),
    }
    # In plain Python, so that nothing is compiled. With tau_p = 1, tau_r = 0 and d_c = 1 strength
    # is f and slip is u.
    given = (law.parameters, 1.0, 0.0, law.initial_slope)
    functions = FUNCTIONS.get(type(law.parameters), ())[:2]
    plain = [getattr(function, "py_func", function) for function in functions]
    for at in law.reach * np.array([0.0, 0.1234, 0.5678]) if plain else ():
        here, ahead = float(law.fraction(at)), float(law.fraction(at + step))
        for what, function, own in zip(
            ("strength", "slope"), plain, (here, (here - ahead) / step), strict=True
        ):
            pairs[f"the {what} of its kernels at u = {at:.3g}"] = (function(*given, at), own)
    tolerance = 1e-3 * max(1.0, law.steepest_slope)
    return [
        f"{name}: {what} is {found:.3g}, but {own:.3g} by its fraction"
        for what, (found, own) in pairs.items()
        if abs(found - own) > tolerance
    ]


def _law(value: Any, handler: Any) -> Any:
    if isinstance(value, FrictionLaw):
        return value
    if not isinstance(value, dict):
        raise ValueError("must be a friction law such as st.LinearWeakening(weakening_rate=...)")
    return handler(value)


def _written(value: Any, handler: Any) -> Any:
    if type(value) not in LAWS.values():
        raise ValueError(f"{type(value).__name__}, a friction law of your own")
    return handler(value)


class _Schema:
    """For editors: a table without a type is the linear law."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        linear, *others = handler(core)["oneOf"]
        return {"anyOf": [linear, *({"allOf": [law, {"required": ["type"]}]} for law in others)]}


def _tag(value: Any) -> str:
    return str(value.get("type", "linear") if isinstance(value, dict) else value.type)


Friction: TypeAlias = Annotated[
    Annotated[LinearWeakening, Tag("linear")]
    | Annotated[ExponentialWeakening, Tag("exponential")]
    | Annotated[PiecewiseWeakening, Tag("piecewise")],
    Discriminator(_tag),
    _Schema(),
    WrapValidator(_law),
    WrapSerializer(_written),
]
"""Any friction law; in a study file ``type`` says which, linear if left out."""
