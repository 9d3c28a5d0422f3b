"""An ensemble in a few numbers: moments with errors, quantiles with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stiction.statistics.estimates import Estimate, mean, skewness, standard_deviation
from stiction.statistics.quantiles import quantile_distance, quantiles

PROBABILITIES = (0.05, 0.25, 0.5, 0.75, 0.95)
_MOMENTS = {"mean": mean, "standard_deviation": standard_deviation, "skewness": skewness}


def summarise(values: Any) -> xr.Dataset:
    """Mean, standard deviation and skewness with errors, and five quantiles with intervals."""
    numbers: dict[str, Any] = {}
    for name, estimator in _MOMENTS.items():
        estimate = estimator(values)
        numbers[name] = estimate.value
        numbers[f"{name}_error"] = estimate.error
    q = quantiles(values, PROBABILITIES)
    for name in ("value", "lower", "upper"):
        numbers[f"quantile_{name}"] = ("probability", getattr(q, name))
    spread = quantile_distance(values, 0.25, 0.5)
    numbers["lower_spread"], numbers["lower_spread_error"] = spread.value, spread.error
    numbers["smallest"] = float(np.min(values))
    dataset = xr.Dataset(numbers, coords={"probability": list(PROBABILITIES)})
    for key, variable in dataset.variables.items():
        pure = str(key) in ("probability", "skewness", "skewness_error")
        variable.attrs["units"] = "1" if pure else "Pa"
    return dataset


def stack(parts: Mapping[Any, xr.Dataset], dim: str, long_name: str) -> xr.Dataset:
    """Datasets side by side along a new coordinate whose values are the keys."""
    keys = list(parts)
    merged = xr.concat(list(parts.values()), dim=dim, combine_attrs="drop")
    return merged.assign_coords({dim: (dim, keys, {"units": "1", "long_name": long_name})})


def estimate(dataset: xr.Dataset, name: str, **where: Any) -> Estimate:
    """A number of `summarise` with its error."""
    chosen = dataset.sel(**where) if where else dataset
    return Estimate(float(chosen[name]), float(chosen[f"{name}_error"]))


def estimates(dataset: xr.Dataset, name: str) -> Sequence[Estimate]:
    """The same along the only dimension that the number has."""
    pairs = zip(dataset[name].values, dataset[f"{name}_error"].values, strict=True)
    return [Estimate(float(value), float(error)) for value, error in pairs]
