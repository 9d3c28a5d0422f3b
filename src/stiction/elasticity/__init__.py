"""Linear elasticity: the static and later stress that slip causes between half-spaces or blocks.

Read `protocol` first: it defines the half-spaces, and the elasticity
that methods need. Then read `line`, and `blocks` with `driven`.
`harmonics` and `glued_top` hold the elasticity of a single block.
`columns` and `rig` hold a slider on a base, whose pressure reacts to
the push. Kernels are in `stiffness` (products with K), `weakest`
(critical windows) and `operator` (products by transforms).
`memory_kernels` is the response in time.
"""
