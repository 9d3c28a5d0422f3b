"""Compute and keep many samples of random interfaces.

Begin with `experiment`, which joins the problem, the random fields and
the method. Sample i follows from (seed, i). `batches` solves spans of
samples in threads or any executor, `store` keeps the samples in chunks,
and `dataset` labels them. `monte_carlo` holds the public function and
the loop over missing samples. `pilot` compares approximate with exact
onsets. `limit_state` returns the onset as a function of draws.
"""
