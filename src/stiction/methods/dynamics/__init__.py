"""Ruptures with inertia, between half-spaces and on specimens.

Between half-spaces, read `state` for the equations, then `integrator` for the run
and `method` for its options. Steps of `implicit` follow creep and steps of
`explicit` follow waves, with the memory of `memory`. `diagnostics` finds
instabilities, and `slow_start` shortens the beginning. On specimens, read
`specimens`, `mesh` and `waves`. `simulate` and `save` return and store a run in
space and time.
"""
