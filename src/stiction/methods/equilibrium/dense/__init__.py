"""Onsets by factors of the stiffness: lines and blocks.

Read `program`, which puts the parts together: windows bound the load, `linear_program` finds it by
an active set over `cholesky`, `runaway` is its shortcut, `stable_path` goes from event to event
and `jump` beyond an instability.
"""
