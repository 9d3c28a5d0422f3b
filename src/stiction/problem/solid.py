"""The elastic half-spaces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import ArgsKwargs

from stiction.base.errors import InputError
from stiction.base.model import Listed, Mode, Positive, Real, check, is_finite, model
from stiction.base.units import Doubt, doubt_units

POSSIBLE_SPEED = (0.3, 2e4)
"""Shear wave speed, m/s: 1 m/s in the softest gels, and 12 km/s in diamond."""
SOFT_DENSITY, SLOWEST_STIFF = 2000.0, 50.0
"""Density of gels and filled rubbers, kg/m3, above which solids are
stiff, and their least shear wave speed, m/s. Lead has 700 m/s, and
moduli in MPa make 3 m/s of rock."""


@model
class Solid(Listed):
    """The material of two identical linear-elastic half-spaces.

    Parameters
    ----------
    shear_modulus : float
        G, Pa. Alternatively, pass `youngs_modulus`, E in Pa. Then G =
        E/(2 (1 + nu)) is stored.
    poisson_ratio : float
        nu, in (-1, 0.5).
    density : float
        rho, kg/m3.
    plane : {"strain", "stress"}
        Plane state of the in-plane problem (mode II). Mode III does not
        depend on it.

    Examples
    --------
    >>> import stiction as st
    >>> st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0).shear_wave_speed
    1000.0
    """

    shear_modulus: Positive
    poisson_ratio: Annotated[Real, Field(gt=-1, lt=0.5)]
    density: Positive
    plane: Literal["strain", "stress"] = "strain"
    instead_of_fields: ClassVar = ("youngs_modulus",)

    if TYPE_CHECKING:  # with what the validator below takes besides

        def __init__(
            self, shear_modulus: float = ..., poisson_ratio: float = ..., density: float = ...,
            plane: Literal["strain", "stress"] = ..., *, youngs_modulus: float = ...,
        ) -> None: ...  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _shear_modulus(cls, given: Any) -> Any:
        """Replace `youngs_modulus` by G = E/(2 (1 + nu)).

        >>> Solid(youngs_modulus=3e9, poisson_ratio=0.25, density=1200.0).shear_modulus
        1200000000.0
        """
        named = dict(given.kwargs or {}) if isinstance(given, ArgsKwargs) else given
        if not isinstance(named, dict) or "youngs_modulus" not in named:
            return given
        if "shear_modulus" in named or (isinstance(given, ArgsKwargs) and given.args):
            raise InputError("give either shear_modulus or youngs_modulus, by name")
        ratio: Any = named.get("poisson_ratio")
        named = dict(named)
        modulus = check("youngs_modulus", named.pop("youngs_modulus"), Positive)
        # Without a usable ratio any modulus will do: the ratio is what
        # is complained of.
        usable = is_finite(ratio) and ratio > -1.0
        named["shear_modulus"] = modulus / (2.0 * (1.0 + (ratio if usable else 0.0)))
        return ArgsKwargs((), named) if isinstance(given, ArgsKwargs) else named

    @model_validator(mode="after")
    def _plausible(self) -> Solid:
        """Doubt a shear wave speed that no solid has.

        A stiff solid, above 2000 kg/m3, has a speed of at least 50 m/s:

        >>> import warnings
        >>> with warnings.catch_warnings(record=True) as told:
        ...     warnings.simplefilter("always")
        ...     for modulus, density in ((4.9e6, 2000.0), (4.9e6, 2001.0), (5.1e6, 2001.0)):
        ...         _ = Solid(modulus, 0.25, density)
        >>> [str(warning.message)[:71] for warning in told]
        ['solid: the shear wave speed is 49.49 m/s, which no solid has at such a ']
        """
        speed = self.shear_wave_speed
        dense, (slowest, fastest) = self.density > SOFT_DENSITY, POSSIBLE_SPEED
        text = (
            f"solid: the shear wave speed is {speed:.4g} m/s, which no solid has"
            f"{' at such a density' * dense}. Check the units of shear_modulus ="
            f" {self.shear_modulus:g} Pa and density = {self.density:g} kg/m3"
        )
        usual = (SLOWEST_STIFF if dense else slowest), fastest
        doubt_units([Doubt(text, speed, usual)])
        return self

    @property
    def youngs_modulus(self) -> float:
        """E = 2 (1 + nu) G, Pa.

        >>> Solid(shear_modulus=1.2e9, poisson_ratio=0.25, density=1200.0).youngs_modulus
        3000000000.0
        """
        return 2.0 * (1.0 + self.poisson_ratio) * self.shear_modulus

    @property
    def shear_wave_speed(self) -> float:
        """c_s = sqrt(G/rho), m/s."""
        return math.sqrt(self.shear_modulus / self.density)

    @property
    def wave_speed_ratio(self) -> float:
        """c_d/c_s: sqrt(2 (1-nu)/(1-2 nu)) in plane strain, sqrt(2/(1-nu)) in plane stress.

        >>> solids = [Solid(1e9, 0.2, 1e3, plane) for plane in ("strain", "stress")]
        >>> [round(solid.wave_speed_ratio**2, 9) for solid in solids]  # 1.6/0.6 and 2/0.8
        [2.666666667, 2.5]
        """
        nu = self.poisson_ratio
        if self.plane == "strain":
            return math.sqrt(2.0 * (1.0 - nu) / (1.0 - 2.0 * nu))
        return math.sqrt(2.0 / (1.0 - nu))

    @property
    def dilatational_wave_speed(self) -> float:
        """c_d of the plane state, m/s.

        >>> speed = Solid(4e9, 0.2, 1e3, "stress").dilatational_wave_speed
        >>> round(speed**2 / 1e6, 6)  # 2.5 G/rho
        10.0
        """
        return self.wave_speed_ratio * self.shear_wave_speed

    @property
    def rayleigh_wave_speed(self) -> float:
        """c_R, m/s, from Rayleigh's cubic in q = (c_R/c_s)^2.

        The cubic is q^3 - 8 q^2 + (24 - 16/eta^2) q - 16 (1 - 1/eta^2)
        = 0 with eta = c_d/c_s. It follows from (2-q)^2 = 4 sqrt(1-q)
        sqrt(1-q/eta^2), squared and divided by q (Rayleigh, 1885).

        With a Poisson ratio of 1/4, the speed is sqrt(2 - 2/sqrt(3)) c_s:

        >>> exact = math.sqrt(2.0 - 2.0 / math.sqrt(3.0))
        >>> round(Solid(4e9, 0.25, 1e3).rayleigh_wave_speed / 2e3 - exact, 9), round(exact, 4)
        (0.0, 0.9194)
        """
        slowness = self.wave_speed_ratio**-2
        roots = np.roots([1.0, -8.0, 24.0 - 16.0 * slowness, -16.0 * (1.0 - slowness)])
        real = roots.real[np.abs(roots.imag) < 1e-9]
        return math.sqrt(float(real.min())) * self.shear_wave_speed

    @property
    def kolosov(self) -> float:
        """Kolosov's constant: 3 - 4 nu in plane strain, (3 - nu)/(1 + nu) in plane stress.

        >>> [round(Solid(1e9, 0.2, 1e3, plane).kolosov, 9) for plane in ("strain", "stress")]
        [2.2, 2.333333333]
        """
        nu = self.poisson_ratio
        return 3.0 - 4.0 * nu if self.plane == "strain" else (3.0 - nu) / (1.0 + nu)

    def effective_modulus(self, mode: Mode = "II") -> float:
        """Static modulus G*, Pa, in tau(k) = tau_0 - (G*/2) |k| delta(k).

        Mode II: G/(1-nu) in plane strain, G (1+nu) in plane stress,
        that is 2 G (1 - c_s^2/c_d^2) (Geubelle and Rice, 1995, static
        limit). Mode III: G.

        >>> for plane in ("strain", "stress"):  # G/(1 - nu) and G (1 + nu)
        ...     solid = Solid(1e9, 0.2, 1e3, plane)
        ...     print(f"{solid.effective_modulus():.6g} {solid.effective_modulus('III'):.6g}")
        1.25e+09 1e+09
        1.2e+09 1e+09
        """
        if mode not in ("II", "III"):
            raise InputError(f"mode: must be 'II' or 'III', got {mode!r}")
        if mode == "III":
            return self.shear_modulus
        return 2.0 * self.shear_modulus * (1.0 - self.wave_speed_ratio**-2)
