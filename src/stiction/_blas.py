"""BLAS with one thread, from the first who asks for it to the last, whatever their order."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

_lock = threading.Lock()
_asking = 0
_limit: threadpool_limits | None = None


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """The number of threads is one of the process: two limits of which the first to begin is the
    first to end would leave it at what the second one found, for good."""
    global _asking, _limit
    with _lock:
        if not _asking:
            _limit = threadpool_limits(limits=1, user_api="blas")
        _asking += 1
    try:
        yield
    finally:
        with _lock:
            _asking -= 1
            if not _asking and _limit is not None:
                _limit.restore_original_limits()
                _limit = None
