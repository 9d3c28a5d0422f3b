"""Linear elasticity: what stress slip causes between half-spaces or blocks, at once and later.

Read `protocol`, what methods need; `half_spaces` and `line`, then `blocks` and `driven`, have it.
Kernels: `stiffness` (K by its type), `weakest` (critical windows), `operator` and `linear` (by
transforms). `memory_kernels` and `exponential_sum` are the response in time.
"""
