"""Critical windows of a specimen, where the nucleation length depends on the place.

Blocks of K inside others have larger eigenvalues: the shortest unstable run that begins at a node
ends the further on the later it begins.
"""

import numpy as np
import scipy.linalg

from stiction.base.arrays import Array
from stiction.elasticity.protocol import Windows

FINEST = 32
"""Windows that begin within the length of one, at most: weighted means change little between."""


def _unstable(matrix: Array, rate: float, begin: int, end: int) -> bool:
    block = matrix[begin:end, begin:end].copy()
    block.flat[:: end - begin + 1] -= rate
    return bool(scipy.linalg.lapack.dpotrf(block, lower=1, overwrite_a=1)[1] > 0)


def shortest_runs(matrix: Array, rate: float) -> list[tuple[int, int]]:
    """Return first node and end of the shortest unstable runs of K (n, n) at a rate, Pa/m."""
    n, runs = len(matrix), []
    begin, end, step = 0, 1, 1
    while begin < n:
        end = min(max(end, begin + 1), n)
        while not (unstable := _unstable(matrix, rate, begin, end)) and end < n:
            end += 1
        while unstable and end - begin > 1 and _unstable(matrix, rate, begin, end - 1):
            end -= 1
        if not unstable and step == 1:
            break
        if unstable:
            runs.append((begin, end))
            step = max(1, (end - begin) // FINEST)
            begin, end = begin + step, end + step
        else:  # the last run ends with the specimen
            begin, end, step = begin - step + 1, n, 1
    return runs


def windows_at(matrix: Array, rate: float) -> Windows:
    """Return the windows of a stiffness K (n, n) at one weakening rate, Pa/m."""
    runs = shortest_runs(matrix, rate)
    modes = np.zeros((len(runs), max((end - begin for begin, end in runs), default=1)))
    for row, (begin, end) in zip(modes, runs, strict=True):
        _, vectors = scipy.linalg.eigh(
            matrix[begin:end, begin:end], subset_by_index=[0, 0], check_finite=False
        )
        row[: end - begin] = np.abs(vectors[:, 0])
        row /= row.sum()
    starts, ends = np.array(runs, dtype=np.int64).reshape(-1, 2).T
    return Windows(np.full(len(runs), rate), starts.copy(), ends - starts, modes)
