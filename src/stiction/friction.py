"""The friction law: linear slip weakening to a residual strength."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from stiction._model import OptionalProfile, Profile, model
from stiction.errors import InputError


@model
class SlipWeakening:
    """Strength that falls linearly with slip: max(tau_p - W d, tau_r).

    Parameters
    ----------
    weakening_rate : float or (nodes,) array, optional
        W, Pa/m, positive. Give either this or `critical_slip`.
    critical_slip : float or (nodes,) array, optional
        d_c, m, positive: then W = (tau_p - tau_r)/d_c varies with the strength.
    residual_strength : float or (nodes,) array
        tau_r, Pa, not negative.

    Raises
    ------
    InputError
        If neither or both of W and d_c are given, or a value is out of range.

    Notes
    -----
    Linear slip weakening after Ida (1972) and Palmer and Rice (1973). The fracture energy is
    Gamma = (tau_p - tau_r)^2/(2 W).
    """

    weakening_rate: OptionalProfile = None
    critical_slip: OptionalProfile = None
    residual_strength: Profile = 0.0

    @model_validator(mode="after")
    def _consistent(self) -> SlipWeakening:
        problems = []
        if (self.weakening_rate is None) == (self.critical_slip is None):
            given = "neither" if self.weakening_rate is None else "both"
            problems.append(f"give either weakening_rate or critical_slip, got {given}")
        for name in ("weakening_rate", "critical_slip"):
            value = getattr(self, name)
            if value is not None and not np.all(np.asarray(value) > 0.0):
                worst = np.asarray(value).min()
                problems.append(f"{name} must be positive everywhere, smallest given is {worst:g}")
        if not np.all(np.asarray(self.residual_strength) >= 0.0):
            worst = np.asarray(self.residual_strength).min()
            problems.append(f"residual_strength must not be negative, smallest given is {worst:g}")
        if problems:
            raise InputError(problems)
        return self
