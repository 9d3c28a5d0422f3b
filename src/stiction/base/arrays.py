"""Arrays: their type, and BLAS with a single thread."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""Array of floats, double precision unless said otherwise."""


_lock = threading.Lock()
_users = 0
_limit: Any = None


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS at a single thread from the first user's entry to the last user's exit.

    The number of threads belongs to the process.
    If two limits overlapped, the later exit would
    otherwise restore the limit of the other user.

    Examples
    --------
    >>> from unittest.mock import patch
    >>> with patch("threadpoolctl.threadpool_limits") as limits:
    ...     restore = limits.return_value.restore_original_limits
    ...     for _ in range(2):
    ...         with one_blas_thread():
    ...             with one_blas_thread():
    ...                 pass
    ...             print(restore.call_count, limits.call_count)
    ...         print(restore.call_count, limits.call_args)
    0 1
    1 call(limits=1, user_api='blas')
    1 2
    2 call(limits=1, user_api='blas')
    """
    global _users, _limit
    from threadpoolctl import threadpool_limits

    with _lock:
        if not _users:
            _limit = threadpool_limits(limits=1, user_api="blas")
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if not _users and _limit is not None:
                _limit.restore_original_limits()
                _limit = None
