"""Failure probability: how likely does the interface slide below a given stress?

Read `failure`, which chooses the algorithm, and `answer`, which holds
the result and its checks. `design` and `curve` use the same algorithms
for a design stress and for a failure curve. `counting` estimates
frequent failures, and counts many specimens for each solved field if
this costs less. `tail` estimates rare failures from independent
repetitions of `subset` simulation, or of `two_level`, in which an
inexpensive method guides the exact method.
"""
