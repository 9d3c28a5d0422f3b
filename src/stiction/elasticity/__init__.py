"""Linear elasticity: the stress that slip causes between half-spaces or blocks, at once and later.

Read `protocol` first: the half-spaces, and the elasticity that methods need. Then read `line`, and
`blocks` with `driven`. `harmonics` and `glued_top` hold the elasticity of a single block. Kernels
are in `stiffness` (products with K), `weakest` (critical windows) and `operator` (products by
transforms). `memory_kernels` is the response in time.
"""
