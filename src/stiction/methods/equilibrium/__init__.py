"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends.

Read `method` first, then `solver`, which turns samples into onsets. Its function
`follow_to_sliding` is the loop from instability to instability. `events` measures
the events that came to rest. Two algorithms find instabilities: `dense` factors
K, on lines and blocks; `transforms` works on planes, and on lines with thousands
of slipping nodes.
"""
