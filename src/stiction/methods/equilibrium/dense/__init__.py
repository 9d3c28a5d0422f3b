"""Onsets by factors of the stiffness: lines and blocks.

Read `program`, which puts the parts together. Windows bound the load, and
`linear_program` finds it by an active set over the factor of `cholesky`.
`stable_path` goes from event to event, and `jump` beyond an instability, with
`runaway` as a shortcut.
"""
