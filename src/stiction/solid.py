"""The elastic half-spaces."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stiction._checks import check_choice
from stiction._model import Mode, Positive, _number, model
from stiction.plausible import warn_of_waves


@model
class Solid:
    """One of two identical linear-elastic half-spaces.

    Parameters
    ----------
    shear_modulus : float
        G, Pa.
    poisson_ratio : float
        nu, in (-1, 0.5).
    density : float
        rho, kg/m3.
    plane : {"strain", "stress"}
        Plane state of the in-plane problem (mode II); mode III does not depend on it.

    Raises
    ------
    InputError
        If a value is missing, not finite or out of range.

    Examples
    --------
    >>> import stiction as st
    >>> st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0).shear_wave_speed
    1000.0
    """

    shear_modulus: Positive
    poisson_ratio: Annotated[
        float, BeforeValidator(_number), Field(gt=-1, lt=0.5, allow_inf_nan=False)
    ]
    density: Positive
    plane: Literal["strain", "stress"] = "strain"

    @model_validator(mode="after")
    def _plausible(self) -> Solid:
        warn_of_waves(self)
        return self

    @property
    def shear_wave_speed(self) -> float:
        """c_s = sqrt(G/rho), m/s."""
        return math.sqrt(self.shear_modulus / self.density)

    @property
    def wave_speed_ratio(self) -> float:
        """c_d/c_s: sqrt(2 (1-nu)/(1-2 nu)) in plane strain, sqrt(2/(1-nu)) in plane stress."""
        nu = self.poisson_ratio
        if self.plane == "strain":
            return math.sqrt(2.0 * (1.0 - nu) / (1.0 - 2.0 * nu))
        return math.sqrt(2.0 / (1.0 - nu))

    @property
    def dilatational_wave_speed(self) -> float:
        """c_d of the plane state, m/s."""
        return self.wave_speed_ratio * self.shear_wave_speed

    @property
    def rayleigh_wave_speed(self) -> float:
        """c_R, m/s, from Rayleigh's cubic in q = (c_R/c_s)^2.

        q^3 - 8 q^2 + (24 - 16/eta^2) q - 16 (1 - 1/eta^2) = 0 with eta = c_d/c_s: the equation
        (2-q)^2 = 4 sqrt(1-q) sqrt(1-q/eta^2), squared and divided by q (Rayleigh, 1885).
        """
        slowness = self.wave_speed_ratio**-2
        roots = np.roots([1.0, -8.0, 24.0 - 16.0 * slowness, -16.0 * (1.0 - slowness)])
        real = roots.real[np.abs(roots.imag) < 1e-9]
        return math.sqrt(float(real.min())) * self.shear_wave_speed

    def effective_modulus(self, mode: Mode = "II") -> float:
        """Static modulus G*, Pa, in tau(k) = tau_0 - (G*/2) |k| delta(k).

        Mode II: G/(1-nu) in plane strain, G (1+nu) in plane stress; mode III: G. In every case
        it is 2 G (1 - c_s^2/c_d^2) for mode II (Geubelle and Rice, 1995, static limit).
        """
        check_choice("mode", mode, ("II", "III"))
        if mode == "III":
            return self.shear_modulus
        return 2.0 * self.shear_modulus * (1.0 - self.wave_speed_ratio**-2)
