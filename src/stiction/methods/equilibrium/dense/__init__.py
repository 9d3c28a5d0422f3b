"""Onsets on lines and in blocks, from factors of the stiffness.

Read `search`, which puts the parts together. Windows bound the load,
and `linear_program` finds the load with an active set and the factor
from `cholesky`. `stable_path` follows equilibria from event to event.
`jump` follows an instability, and `runaway` is a shortcut.
"""
