"""The study of Albertini et al. (2020), recomputed with public names of `stiction` only."""

from typing import Any

PARAMETERS: dict[str, Any] = {}
"""Tables of a study file that replace the paper's; the command fills them in before it imports
any other module."""
