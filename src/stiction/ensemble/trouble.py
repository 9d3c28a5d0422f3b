"""What can go wrong in a run that is not a mistake in the study."""

from __future__ import annotations


class RunError(RuntimeError):
    """A run cannot go on; what was stored stays, and the message says what to do."""


class StoreError(RunError):
    """A folder or file cannot be used or written."""


class WorkerError(RunError):
    """Workers died or could not be reached."""
