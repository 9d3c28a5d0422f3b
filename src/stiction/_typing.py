"""Types of arrays: numpy's element types change their names between releases, so Array has none."""

from __future__ import annotations

from typing import Any, TypeAlias

from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""Array of floats, double precision unless said otherwise."""
