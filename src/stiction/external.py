"""Functions for the samplers and reliability codes of others: OpenTURNS, UQpy, dynesty, sbi."""

from stiction.inference.simulator import simulator
from stiction.reliability.limit_state import limit_state

__all__ = ["limit_state", "simulator"]
