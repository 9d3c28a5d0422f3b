"""What several claims measure alike."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.papers.albertini2020.claims.claim import Quantity
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate, mean

Series = Sequence[Estimate]


def labelled(
    ratios: Iterable[float], series: Iterable[Estimate], unit: str = "", label: str = ""
) -> tuple[Quantity, ...]:
    """One quantity at each correlation length."""
    start = f"{label}, " if label else ""
    return tuple(
        Quantity(f"{start}xi_0/h_n = {float(ratio):g}", each, unit)
        for ratio, each in zip(ratios, series, strict=True)
    )


def at_each(
    data: Data, of: Callable[[float], Estimate], unit: str = "", label: str = ""
) -> tuple[Quantity, ...]:
    """One quantity at each correlation length of the Monte Carlo study."""
    return labelled(data.ratios, (of(ratio) for ratio in data.ratios), unit, label)


def at_simulated(
    data: Data, of: Callable[[float], Estimate], unit: str = "", label: str = ""
) -> tuple[Quantity, ...]:
    """One quantity at each correlation length of the simulations."""
    ratios = data.setting.simulated_ratios
    return labelled(ratios, (of(ratio) for ratio in ratios), unit, label)


def one(label: str, value: float, unit: str = "", error: float = 0.0) -> tuple[Quantity]:
    """A single number."""
    return (Quantity(label, Estimate(float(value), float(error)), unit),)


def root_mean_square(values: Array) -> Estimate:
    """Root of the mean square, with its error."""
    square = mean(values**2)
    root = float(np.sqrt(square.value))
    return Estimate(root, square.error / (2.0 * root) if root else 0.0)


def values(data: Data, study: str, name: str, ratio: float) -> Array:
    """Of every sample at one correlation length."""
    found: Array = data[study][name].sel(correlation_ratio=ratio).values
    return found


def pairs(dataset: xr.Dataset, name: str, factor: float = 1.0) -> list[Estimate]:
    """Numbers of a study that are kept beside their errors, times a factor."""
    both = zip(dataset[name].values, dataset[f"{name}_error"].values, strict=True)
    return [Estimate(float(value), float(error)).scaled(factor) for value, error in both]
