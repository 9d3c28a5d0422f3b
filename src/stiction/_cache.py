"""Where things that were computed once are kept on this machine."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs


def cache_folder() -> Path:
    """`STICTION_CACHE_DIR` if set, else the user's cache folder of the platform."""
    given = os.environ.get("STICTION_CACHE_DIR")
    return Path(given) if given else Path(platformdirs.user_cache_dir("stiction"))
