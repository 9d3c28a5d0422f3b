"""Many samples of random interfaces, and how they are computed and kept.

Read `experiment`: problem, random fields and method as one, whose sample i follows from (seed, i).
`batches` solves spans of samples by threads or any executor; `items` is the loop over what a run
lacks; `store` keeps it in chunks; `dataset` labels it; `monte_carlo` is the public call. `pilot`
compares with the exact onset, `limit_state` is the onset as a function of draws.
"""
