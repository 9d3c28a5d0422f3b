"""Standard normal draws that depend on (seed, stream, sample, mode) and on nothing else.

A generator for each sample would cost more than the sample, so samples come in blocks of 256, with
one generator a block; inside a block the draws run mode after mode, so that a spectrum with more
modes extends the same field.
"""

from __future__ import annotations

import numpy as np

from stiction._typing import Array

BLOCK = 256


def _block(seed: int, stream: int, block: int, modes: int) -> Array:
    """Draws A_j, B_j of modes 0..modes for one block, shape (2 (modes + 1), 256)."""
    key = np.random.SeedSequence(entropy=seed, spawn_key=(stream, block))
    generator = np.random.Generator(np.random.PCG64DXSM(key))
    return generator.standard_normal((2 * (modes + 1), BLOCK))


def standard_normal(
    seed: int, samples: int, modes: int, *, first: int = 0, stream: int = 0, mean_mode: bool = False
) -> Array:
    """Draws of `samples` samples from number `first` on.

    Returns
    -------
    (samples, dimension) array
        A_1, B_1, A_2, B_2, ..., with A_0 in front if `mean_mode`.
    """
    samples, first = int(samples), int(first)  # small numpy integers would overflow
    start = 0 if mean_mode else 1
    kept = [0] * mean_mode + list(range(2, 2 * (modes + 1)))
    draws = np.empty((samples, 2 * modes + 1 - start))
    done = 0
    while done < samples:
        block, offset = divmod(first + done, BLOCK)
        count = min(BLOCK - offset, samples - done)
        rows = _block(seed, stream, block, modes)
        columns = slice(offset, offset + count)
        if mean_mode:
            draws[done : done + count] = rows[kept, columns].T
        else:
            draws[done : done + count] = rows[2:, columns].T
        done += count
    return draws
