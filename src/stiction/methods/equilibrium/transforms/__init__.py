"""Onsets by Fourier transforms: planes, and long lines of which thousands of nodes slip.

Read `plane`, which puts the parts together. `bracket` bounds the load from both
sides, `turning_point` finds it, `relaxation` jumps beyond it, and `fold` follows
the end of a stable path. All of them solve `held_equilibrium` again and again.
"""
