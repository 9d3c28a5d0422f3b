"""What every other part rests on, and what knows nothing of friction.

`model` makes validated frozen objects and checked functions, `errors` holds what a user is told,
`kinds` tells classes apart by their `type`, `variables` and `units` name quantities. Kernels need
`arrays`, `lanes` and `jit` only; `files` writes whole files; `progress` reports long work.
"""
