"""Functions for external samplers and reliability codes: OpenTURNS, UQpy, dynesty, sbi."""

from stiction.ensemble.limit_state import limit_state
from stiction.inference.simulator import simulator

__all__ = ["limit_state", "simulator"]
