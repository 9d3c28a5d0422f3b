"""Figures of one column: each function returns a matplotlib figure and its lettered panels."""
