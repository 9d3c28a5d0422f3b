"""Versions on which the last digits of a result depend: the same on every worker."""

from __future__ import annotations

from functools import cache

import numba
import numpy as np

from stiction import __version__
from stiction.errors import WorkerError


@cache
def versions() -> str:
    """Versions of stiction, numpy and numba where this runs, as one line of text."""

    return f"stiction {__version__}, numpy {np.__version__}, numba {numba.__version__}"


def refuse_other_versions(expected: str) -> None:
    """Refuse to work for a process that has other versions.

    Raises
    ------
    WorkerError
        Naming this machine, its versions and the expected ones.
    """
    if expected != versions():
        import socket

        raise WorkerError(
            f"a worker on {socket.gethostname()} has {versions()}, the run has {expected}; install"
            " the same versions there, or end that worker"
        )
