"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends.

Read `method`, then `solver`: samples in, onsets out, and in its function `follow` the loop from one
instability to the next. Two programmes find the instabilities: `dense` on lines, with
`linear_program`, `windows`, `runaway`, `stable_path` and `jump`; `transforms` on planes, and where
thousands of nodes of a line slip, with `bracket`, `turning_point`, `relaxation` and `fold`.
"""
