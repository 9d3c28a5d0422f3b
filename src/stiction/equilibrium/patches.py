"""Patches on the circle: how many slip, where the critical one is, how long."""

from __future__ import annotations

from stiction.arrays import Array
from stiction.jit import jit


@jit
def count_patches(slip: Array) -> int:
    """Number of runs of slipping nodes on the circle."""
    n = slip.shape[0]
    count = 0
    for i in range(n):
        if slip[i] > 0.0 and not slip[i - 1 if i else n - 1] > 0.0:
            count += 1
    if count == 0 and slip[0] > 0.0:
        count = 1
    return count


@jit
def main_patch(field: Array) -> tuple[int, int, float]:
    """First node, length and centroid (in nodes, from 0 to n) of the run with the largest entry.

    Parameters
    ----------
    field : (n,) array
        Not negative; runs are where it is positive.
    """
    n = field.shape[0]
    peak = 0
    for i in range(n):
        if field[i] > field[peak]:
            peak = i
    start = peak
    length = 1
    while length < n and field[start - 1 if start else n - 1] > 0.0:
        start = start - 1 if start else n - 1
        length += 1
    end = peak
    while length < n:
        end = end + 1 if end < n - 1 else 0
        if not field[end] > 0.0:
            break
        length += 1
    if length == n:
        # Everything slips: a centre exists only with respect to the largest entry.
        start = (peak + n // 2 + 1) % n
    weight = 0.0
    moment = 0.0
    for q in range(length):
        value = field[(start + q) % n]
        weight += value
        moment += value * q
    centre = start + moment / weight
    return start, length, centre - n if centre >= n else centre
