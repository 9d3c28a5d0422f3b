"""Critical windows of a specimen, where the nucleation length depends on the place.

A run of nodes whose block of K has its smallest eigenvalue at or below the weakening rate is
unstable by itself. Its eigenvector y is positive where K has no positive entry off its diagonal,
and K y <= W y: so <s, y>/<q, y> bounds the load of the first instability from above, s being the
strength less initial stress and q the load profile. Blocks inside others have larger eigenvalues:
the shortest unstable run that begins at a node ends the further on the later it begins.
"""

from functools import lru_cache

import numpy as np
import scipy.linalg

from stiction.base.arrays import Array
from stiction.elasticity.driven import Driven
from stiction.elasticity.weakest import Places

FINEST = 32
"""Windows that begin within the length of one, at most."""


def _unstable(matrix: Array, rate: float, begin: int, end: int) -> bool:
    block = matrix[begin:end, begin:end].copy()
    block.flat[:: end - begin + 1] -= rate
    return bool(scipy.linalg.lapack.dpotrf(block, lower=1, overwrite_a=1)[1] > 0)


def make_places(matrix: Array, rate: float) -> Places:
    """Return the shortest unstable runs of a stiffness K (n, n) at a weakening rate, Pa/m."""
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
    modes = np.zeros((len(runs), max((end - begin for begin, end in runs), default=1)))
    for row, (begin, end) in zip(modes, runs, strict=True):
        _, vectors = scipy.linalg.eigh(
            matrix[begin:end, begin:end], subset_by_index=[0, 0], check_finite=False
        )
        row[: end - begin] = np.abs(vectors[:, 0])
        row /= row.sum()
    starts, ends = np.array(runs, dtype=np.int64).reshape(-1, 2).T
    return Places(rate, starts.copy(), ends - starts, modes)


@lru_cache(maxsize=32)
def places_of(blocks: Driven, rate: float) -> Places:
    """Return the shortest unstable runs of blocks; none if they are stable as a whole."""
    return make_places(blocks.stiffness, rate)
