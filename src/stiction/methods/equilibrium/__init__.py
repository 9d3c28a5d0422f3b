"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends.

Read `method`, then `solver`: samples in, onsets out, and in its function `follow_to_sliding` the
loop from one instability to the next; `events` measures the events that came to rest. Two
algorithms find instabilities: `dense`, with factors of K, on lines and blocks; `transforms` on
planes, and on lines of which thousands of nodes slip.
"""
