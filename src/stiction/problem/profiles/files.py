"""Read files of measured data, chosen by their endings. A file may come from a stranger.

Each reader takes these steps:

1. Take the whole content of a regular file (`base/files.py`).
2. Compare the size that the file states with a limit, before anything is unpacked.
3. Let a library read the content. Any failure of the library becomes a line for the user.
4. Return an array with its names and units.
"""

from __future__ import annotations

import io
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.files import check_unpacked, content_of, refuse_damage
from stiction.base.netcdf import read_netcdf
from stiction.base.units import parse
from stiction.problem.profiles.tables import EXCEL, MAX_CELLS, TEXT, Options, read_table

if TYPE_CHECKING:
    import xarray as xr

NETCDF, IMAGES = (".nc", ".nc4"), (".png", ".tif", ".tiff")
INSTRUMENTS = (
    ".sur", ".al3d", ".plu", ".plux", ".opd", ".opdx", ".x3p", ".sdf", ".vk3", ".vk4", ".vk6",
    ".vk7", ".gwy", ".os3d", ".lext", ".nms", ".zon", ".datx", ".mnt", ".oir", ".frt", ".spm",
    ".ibw", ".nid",
)  # fmt: skip
"""Binary files of profilometers and microscopes, which SurfaceTopography reads."""
HEIGHT, GREY_VALUE = "height", "grey value"
"""Names of arrays that hold no strengths: surfaces and images."""


def load(path: Path, options: Options) -> xr.Dataset | xr.DataArray | Array:
    """Read a file as variables, as a surface or image over 'x' and 'y', or as an .npy array."""
    ending = path.suffix.lower()
    if ending in (*TEXT, EXCEL):
        return read_table(path, options)
    readers: dict[str, Any] = {".npy": _read_npy} | dict.fromkeys(NETCDF, _read_netcdf)
    readers |= dict.fromkeys(IMAGES, _read_image) | dict.fromkeys(INSTRUMENTS, _read_instrument)
    if ending not in readers:
        endings = ", ".join((*TEXT, EXCEL, *readers))
        raise InputError(
            f"must end in {endings}, got {path.name!r}. Export text from the instrument"
        )
    return readers[ending](content_of(path))


def _read_npy(content: bytes) -> Array:
    with refuse_damage("a .npy file of numbers"):
        array = np.load(io.BytesIO(content), allow_pickle=False)
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "bfiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    return np.squeeze(array.astype(np.float64))


def _read_netcdf(content: bytes) -> xr.Dataset:
    """Return the numeric variables with their units, without dimensions of length one."""
    data = read_netcdf(content).squeeze(drop=True)
    data = data[[name for name, variable in data.items() if variable.dtype.kind in "fiu"]]
    data.attrs = {}
    for variable in data.variables.values():
        given = variable.attrs
        variable.attrs = {key: given[key] for key in ("unit", "units") if key in given}
    return data


def _read_image(content: bytes) -> xr.DataArray:
    """Return the grey values (nx, ny) of an image. The first line is at y = 0."""
    import xarray as xr
    from PIL import Image

    with (
        refuse_damage("an image"),
        Image.open(io.BytesIO(content), formats=("PNG", "TIFF")) as image,
    ):
        check_unpacked(image.width * image.height, content, MAX_CELLS, 1)
        grey = np.asarray(image)
    if grey.ndim != 2 or grey.dtype.kind not in "fiu":
        raise InputError(f"must be a grey image, got shape {grey.shape} of {grey.dtype}")
    return xr.DataArray(grey.T.astype(np.float64), dims=("x", "y"), name=GREY_VALUE)


def _read_instrument(content: bytes) -> xr.DataArray:
    """Return the heights in a binary file that an instrument wrote."""
    try:
        from SurfaceTopography import read_topography
    except ImportError:
        raise InputError(
            "needs SurfaceTopography (pip install 'stiction[instruments]'), or export text from the"
            " instrument"
        ) from None
    with refuse_damage("a file that SurfaceTopography can read, or is damaged"):
        surface = read_topography(io.BytesIO(content))
    return heights_of(surface)


def heights_of(surface: Any) -> xr.DataArray:
    """Return the heights in an object of SurfaceTopography over x, and over y if it is a map."""
    import xarray as xr

    *places, heights = surface.positions_and_heights()
    unit = surface.unit or ""
    if unit and parse(unit) is None:
        with suppress(UnicodeError):  # the library reads UTF-8 as Latin-1
            unit = unit.encode("latin-1").decode("utf-8")
    attributes = {"units": unit} if unit else {}
    values = np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan)
    axes = places if values.ndim == 1 else [places[0][:, 0], places[1][0]]
    coords = {dim: (dim, np.asarray(x), attributes) for dim, x in zip("xy", axes, strict=False)}
    return xr.DataArray(values, coords, [*coords], HEIGHT, attributes)
