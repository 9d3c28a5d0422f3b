"""Failure probability: how likely does the interface slide below a given stress?

Read `failure`, which chooses and asks, and `answer`, what comes out and what answers share.
Estimates come from `counting`, or from a `tail`: independent repetitions of `subset`
simulation, or of `two_level` where an inexpensive method guides the exact one. `uncertainty`
has intervals and the variance of correlated chains. Curves on disk are `study.failure`.
"""
