"""Onsets from Fourier transforms, for planes and for lines with thousands of slipping nodes.

Read `plane`, which puts the parts together. `bracket` bounds the onset
load from both sides, and `turning_point` finds the load. `relaxation`
follows the jump, and `fold` follows the end of a stable path. All of
them solve `held_equilibrium` repeatedly.
"""
