"""Exact quasi-static onset: the load, slip and patch at which equilibrium ends.

Read `method` first, then `solver`, which turns samples into
onsets. Its function `follow_to_sliding` loops from
instability to instability. `events` computes the variables of
events that came to rest. Two algorithms find instabilities.
`dense` factors K, for lines and blocks. `transforms` is for
planes, and for lines with thousands of slipping nodes. `slider` and
`contact_path` are for a slider on a base, whose pressure depends on
load and slip.
"""
