"""What the distance of the nodes does to an onset: an estimate for the sample at hand.

The same profile is solved on its even and on its odd nodes. The onset converges with the square of
the spacing, so that the error is a third of the difference to a grid twice as coarse. Its sign is
that of chance on random profiles: only its size is estimated, the root mean square of both.
"""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem

ROUGHLY = (
    "single onsets are off by 0.4 % at 9 nodes and by 3 % at 4 for a correlation length of a"
    " quarter of it, by 3 and 9 % for a tenth; Equilibrium(discretization_error=True) estimates it"
)
SHARE = 0.5
"""Estimated error, in per cent of the onset, from which on there is a warning."""


def check(problem: Problem) -> None:
    """`InputError` if every second node is not an even number of nodes."""
    shape = problem.interface.shape
    if any(nodes % 4 for nodes in shape):
        given, enough = (" x ".join(map(str, n)) for n in (shape, [n + -n % 4 for n in shape]))
        raise InputError(
            f"interface.nodes: must be a multiple of four for discretization_error, got {given};"
            f" take {enough}"
        )


def estimate(onset: Array, coarse: list[Array]) -> Array:
    """Size of the error of each onset (Pa), from those on every second node; warns where large."""
    error: Array = np.sqrt(np.mean([(other - onset) ** 2 for other in coarse], axis=0)) / 3.0
    percent = 100.0 * error / np.abs(onset)
    if np.any(percent > SHARE):
        warn_accuracy(
            f"the distance of the nodes changes the first instability by an estimated"
            f" {np.sqrt(np.mean(percent**2)):.2g} % (root mean square of {onset.size} samples, at"
            f" most {percent.max():.2g} %); take more nodes"
        )
    return error
