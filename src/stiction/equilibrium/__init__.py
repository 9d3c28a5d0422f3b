"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends."""
