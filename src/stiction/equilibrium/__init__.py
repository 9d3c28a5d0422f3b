"""Exact quasi-static onset: the load, the slip and the patch at which equilibrium ends.

Read `method`, then for lines `solver`, `linear_program` and `continuation`, for planes
`plane_solver`, `plane_onset` (with `transform_operator`, `onset_bracket` and `turning_point`) and
`follow_plane` (with `least_equilibrium`).
"""
