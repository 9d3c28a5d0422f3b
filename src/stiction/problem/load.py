"""The load: an initial stress plus a profile that grows."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from stiction.base.errors import InputError
from stiction.base.model import Listed, OptionalProfile, Positive, Profile, model


@model
class Load(Listed):
    """Shear stress tau_i(x) + tau_0 p(x) on an interface without slip. The load factor tau_0 rises.

    Parameters
    ----------
    profile : float or (nodes,) array
        p, dimensionless, positive. Divide it by its mean: tau_0 is then
        the mean stress.
    initial_stress : float or (nodes,) array
        tau_i, Pa, below the peak strength everywhere. `Rupture` also
        takes nodes at which it is higher, which break at once.
    normal_pressure : float or (nodes,) array, optional
        Pa, positive on average. Every onset then has a
        `friction_coefficient`.
    pressing_force : float, optional
        Force, N, positive, in place of `normal_pressure`. The force
        over the interface area, which must be known, is the
        uniform pressure, or the mean pressure between glued plates.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> x = st.Interface(length=0.1, nodes=512).x
    >>> profile = 1.0 + 2.0 * np.exp(-x / 0.01)
    >>> load = st.Load(profile=profile / profile.mean(), normal_pressure=5e6)
    """

    profile: Profile = 1.0  # type: ignore[assignment]  # converted
    initial_stress: Profile = 0.0  # type: ignore[assignment]
    normal_pressure: OptionalProfile = None  # type: ignore[assignment]
    pressing_force: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        profile, pressure, problems = self.profile, self.normal_pressure, []
        if isinstance(profile, float | np.ndarray) and np.min(profile) <= 0.0:
            problems.append(f"profile must be positive everywhere, got {np.min(profile):g}")
        if isinstance(pressure, float | np.ndarray) and np.mean(pressure) <= 0.0:
            mean = np.mean(pressure)
            problems.append(
                f"normal_pressure must be positive on average. Its mean is {mean:g}"
            )
        if pressure is not None and self.pressing_force is not None:
            problems.append(
                "pressing_force: give either normal_pressure (Pa) or pressing_force (N), not both"
            )
        if problems:
            raise InputError(problems)
        return self
