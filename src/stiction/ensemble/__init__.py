"""Many samples of random interfaces, and how they are computed and kept.

Read `experiment`: problem, random fields and method as one; sample i follows from (seed, i).
`batches` solves spans of samples by threads or any executor; `store` keeps them in chunks;
`dataset` labels them; `monte_carlo` is the public call, and the loop over what a run lacks.
`pilot` compares with the exact onset, `limit_state` is the onset as a function of draws.
"""
