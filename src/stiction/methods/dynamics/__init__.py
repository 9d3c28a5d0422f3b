"""Ruptures with inertia, between half-spaces and on specimens.

Between half-spaces, read `state` for the equations, then `integrator`
for the run and `method` for its options. Steps in `implicit` follow
creep, and steps in `explicit` follow waves. `memory` holds past slip
rates. `diagnostics` finds instabilities, and `slow_start` shortens the
beginning. On specimens, read `specimens`, `mesh` and `waves`.
`simulate` and `save` return and store a run in space and time.
"""
