"""Linear elasticity: the static and later stress that slip causes between half-spaces or blocks.

Read `protocol` first: it defines the half-spaces, and the elasticity
that methods need. Then read `line`, and `blocks` with `driven`.
`harmonics` and `glued_top` hold the elasticity of a single block.
Kernels are in `stiffness` (products with K), `weakest` (critical
windows) and `operator` (products by transforms). `memory_kernels` is
the response in time.
"""
