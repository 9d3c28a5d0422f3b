"""Archives of arrays: written whole or not at all, and read with suspicion."""

from __future__ import annotations

import os
import struct
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# What damaged archives have been seen to raise.
UNREADABLE = (
    OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError,
    SyntaxError, zipfile.BadZipFile, zlib.error, struct.error,
)  # fmt: skip


def write_atomically(path: Path, arrays: dict[str, Any]) -> None:
    """Write an .npz aside, sync it, rename it: the old file stays whole until the new one is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as stream:
        try:
            np.savez(stream, **arrays)
            stream.flush()
            os.fsync(stream.fileno())
        except BaseException:
            os.unlink(stream.name)
            raise
    os.replace(stream.name, path)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an .npz; one of `UNREADABLE` or FileNotFoundError if it is not one."""
    with open(path, "rb") as stream:
        data = np.load(stream, allow_pickle=False)
        if not isinstance(data, np.lib.npyio.NpzFile):
            raise ValueError("it holds one array only")
        return {name: data[name] for name in data.files}
