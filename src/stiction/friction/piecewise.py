"""Piecewise linear slip weakening: any falling polygon."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, model_validator

from stiction._checks import check_count, check_instance
from stiction.arrays import Array
from stiction.errors import InputError
from stiction.friction.kernels import register
from stiction.friction.law import FrictionLaw
from stiction.friction.linear import Linear, dissipated
from stiction.jit import jit
from stiction.model import _number, is_unplaced, model


class Polygon(NamedTuple):
    """Corners of f: slip u in units of d_c, from 0 to 1, and f there, from 1 to 0."""

    slip: Array
    fraction: Array


@jit
def _piece(law: Polygon, u: float) -> int:
    """The piece in which a slip lies; the number of pieces beyond the last corner."""
    piece = 0
    while piece < law.slip.shape[0] - 1 and u >= law.slip[piece + 1]:
        piece += 1
    return piece


@jit
def _steepness(law: Polygon, piece: int) -> float:
    """-f' in a piece."""
    fall = law.fraction[piece] - law.fraction[piece + 1]
    return fall / (law.slip[piece + 1] - law.slip[piece])


@jit
def _strength(law: Polygon, peak: float, residual: float, rate: float, slip: float) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return residual
    u = rate * slip / (drop * _steepness(law, 0))
    piece = _piece(law, u)
    if piece == law.slip.shape[0] - 1:
        return residual
    f = law.fraction[piece] - _steepness(law, piece) * (u - law.slip[piece])
    return residual + drop * f


@jit
def _slope(law: Polygon, peak: float, residual: float, rate: float, slip: float) -> float:
    drop = peak - residual
    if drop <= 0.0:
        return 0.0
    first = _steepness(law, 0)
    piece = _piece(law, rate * slip / (drop * first))
    return rate * _steepness(law, piece) / first if piece < law.slip.shape[0] - 1 else 0.0


register(Polygon, _strength, _slope)


def _numbers(value: Any) -> tuple[float, ...]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        raise ValueError("must be a list of numbers")
    return tuple(_number(entry) for entry in value)


Corners = Annotated[tuple[float, ...], BeforeValidator(_numbers)]


@model(kw_only=True)
class PiecewiseWeakening(FrictionLaw):
    """Strength that falls along a polygon of slip, such as dual-scale weakening.

    Parameters
    ----------
    slip : sequence of float
        Corners u = d/d_c, rising from above 0 to 1; the corner at zero slip is understood.
    strength : sequence of float
        (tau_f - tau_r)/(tau_p - tau_r) at these corners, falling from below 1 to 0.
    weakening_rate : float or (nodes,) array, optional
        W of the first piece, Pa/m, positive. Give one of this, `critical_slip` and
        `fracture_energy`.
    critical_slip : float or (nodes,) array, optional
        d_c, m, positive: the slip at which the residual strength is reached.
    residual_strength : float or (nodes,) array
        tau_r, Pa, not negative.
    fracture_energy : float or (nodes,) array, optional
        Gamma, J/m², positive: the area under the polygon.
    residual_ratio : float or (nodes,) array, optional
        tau_r/tau_p in [0, 1), instead of `residual_strength`.

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
        if len(self.slip) != len(self.strength) or not self.slip:
            problems.append(
                "slip and strength: must have one entry for each corner, got"
                f" {len(self.slip)} and {len(self.strength)}"
            )
        else:
            if not (np.diff((0.0, *self.slip)) > 0.0).all() or self.slip[-1] != 1.0:
                problems.append(
                    f"slip: must rise from above 0 to exactly 1 (d = d_c), got {self.slip}"
                )
            if not (np.diff((1.0, *self.strength)) < 0.0).all() or self.strength[-1] != 0.0:
                problems.append(
                    "strength: must fall from below 1 to exactly 0 (the residual strength),"
                    f" got {self.strength}"
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
        """f(u) by interpolation between the corners."""
        return np.interp(np.asarray(u, dtype=np.float64), *self.corners)

    def area(self, u: Any) -> Array:
        """Area under the polygon up to u."""
        corners, f = self.corners
        at_corners = np.append(0.0, np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(corners)))
        u = np.minimum(np.asarray(u, dtype=np.float64), 1.0)
        piece = np.clip(np.searchsorted(corners, u, side="right") - 1, 0, len(self.slip) - 1)
        into = u - corners[piece]
        area: Array = at_corners[piece] + into * (f[piece] - 0.5 * self.slopes[piece] * into)
        return area

    def slip_at(self, fraction: float) -> float:
        """u on the polygon."""
        u, f = self.corners
        return float(np.interp(fraction, f[::-1], u[::-1]))

    def dissipated(self, slip: Array, drop: Array, rate: Array) -> Array:
        """Energy dissipated above the residual strength, J/m2; see `FrictionLaw.dissipated`."""
        if self.linear:  # the same to the bit
            return dissipated(slip, drop, rate)
        return super().dissipated(slip, drop, rate)

    @classmethod
    def from_law(cls, law: FrictionLaw, pieces: int) -> PiecewiseWeakening:
        """A polygon that goes along another law.

        Parameters
        ----------
        law : FrictionLaw
            Such as `ExponentialWeakening`.
        pieces : int
            How many straight pieces. Corners lie on the law where it has lost equal shares of
            strength; the last piece of a law that never ends is so long that it dissipates as
            much as all the rest of the law.

        Returns
        -------
        PiecewiseWeakening
            With the residual strength of `law`, and its weakening rate, critical slip or fracture
            energy, whichever was given, as the polygon has it: the first piece is a chord, less
            steep than the law at zero slip (by 1/(2 pieces) of an exponential one).

        Raises
        ------
        InputError
            If `law` is no friction law or `pieces` no whole number from 2 on.

        Examples
        --------
        >>> import stiction as st
        >>> law = st.ExponentialWeakening(weakening_rate=0.5e12)
        >>> polygon = st.PiecewiseWeakening.from_law(law, 32)
        >>> round(float(polygon.weakening_rate) / 0.5e12, 3)
        0.984
        """
        check_instance("law", law, FrictionLaw)
        pieces = check_count("pieces", pieces, 2)
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
        if is_unplaced(value):
            raise InputError(
                f"law.{scale}: has points of its own; take the friction of a problem, which puts"
                " them on its nodes"
            )
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
