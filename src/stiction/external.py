"""Functions for external programs: samplers, reliability codes, and the SCEC comparison."""

from stiction.dynamics.scec import write_scec
from stiction.ensemble.limit_state import limit_state
from stiction.inference.simulator import simulator

__all__ = ["limit_state", "simulator", "write_scec"]
