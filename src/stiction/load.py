"""The load: a profile that grows, on top of an initial stress."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from stiction._model import OptionalProfile, Profile, model
from stiction.errors import InputError


@model
class Load:
    """Shear stress on the interface if nothing slipped: tau_i(x) + tau_0 p(x), tau_0 rising.

    Parameters
    ----------
    profile : float or (nodes,) array
        p, dimensionless, positive.
    initial_stress : float or (nodes,) array
        tau_i, Pa, below the peak strength everywhere.
    normal_pressure : float or (nodes,) array, optional
        Pa, positive on average. With it every onset has a `friction_coefficient`.

    Raises
    ------
    InputError
        If the profile is not positive or the pressure not positive on average.

    Examples
    --------
    A load that is higher in the middle of 8 nodes, under a pressure of 5 MPa:

    >>> import numpy as np
    >>> import stiction as st
    >>> load = st.Load(profile=1.0 + np.hanning(8), normal_pressure=5e6)
    >>> load.profile.shape
    (8,)
    """

    profile: Profile = 1.0
    initial_stress: Profile = 0.0
    normal_pressure: OptionalProfile = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        problems = []
        if not np.all(np.asarray(self.profile) > 0.0):
            worst = np.asarray(self.profile).min()
            problems.append(f"profile must be positive everywhere, smallest given is {worst:g}")
        if self.normal_pressure is not None and not np.mean(self.normal_pressure) > 0.0:
            mean = np.mean(self.normal_pressure)
            problems.append(f"normal_pressure must be positive on average, its mean is {mean:g}")
        if problems:
            raise InputError(problems)
        return self
