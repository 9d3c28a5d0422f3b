"""What figures, tables and claims are made from: the setting and the studies' results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.papers.albertini2020.setting import Setting


@dataclass(frozen=True, eq=False)
class Data:
    """Results of the studies, by name.

    Attributes
    ----------
    setting : Setting
    samples, seed : int
        Samples at each point of the Monte Carlo study, and their seed.
    studies : dict of str to Dataset
    """

    setting: Setting
    samples: int
    seed: int
    studies: dict[str, xr.Dataset]

    def __getitem__(self, name: str) -> xr.Dataset:
        return self.studies[name]

    @property
    def ratios(self) -> tuple[float, ...]:
        """xi_0/h_n of the Monte Carlo study."""
        return self.setting.correlation_ratios

    def at(self, ratio: float) -> xr.Dataset:
        """The Monte Carlo study at one xi_0/h_n."""
        return self["monte_carlo"].sel(correlation_ratio=ratio)

    def relative(self, stress: Array) -> Array:
        """Stress in units of the mean strength <tau_p>."""
        result: Array = np.asarray(stress) / self.setting.mean
        return result
