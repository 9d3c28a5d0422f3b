"""Files that hold profiles, as bytes and tables: text, .npy and NetCDF, with nothing trusted."""

from __future__ import annotations

import io
import math
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

LARGEST = 2**30
"""Bytes; a profile is one line of numbers, and what is larger than this is something else."""

TEXT = (".csv", ".txt", ".dat", ".tsv")
NETCDF = (".nc", ".nc4")
ENDINGS = (".npy", *TEXT, *NETCDF)


def _open(path: Path) -> int:
    """A descriptor of a regular file; never waits, as opening a pipe would."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    status = os.fstat(descriptor)
    regular = stat.S_ISREG(status.st_mode)
    if regular and status.st_size <= LARGEST:
        return descriptor
    os.close(descriptor)
    if not regular:
        raise InputError(f"{path}: is not a regular file")
    raise InputError(f"{path}: has {status.st_size} bytes, more than the {LARGEST} of a profile")


def content(path: Path) -> bytes:
    """All of a regular file of reasonable size."""
    try:
        with os.fdopen(_open(path), "rb") as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(data) > LARGEST:
        raise InputError(f"{path}: is longer than the {LARGEST} bytes of a profile")
    return data


def decoded(path: Path) -> str:
    """The text of a file: UTF-8 or UTF-16 with a mark, or else Windows' western code page."""
    data = content(path)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-8-sig", "cp1252"]
    if b"\0" not in data or encodings == ["utf-16"]:
        for encoding in encodings:
            try:
                return data.decode(encoding)
            except UnicodeDecodeError:
                continue
    raise InputError(f"{path}: is not a text file")


def read_npy(path: Path) -> Array:
    """The array of a .npy file, after its header has been found to agree with its size."""
    data = content(path)
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        header: Any = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }[version]
        shape, column_major, dtype = header(file)
    except Exception as error:  # numpy lets through whatever Python's own parser raises
        text = str(error).splitlines()[0] if str(error) else "its header cannot be read"
        raise InputError(f"{path}: is not a .npy file of numbers: {text}") from None
    if dtype.kind not in "fiu":
        raise InputError(f"{path}: must hold numbers, got {dtype}")
    expected = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or expected != len(data) - file.tell():
        raise InputError(
            f"{path}: is damaged: shape {shape} of {dtype} takes {expected} bytes, the file has"
            f" {len(data) - file.tell()} after its header"
        )
    flat = np.frombuffer(data, dtype=dtype, offset=file.tell()).astype(np.float64)
    return np.squeeze(flat.reshape(shape, order="F" if column_major else "C"))


def read_netcdf(path: Path, dimensions: int = 1) -> xr.Dataset:
    """The variables along one or two dimensions of a NetCDF file; units are left to the caller."""
    import xarray as xr

    try:
        os.close(_open(path))
        # Times are not decoded: a variable in seconds is refused by its unit, like any other.
        with xr.open_dataset(
            path, engine="netcdf4", decode_times=False, decode_timedelta=False
        ) as opened:
            chosen = opened[
                [name for name, one in opened.data_vars.items() if _fits(one, dimensions)]
            ]
            return chosen.squeeze(drop=True).load()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, RuntimeError, KeyError, AttributeError, TypeError) as error:
        raise InputError(f"{path}: is no NetCDF file of numbers: {error}") from None


def _fits(variable: Any, dimensions: int) -> bool:
    """Whether it is one profile of numbers, and small enough to be loaded."""
    along = [length for length in variable.shape if length != 1]
    return (
        variable.dtype.kind in "fiu"
        and len(along) == dimensions
        and 8 * math.prod(along) <= LARGEST
    )
