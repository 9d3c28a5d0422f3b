"""What figures, tables and claims are made from: the setting and the studies' results."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.papers.albertini2020.setting import Setting

_ONSET = ("critical_stress", "critical_position", "first_instability", "arrested_events")
_DIMS = ("correlation_ratio", "sample")
_SOURCES = {"monte_carlo": (), "interaction": (), "ruptures": ("monte_carlo", "interaction")}
"""Studies whose onsets elastodynamics can give, and what else that takes."""


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

    def by_elastodynamics(self, study: str) -> Data | None:
        """The same, with the onsets of that study by elastodynamics, sample by sample.

        The samples are those that both have, from the first on. None if the Monte Carlo study by
        elastodynamics was not computed, or not at the study's correlation lengths.
        """
        if not self.studies.keys() >= {"dynamic", study, *_SOURCES[study]}:
            return None
        ratios = list(self.setting.simulated_ratios if study == "ruptures" else self.ratios)
        if not set(ratios) <= set(self.ratios):
            return None
        count = min(self["dynamic"].sizes["sample"], self.samples)
        studies = dict(self.studies)
        for name in {"dynamic", "monte_carlo", "interaction"}.intersection(studies):
            studies[name] = studies[name].isel(sample=slice(count))
        if study == "ruptures":
            studies[study] = self._predictions(studies).sel(correlation_ratio=ratios)
        runs = studies["dynamic"].sel(correlation_ratio=ratios)
        onsets = {name: (_DIMS, runs[name].transpose(*_DIMS).values) for name in _ONSET}
        studies[study] = studies[study].assign(onsets)
        return dataclasses.replace(self, samples=count, studies=studies)

    def _predictions(self, studies: dict[str, xr.Dataset]) -> xr.Dataset:
        """What the study of ruptures predicts of each run, from those of many samples."""
        local, exact = studies["monte_carlo"], studies["interaction"]
        found = {f"local_{name}": local[name] for name in ("critical_stress", "critical_position")}
        found |= {f"exact_{name}": exact[name] for name in _ONSET}
        found |= {
            "printed_critical_stress": exact["printed_first_instability"],
            "printed_critical_position": exact["printed_critical_position"],
        }
        dataset = xr.Dataset(
            {name: (_DIMS, each.transpose(*_DIMS).values) for name, each in found.items()},
            coords={"correlation_ratio": list(self.ratios)},
        )
        numbers = np.arange(dataset.sizes["sample"])
        shape = tuple(dataset.sizes[dim] for dim in _DIMS)
        return dataset.assign(number=(_DIMS, np.broadcast_to(numbers, shape)))

    def relative(self, stress: Array) -> Array:
        """Stress in units of the mean strength <tau_p>."""
        result: Array = np.asarray(stress) / self.setting.mean
        return result
