"""Tables as the bytes of small files, and a lock that ends with its process."""

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

from stiction.errors import StoreError
from stiction.files import ONE_AT_A_TIME, write_atomically
from stiction.results import Variable

Arrays = dict[str, NDArray[Any]]


def digest(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


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


def read_whole(path: Path) -> bytes | None:
    """The bytes of a file, or None if there is none.

    Raises
    ------
    StoreError
        If it is there and cannot be read: nobody knows then whether it is damaged.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be read: {error.strerror or error}; nothing was changed, try again"
            " when it can be"
        ) from error


_held: set[Path] = set()
HELD = {errno.EACCES, errno.EAGAIN, errno.EDEADLK}
"""What the system says when somebody else has the lock; anything else is no lock at all."""


class HeldError(StoreError):
    """Somebody else has the lock."""


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
            raise HeldError(f"{folder}: a run in this process is writing to it")
        try:
            self._handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        try:
            self._lock()
        except OSError as error:
            holder = os.read(self._handle, 200).decode(errors="replace") or "unknown process"
            os.close(self._handle)
            if error.errno not in HELD:
                raise StoreError(
                    f"{self.path}: cannot be locked ({error.strerror or error}): this file system"
                    " has no locks; choose another place, or say that nobody else writes to it:"
                    " --no-lock (lock=False in Python)"
                ) from None
            raise HeldError(
                f"{folder}: another run is writing to it ({printable(holder)}); wait for it, or"
                " choose another folder"
            ) from None
        _held.add(self._key)
        if not self.announce:
            return self
        # Who holds it is a courtesy to others: on a full disk the lock holds without it.
        with suppress(OSError):
            os.ftruncate(self._handle, 0)
            os.write(self._handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        return self

    def check(self) -> None:
        """Refuse to go on if the file was removed or replaced: another run may hold a new one.

        Raises
        ------
        StoreError
        """
        try:
            there = os.stat(self.path)
        except FileNotFoundError as error:
            if not self.path.parent.is_dir():
                raise cannot_write(self.path.parent, error) from error
        except OSError as error:
            raise cannot_write(self.path, error) from error
        else:
            mine = os.fstat(self._handle)
            if (there.st_ino, there.st_dev) == (mine.st_ino, mine.st_dev):
                return
        raise StoreError(
            f"{self.path}: was removed while this run was writing, and another run may have begun;"
            " what was done before is stored, and the same command goes on"
        )

    def _lock(self) -> None:
        for _ in range(20):  # somebody may only be looking whether a run is active
            try:
                return _lock_file(self._handle)
            except OSError as error:
                if not self.announce or error.errno not in HELD:
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


class NoLock:
    """In place of a lock where the file system has none: others are not kept out.

    Chunks of two runs have different names and are whole, so that nothing is damaged if two write
    all the same; what one does not know of the other's chunks is found by the next run.
    """

    def __enter__(self) -> NoLock:
        return self

    def check(self) -> None:
        """Nothing to check."""

    def __exit__(self, *error: object) -> None:
        pass


def printable(text: str) -> str:
    """Text of unknown origin without control characters."""
    return "".join(char if char.isprintable() else "?" for char in text)


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
    int8 with the attribute ``dtype = "bool"``, as xarray does. The attribute 'content' is a digest
    of all of it. The classic model: a small table takes 4 kB instead of 64 in HDF5, in a third of
    the time.
    """
    attributes = dict(attributes, content=_digest_of(values, attributes))
    with ONE_AT_A_TIME:
        return _encode(values, variables, attributes)


def _encode(
    values: Mapping[str, NDArray[Any]],
    variables: Mapping[str, Variable],
    attributes: Mapping[str, Any],
) -> bytes:
    file = netCDF4.Dataset("chunk.nc", "w", memory=1 << 12, format="NETCDF3_64BIT_DATA")
    try:
        for name, given in attributes.items():
            file.setncattr(name, json.dumps(given))
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


def decode(data: bytes) -> tuple[Arrays, dict[str, Any]]:
    """The arrays and attributes of `encode`.

    Raises
    ------
    ValueError
        If they are not what was encoded.
    """
    result: Arrays = {}
    try:
        with ONE_AT_A_TIME, netCDF4.Dataset("chunk.nc", "r", memory=data) as file:
            file.set_auto_maskandscale(False)
            attributes = {name: json.loads(file.getncattr(name)) for name in file.ncattrs()}
            for name, variable in file.variables.items():
                value = np.asarray(variable[...])
                boolean = "dtype" in variable.ncattrs()
                result[name] = value.astype(np.bool_) if boolean else value
        intact = attributes.pop("content", None) == _digest_of(result, attributes)
    # A damaged file makes the NetCDF library raise nearly anything.
    except Exception as error:
        raise ValueError(f"cannot be read: {error}") from None
    if not intact:
        raise ValueError("fails its checksum")
    return result, attributes


def _digest_of(values: Mapping[str, NDArray[Any]], attributes: Mapping[str, Any]) -> str:
    total = hashlib.sha256(json.dumps(attributes, sort_keys=True).encode())
    for name in sorted(values):
        value = np.ascontiguousarray(values[name])
        total.update(f"{name} {value.dtype.kind}{value.dtype.itemsize} {value.shape}".encode())
        total.update(value.tobytes())
    return total.hexdigest()
