"""Datasets in NetCDF files that notice when they are damaged."""

from __future__ import annotations

import hashlib
import json
import threading
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from stiction._files import write_atomically

GROUP, DIGEST = "checksum", "sha256"
ONE_AT_A_TIME = threading.RLock()
"""The NetCDF library knows no threads: one may look at a run that another one writes."""


class DamagedError(ValueError):
    """A file is not what was written."""


def write_dataset(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset, whole or not at all, with a Fletcher32 sum of each block and a digest.

    The digest of names, values and attributes stands in the group 'checksum', so that the dataset
    that is read is the one that was written.

    Raises
    ------
    OSError, RuntimeError
        If it cannot be written.
    """
    encoding = {
        str(name): {"fletcher32": True}
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.size and variable.dtype.kind in "fiub"
    }

    def write(aside: Path) -> None:
        dataset.to_netcdf(aside, engine="netcdf4", encoding=encoding)
        with xr.open_dataset(aside, engine="netcdf4") as written:
            mark = digest_of(written.load())
        with netCDF4.Dataset(aside, "a") as file:
            file.createGroup(GROUP).setncattr(DIGEST, mark)

    with ONE_AT_A_TIME:
        write_atomically(path, write)


def read_dataset(path: Path) -> xr.Dataset:
    """Read what `write_dataset` has written.

    Raises
    ------
    FileNotFoundError, PermissionError
    DamagedError
        If it is no such file, or not what was written.
    """
    try:
        with ONE_AT_A_TIME:
            with xr.open_dataset(path, engine="netcdf4") as opened:
                dataset = opened.load()
            with netCDF4.Dataset(path) as file:
                marked = GROUP in file.groups and DIGEST in file[GROUP].ncattrs()
                mark = str(file[GROUP].getncattr(DIGEST)) if marked else ""
        found = digest_of(dataset)
    except (FileNotFoundError, PermissionError):
        raise
    # A damaged file makes the NetCDF library and xarray raise nearly anything.
    except Exception as error:
        raise DamagedError(f"is no NetCDF file that can be read: {error}") from None
    if not mark:
        raise DamagedError("has no checksum: it was changed by others, or is damaged")
    if mark != found:
        raise DamagedError("fails its checksum: it was changed by others, or is damaged")
    return dataset


def digest_of(dataset: xr.Dataset) -> str:
    """SHA-256 of everything in a dataset: names, dimensions, values, attributes."""
    digest = hashlib.sha256(_text(dataset.attrs))
    for name in sorted(dataset.variables, key=str):
        variable = dataset.variables[name]
        values = np.asarray(variable.values)
        said = [str(name), list(variable.dims), list(values.shape), values.dtype.str]
        digest.update(_text([*said, dict(variable.attrs)]))
        plain = values.dtype.kind in "fiubcmM"
        digest.update(values.tobytes() if plain else _text(values.tolist()))
    return digest.hexdigest()


def _text(value: Any) -> bytes:
    return json.dumps(
        value, sort_keys=True, default=lambda item: np.asarray(item).tolist()
    ).encode()
