"""The foundation of all other parts, which contains no friction.

`model` makes validated frozen objects and checked functions. `errors`
holds errors and warnings, `kinds` selects classes by their `type`, and
`variables` and `units` name quantities. Kernels need only `arrays`,
`lanes` and `jit`. `files` and `netcdf` read and write files, and
`progress` reports long work.
"""
