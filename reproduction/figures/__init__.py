"""Figures of one column: each is a function of the studies and returns a matplotlib figure."""
