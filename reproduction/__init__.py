"""The study of Albertini et al. (2020), recomputed with public names of `stiction` only."""

PARAMETERS: dict[str, float] = {}
"""What replaces the paper's; the command fills it in before it imports any other module."""
