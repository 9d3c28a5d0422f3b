"""Standard normal draws that depend on (seed, stream, sample, mode) and on nothing else.

A generator for each sample of a line would cost more than the sample, so samples come in blocks of
256, with one generator a block; inside a block the draws run mode after mode, so that a spectrum
with more modes extends the same field. A sample of a plane has so many modes that it has a
generator, a block of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array

BLOCK = 256


def block_of(dimensions: int) -> int:
    """How many samples share a generator on a line (1) or a plane (2)."""
    return BLOCK if dimensions == 1 else 1


def _block(seed: int, stream: int, block: int, modes: int, size: int) -> Array:
    """Draws A_j, B_j of modes 0..modes for one block, shape (2 (modes + 1), size)."""
    place = (stream, block) if size == BLOCK else (stream, block, size)
    key = np.random.SeedSequence(entropy=seed, spawn_key=place)
    generator = np.random.Generator(np.random.PCG64DXSM(key))
    return generator.standard_normal((2 * (modes + 1), size))


def standard_normal(
    seed: int,
    samples: int,
    ranks: NDArray[np.int64],
    *,
    first: int = 0,
    stream: int = 0,
    mean_mode: bool = False,
    block: int = BLOCK,
) -> Array:
    """Draws of `samples` samples from number `first` on.

    Parameters
    ----------
    seed, samples, first, stream : int
    ranks : (modes,) array
        Which modes, rising: those of rank 1, 2, ... where none is left out.
    mean_mode : bool
    block : int
        Samples that share a generator.

    Returns
    -------
    (samples, dimension) array
        A, B of one mode after the other, with A_0 in front if `mean_mode`.
    """
    samples, first = int(samples), int(first)  # small numpy integers would overflow
    modes = int(ranks[-1]) if ranks.size else 0
    start = 0 if mean_mode else 1
    kept: slice | NDArray[np.int64] = slice(2, None)
    if mean_mode or ranks.size < modes:
        pairs = (2 * ranks[:, None] + np.arange(2)).ravel()
        kept = np.concatenate(([0], pairs)) if mean_mode else pairs
    draws = np.empty((samples, 2 * ranks.size + 1 - start))
    done = 0
    while done < samples:
        number, offset = divmod(first + done, block)
        count = min(block - offset, samples - done)
        rows = _block(seed, stream, number, modes, block)
        draws[done : done + count] = rows[kept, offset : offset + count].T
        done += count
    return draws
