"""Where things that were computed once are kept on this machine."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

from stiction.errors import InputError


def cache_folder() -> Path:
    """`STICTION_CACHE_DIR` if set, else the user's cache folder of the platform."""
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
