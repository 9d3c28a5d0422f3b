"""Linear elasticity: what stress slip causes between half-spaces or blocks, at once and later.

Read `protocol`, what methods need, with the half-spaces; then `line`, and `blocks` and `driven`.
`harmonics` and `glued_top` hold the elasticity of one block.
Kernels: `stiffness` (K by its type), `weakest` (critical windows), `operator` (by transforms).
`memory_kernels` is the response in time.
"""
