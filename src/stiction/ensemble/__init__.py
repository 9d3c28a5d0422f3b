"""Many samples of random interfaces: how they are computed and kept.

Begin with `experiment`: it joins problem, random fields and method, and sample i follows
from (seed, i). `batches` solves spans of samples by threads or any executor, `store`
keeps them in chunks, and `dataset` labels them. `monte_carlo` has the public call and the
loop over missing samples. `pilot` compares with the exact onset. `limit_state` is the
onset as a function of draws.
"""
