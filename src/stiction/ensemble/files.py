"""Files that are whole or not there, and a lock that ends with its process."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from stiction.ensemble.trouble import StoreError
from stiction.results import Variable

Arrays = dict[str, NDArray[Any]]


def digest(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


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
    aside = path.with_name(path.name + ".part")
    try:
        with open(aside, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise cannot_write(path, error) from error
    sync_folder(path.parent)


def cannot_write(path: Path, error: BaseException) -> StoreError:
    """What to tell the user when writing failed."""
    number = getattr(error, "errno", None)
    reason = {
        errno.ENOSPC: "the disk is full",
        errno.EDQUOT: "the disk quota is used up",
        errno.ENOENT: "the folder is gone",
        errno.EROFS: "the file system is read-only",
        errno.EACCES: "permission denied",
    }.get(number or 0, str(error))
    return StoreError(f"{path}: cannot be written: {reason}")


_held: set[Path] = set()


class Lock:
    """One run at a time in a folder.

    A lock of the operating system on a file: it ends with the process, however it ends, and a
    forked worker does not inherit it. A second run in the same process is refused as well.
    """

    def __init__(self, path: Path, *, announce: bool = True) -> None:
        self.path, self.announce = path, announce
        self._key = path.parent.resolve()
        self._handle = -1

    def __enter__(self) -> Lock:
        folder = self.path.parent
        if self._key in _held:
            raise StoreError(f"{folder}: a run in this process is writing to it")
        try:
            self._handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        try:
            self._lock()
        except OSError:
            holder = os.read(self._handle, 200).decode(errors="replace") or "unknown process"
            os.close(self._handle)
            raise StoreError(
                f"{folder}: another run is writing to it ({holder}); wait for it, or choose"
                " another folder"
            ) from None
        _held.add(self._key)
        if not self.announce:
            return self
        # Who holds it is a courtesy to others: on a full disk the lock holds without it.
        with suppress(OSError):
            os.ftruncate(self._handle, 0)
            os.write(self._handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        return self

    def _lock(self) -> None:
        for _ in range(20):  # somebody may only be looking whether a run is active
            try:
                return _lock_file(self._handle)
            except OSError:
                if not self.announce:
                    raise
                time.sleep(0.02)
        _lock_file(self._handle)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        _held.discard(self._key)
        os.close(self._handle)


def _lock_file(handle: int) -> None:
    """Lock an open file for this process, or raise OSError at once."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        os.lseek(handle, 1 << 20, os.SEEK_SET)  # beyond what others must be able to read
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # Windows only
        os.lseek(handle, 0, os.SEEK_SET)
        return
    fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def encode(
    values: Mapping[str, NDArray[Any]],
    variables: Mapping[str, Variable],
    attributes: Mapping[str, Any],
) -> bytes:
    """Arrays as the bytes of one NetCDF file.

    Dimensions are named by `variables`; equal names have equal sizes. Booleans are stored as
    int8 with the attribute ``dtype = "bool"``, as xarray does.
    """
    file = netCDF4.Dataset("chunk.nc", "w", memory=1 << 16)
    try:
        for name, given in attributes.items():
            file.setncattr(name, given if isinstance(given, str) else json.dumps(given))
        for name, value in values.items():
            dims = variables[name].dims
            for dim, size in zip(dims, value.shape, strict=True):
                if dim not in file.dimensions:
                    file.createDimension(dim, size)
            boolean = value.dtype.kind == "b"
            kind = np.dtype(np.int8) if boolean else value.dtype
            variable = file.createVariable(name, kind, dims, fill_value=False)
            variable.units, variable.long_name = variables[name].units, variables[name].long_name
            if boolean:
                variable.setncattr("dtype", "bool")
            if value.size:
                variable[...] = value
        return bytes(file.close())
    finally:
        if file.isopen():
            file.close()


def decode(data: bytes) -> Arrays:
    """The arrays of `encode`."""
    result: Arrays = {}
    with netCDF4.Dataset("chunk.nc", "r", memory=data) as file:
        file.set_auto_maskandscale(False)
        for name, variable in file.variables.items():
            value = np.asarray(variable[...])
            boolean = "dtype" in variable.ncattrs()
            result[name] = value.astype(np.bool_) if boolean else value
    return result
