"""Elastodynamic rupture: kernels, exponential memory, stepping, loading."""
