"""Failure probability: how likely does the interface slide below a given stress?

Read `failure`, which chooses the algorithm, and `answer`, which holds the result
and its checks. `counting` estimates frequent failures. `tail` estimates rare
failures from independent repetitions of `subset` simulation, or of `two_level`, in
which an inexpensive method guides the exact method. `uncertainty` computes
intervals and the variance of correlated chains. `study.failure` keeps curves on
disk.
"""
