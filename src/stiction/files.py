"""Files that are whole or not there: any content, archives of arrays, datasets; and the cache."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import struct
import threading
import uuid
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from stiction.errors import InputError, StoreError

if TYPE_CHECKING:
    import xarray as xr

PART = ".part"

UNREADABLE = (
    OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError,
    SyntaxError, zipfile.BadZipFile, zlib.error, struct.error,
)  # fmt: skip
"""What damaged archives have been seen to raise."""

GROUP, DIGEST = "checksum", "sha256"
ONE_AT_A_TIME = threading.RLock()
"""The NetCDF library is not thread-safe: one thread may look at a run that another one writes."""


def write_atomically(path: Path, content: bytes | Callable[[Path], object]) -> None:
    """Write a file aside, sync it and rename it: an older one stays until the new one is whole.

    Parameters
    ----------
    path : Path
    content : bytes or callable
        What to write, or a function that writes it to the path that it is given.

    Raises
    ------
    OSError
        If it cannot be written; nothing is left behind.
    """
    aside = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}{PART}")
    try:
        if callable(content):
            content(aside)
        else:
            aside.write_bytes(content)
        with open(aside, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        with suppress(OSError):
            aside.unlink()
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Make renames in a folder durable, where the system knows how."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        return
    with suppress(OSError):
        os.fsync(handle)
    os.close(handle)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file that is either whole or not there, whatever happens.

    Raises
    ------
    StoreError
        If the disk is full or the folder cannot be written; nothing is left behind.
    """
    try:
        write_atomically(path, data)
    except OSError as error:
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: BaseException) -> StoreError:
    """Return the error for a file that cannot be written, with the reason in words."""
    number = getattr(error, "errno", None)
    reason = {
        errno.ENOSPC: "the disk is full",
        errno.EDQUOT: "the disk quota is used up",
        errno.ENOENT: "the folder is gone",
        errno.EROFS: "the file system is read-only",
        errno.EACCES: "permission denied",
    }.get(number or 0, str(error))
    return StoreError(f"{path}: cannot be written: {reason}")


def cannot_read(path: Path, error: OSError) -> StoreError:
    """Return the error for a file that cannot be read, which does not mean that it is damaged."""
    return StoreError(
        f"{path}: cannot be read: {error.strerror or error}; nothing was changed, try again when"
        " it can be"
    )


def write_arrays(path: Path, arrays: dict[str, Any]) -> None:
    """Write an .npz archive, whole or not at all."""

    def write(aside: Path) -> None:
        with open(aside, "wb") as stream:  # np.savez would append .npz to a path
            np.savez(stream, **arrays)

    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, write)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz; one of `UNREADABLE` or FileNotFoundError if it is not one."""
    with open(path, "rb") as stream:
        data = np.load(stream, allow_pickle=False)
        if not isinstance(data, np.lib.npyio.NpzFile):
            raise ValueError("it holds one array only")
        return {name: data[name] for name in data.files}


def write_dataset(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset, whole or not at all, with a Fletcher32 sum of each block and a digest.

    The digest of names, values and attributes stands in the group 'checksum', so that the dataset
    that is read is the one that was written.

    Raises
    ------
    OSError, RuntimeError
        If it cannot be written.
    """
    import netCDF4
    import xarray as xr

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


def digest_of(dataset: xr.Dataset) -> str:
    """Return the SHA-256 of everything in a dataset: names, dimensions, values, attributes."""
    digest = hashlib.sha256(_text(dataset.attrs))
    for name in sorted(dataset.variables, key=str):
        variable = dataset.variables[name]
        values = np.asarray(variable.values)
        head = [str(name), list(variable.dims), list(values.shape), values.dtype.str]
        digest.update(_text([*head, dict(variable.attrs)]))
        plain = values.dtype.kind in "fiubcmM"
        digest.update(values.tobytes() if plain else _text(values.tolist()))
    return digest.hexdigest()


def _text(value: Any) -> bytes:
    return json.dumps(
        value, sort_keys=True, default=lambda item: np.asarray(item).tolist()
    ).encode()


def cache_folder() -> Path:
    """Return `STICTION_CACHE_DIR` if set, else the user's cache folder of the platform."""
    given = os.environ.get("STICTION_CACHE_DIR")
    return Path(given) if given else Path(platformdirs.user_cache_dir("stiction"))


def private_folder(root: Path, *inside: str) -> Path:
    """A folder in `root`, made if need be, in which nobody else can have put anything.

    Compiled kernels are pickles: who can write one can run code as whoever loads it.

    Raises
    ------
    InputError
        If `root` or a folder below it belongs to somebody else, or others may write there.
    """
    folder = root
    for part in ("", *inside):
        folder = folder / part
        try:
            folder.mkdir(mode=0o700, parents=part == "", exist_ok=True)
            found = folder.stat()
        except OSError:  # nothing can be kept there: kernels are compiled each time
            return root.joinpath(*inside)
        if not hasattr(os, "getuid"):  # Windows has other means
            continue
        problem = ""
        if found.st_uid not in (os.getuid(), 0):
            problem = f"belongs to another user (number {found.st_uid})"
        elif found.st_mode & 0o022:
            problem = "can be written by others"
        if problem:
            raise InputError(
                f"cache: {folder} {problem}, who could put compiled code there that runs as you;"
                " set STICTION_CACHE_DIR to a folder of your own"
                + (f", or close it: chmod go-w {folder}" if "written" in problem else "")
                + (" (NUMBA_CACHE_DIR chose it)" if os.environ.get("NUMBA_CACHE_DIR") else "")
            )
    return folder
