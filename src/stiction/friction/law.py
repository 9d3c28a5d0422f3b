"""What every friction law is: strength that falls with slip from tau_p to tau_r."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
from pydantic import model_validator

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import OptionalProfile, Profile, is_unplaced, model

SCALES = ("weakening_rate", "critical_slip", "fracture_energy")
"""Any one of them sets how fast a law weakens."""


NEARLY_RESIDUAL = 0.01
"""Share of tau_p - tau_r that is left where a law that never ends counts as at its residual."""


def _known(value: Any) -> Array:
    """The numbers to check now; a profile that is not placed yet is checked once it is."""
    return np.empty(0) if is_unplaced(value) else np.asarray(value)


@model
class FrictionLaw:
    """Strength tau_f(d) = tau_r + (tau_p - tau_r) f(d/d_c), f falling from 1 to 0.

    A law is the function f, with its slope at zero slip -f'(0) and its integral; the scale of
    slip comes from one of W = -f'(0) (tau_p - tau_r)/d_c, d_c itself, and the fracture energy
    Gamma = (tau_p - tau_r) d_c times the integral of f.
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
        problems = []
        given = [name for name in SCALES if getattr(self, name) is not None]
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
        residual = _known(self.residual_strength)
        if not np.all(residual >= 0.0):
            problems.append(
                f"residual_strength must not be negative, smallest given is {residual.min():g}"
            )
        if self.residual_ratio is not None:
            ratio = _known(self.residual_ratio)
            if not np.all((ratio >= 0.0) & (ratio < 1.0)):
                problems.append(
                    "residual_ratio must lie in [0, 1), given are values from"
                    f" {ratio.min():g} to {ratio.max():g}"
                )
            if is_unplaced(self.residual_strength) or np.any(residual != 0.0):
                problems.append("give either residual_strength or residual_ratio, got both")
        if problems:
            raise InputError(problems)
        return self

    @property
    def initial_slope(self) -> float:
        """-f'(0)."""
        raise NotImplementedError

    @property
    def steepest_slope(self) -> float:
        """The largest -f'(u)."""
        return self.initial_slope

    @property
    def steepens(self) -> bool:
        """Whether strength falls more steeply later than at zero slip."""
        return self.steepest_slope > self.initial_slope

    @property
    def integral(self) -> float:
        """Integral of f(u) over all u >= 0."""
        raise NotImplementedError

    def fraction(self, u: Any) -> Array:
        """f(u) at slips u in units of d_c, any shape."""
        raise NotImplementedError

    def area(self, u: Any) -> Array:
        """Integral of f from 0 to slips u in units of d_c, any shape."""
        raise NotImplementedError

    def slip_at(self, fraction: float) -> float:
        """u at which f has fallen to a fraction in [0, 1]; infinite if it never does."""
        raise NotImplementedError

    @property
    def parameters(self) -> NamedTuple:
        """What compiled kernels are given; see `stiction.friction.kernels`."""
        raise NotImplementedError

    @property
    def reach(self) -> float:
        """u from which on strength counts as residual: 1 % of the way is left if not none."""
        end = self.slip_at(0.0)
        return end if np.isfinite(end) else self.slip_at(NEARLY_RESIDUAL)

    def residual(self, strength: Array) -> Array:
        """tau_r, Pa, of a peak strength (Pa, any shape)."""
        if self.residual_ratio is None:
            return np.asarray(self.residual_strength, dtype=np.float64)
        return np.asarray(self.residual_ratio) * strength

    def rate(self, drop: Array, scale: str, value: Any) -> Array:
        """Weakening rate W at zero slip, Pa/m.

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
        """d_c, m, from tau_p - tau_r (Pa) and the weakening rate W (Pa/m)."""
        return self.initial_slope * drop / rate

    def dissipated(self, slip: Array, drop: Array, rate: Array) -> Array:
        """Energy dissipated above the residual strength up to a slip, J/m2.

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
        critical = self.critical_slip_of(drop, rate)
        u = np.divide(slip, critical, out=np.zeros(np.shape(slip)), where=critical > 0.0)
        energy: Array = drop * critical * self.area(u)
        return energy

    def fracture_energy_of(self, drop: Array, rate: Array) -> Array:
        """Gamma, J/m², from tau_p - tau_r (Pa) and the weakening rate W (Pa/m)."""
        return self.initial_slope * self.integral * drop**2 / rate
