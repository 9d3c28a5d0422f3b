"""Failure probability: how likely does the interface slide below a given stress?

Read `failure`, which chooses the algorithm, and `answer`, the result and its checks.
Estimates come from `counting`, or from a `tail`: independent repetitions of `subset`
simulation, or of `two_level` where an inexpensive method guides the exact one.
`uncertainty` has intervals and the variance of correlated chains. Curves on disk are
`study.failure`.
"""
