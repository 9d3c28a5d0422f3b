"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends.

Read `method`, then `solver`: samples in, onsets out, and in its function `follow` the loop from one
instability to the next; `events` measures those that came to rest. Two algorithms find them:
`dense`, with factors of K, on lines and blocks; `transforms` on planes, and where thousands of
nodes of a line slip.
"""
