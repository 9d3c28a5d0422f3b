"""Measured surfaces of the SurfaceTopography library: heights, which are no strength by themselves.

Nothing of the library is imported here. An object of it says what it is by its methods.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.quantities import mapped_by
from stiction.units import factor_to

if TYPE_CHECKING:
    import xarray as xr


def is_topography(source: Any) -> bool:
    """Whether it is a line scan or map of SurfaceTopography."""
    return callable(getattr(source, "heights", None)) and hasattr(source, "physical_sizes")


def mapped(
    source: Any, strength: Callable[[Array], Array] | None, quantity: str, si: str
) -> xr.DataArray:
    """What a user makes of heights (m), over 'x', or over 'x' and 'y', in m; NaN where undefined.

    Raises
    ------
    InputError
        Without a map, or without a unit: heights are not taken for anything else.
    """
    import xarray as xr

    if strength is None:
        raise InputError(
            f"holds heights, which are no {quantity.replace('_', ' ')}; state what they mean with"
            " strength=lambda h: ..., h in m"
        )
    unit = getattr(source, "unit", None)
    if not unit:
        raise InputError("states no unit of its lengths; set it (topography.scale_height, unit=)")
    scale = factor_to("m", str(unit))
    heights = np.ma.filled(np.ma.asarray(source.heights(), dtype=np.float64), np.nan) * scale
    values = mapped_by(strength, heights, quantity)
    dims = ("x", "y")[: heights.ndim]
    uniform = bool(getattr(source, "is_uniform", True))
    places = {
        dim: scale * (float(size) / n * np.arange(n) if uniform else np.asarray(source.positions()))
        for dim, size, n in zip(dims, source.physical_sizes, heights.shape, strict=True)
    }
    coords = {dim: (dim, at, {"units": "m"}) for dim, at in places.items()}
    return xr.DataArray(values, dims=dims, coords=coords, name=quantity, attrs={"units": si})
