"""Files that are whole or not there, archives of arrays, and the folders of the cache."""

import os
import struct
import uuid
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from stiction.base.errors import InputError, StoreError

PART = ".part"
LARGEST = 2**30
"""Bytes of a file that is read whole."""

UNREADABLE = (
    OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError,
    SyntaxError, zipfile.BadZipFile, zlib.error, struct.error,
)  # fmt: skip
"""Errors that damaged archives raise."""


def content_of(path: Path, *, read: bool = True) -> bytes:
    """Return the bytes of a regular file of reasonable size, or only check that it is one."""
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise InputError("is not a regular file")
        if size > LARGEST:
            raise InputError(f"has {size} bytes, more than the {LARGEST} of a profile")
        return path.read_bytes() if read else b""
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None


def write_whole(path: Path, content: bytes | Callable[[Path], object]) -> None:
    """Write a file aside, sync it and rename it: an older one stays until the new one is whole.

    The content is bytes, or a function that writes to the path that it is given. If it fails (a
    `StoreError`), nothing is left behind.
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
    except BaseException as error:
        with suppress(OSError):
            aside.unlink()
        if isinstance(error, OSError | RuntimeError):  # the NetCDF library raises either
            raise cannot("written", path, error) from error
        raise
    with suppress(OSError):  # Windows opens no folders
        folder = os.open(path.parent, os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)


def cannot(what: str, path: Path, error: BaseException) -> StoreError:
    """Return the error for a file that cannot be read or written."""
    return StoreError(f"{path}: cannot be {what}: {getattr(error, 'strerror', None) or error}")


def write_arrays(path: Path, arrays: dict[str, Any]) -> None:
    """Write an .npz archive, whole or not at all; for errors see `write_whole`."""

    def write(aside: Path) -> None:
        with open(aside, "wb") as stream:  # np.savez would append .npz to a path
            np.savez(stream, **arrays)

    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, write)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz; one of `UNREADABLE` or FileNotFoundError if it is not one."""
    with open(path, "rb") as stream:
        data = np.load(stream, allow_pickle=False)
        if not isinstance(data, np.lib.npyio.NpzFile):
            raise ValueError("it holds one array only")
        return {name: data[name] for name in data.files}


def cache_folder() -> Path:
    """Return `STICTION_CACHE_DIR` if set, else the user's cache folder of the platform."""
    given = os.environ.get("STICTION_CACHE_DIR")
    return Path(given) if given else Path(platformdirs.user_cache_dir("stiction"))


def private_folder(folder: Path) -> Path:
    """Return a folder, made if need be, in which nobody else can have put anything.

    Compiled kernels are pickles: who can write one can run code as whoever loads it.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError:  # nothing can be kept there: kernels are compiled each time
        return folder
    foreign = hasattr(os, "getuid") and found.st_uid not in (os.getuid(), 0)
    if foreign or (os.name == "posix" and found.st_mode & 0o022):
        problem = "belongs to another user" if foreign else "can be written by others"
        raise InputError(
            f"cache: {folder} {problem}, who could put compiled code there that runs as you;"
            " set STICTION_CACHE_DIR (or NUMBA_CACHE_DIR) to a folder of your own"
        )
    return folder
