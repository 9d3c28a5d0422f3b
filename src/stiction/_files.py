"""Files that are whole or not there."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

PART = ".part"


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
    aside = path.with_name(path.name + PART)
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
