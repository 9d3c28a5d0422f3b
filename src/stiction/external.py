"""Functions for external programs: samplers, reliability codes, and the SCEC comparison."""

from stiction.ensemble.limit_state import limit_state
from stiction.inference.simulator import simulator
from stiction.methods.dynamics.scec import write_scec

__all__ = ["limit_state", "simulator", "write_scec"]
