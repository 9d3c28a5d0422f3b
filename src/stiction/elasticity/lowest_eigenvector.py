"""Lowest eigenvector of K - W cut to a set of nodes, by single-vector LOBPCG (Knyazev 2001)."""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.conjugate_gradients import Mask, add_scaled, cut, inner
from stiction.elasticity.transform_operator import Operator, filtered, product
from stiction.jit import jit


@jit
def _combine(basis: Array, weights: Array, first: int, count: int, out: Array) -> None:
    out[:] = 0.0
    for k in range(first, count):
        add_scaled(out, weights[k], basis[k])


@jit
def lowest_eigenvector(
    operator: Operator, inside: Mask, vector: Array, tolerance: float, iterations: int
) -> tuple[float, int]:
    """Smallest eigenvalue of A on the nodes `inside`, and its eigenvector.

    Parameters
    ----------
    operator : Operator
    inside : (nx, ny) bool array
    vector : (nx, ny) array, changed
        Guess, then the eigenvector: unit norm, positive sum, zero outside.
    tolerance : float
        Norm of A y - lambda y at which to stop, Pa/m.
    iterations : int

    Returns
    -------
    value : float
        lambda, Pa/m.
    iterations : int
    """
    shape = vector.shape
    basis = np.empty((3, *shape))  # the vector, the preconditioned residual, the last direction
    images = np.empty((3, *shape))
    moved = np.empty(shape)
    basis[0] = vector
    cut(basis[0], inside)
    basis[0] *= 1.0 / np.sqrt(inner(basis[0], basis[0]))
    product(operator, basis[0], images[0])
    cut(images[0], inside)
    value = inner(basis[0], images[0])
    count = 2
    taken = 0
    while taken < iterations:
        moved[:] = images[0]
        add_scaled(moved, -value, basis[0])
        if np.sqrt(inner(moved, moved)) <= tolerance:
            break
        taken += 1
        filtered(operator, operator.inverse, moved, basis[1])
        cut(basis[1], inside)
        product(operator, basis[1], images[1])
        cut(images[1], inside)
        for k in range(1, count):  # orthonormal, so that the small problem is a plain one
            for _ in range(2):
                for m in range(k):
                    overlap = inner(basis[k], basis[m])
                    add_scaled(basis[k], -overlap, basis[m])
                    add_scaled(images[k], -overlap, images[m])
            norm = np.sqrt(inner(basis[k], basis[k]))
            if norm < 1e-14:
                count = k
                break
            basis[k] *= 1.0 / norm
            images[k] *= 1.0 / norm
        if count < 2:
            break
        small = np.empty((count, count))
        for k in range(count):
            for m in range(count):
                small[k, m] = inner(basis[k], images[m])
        values, vectors = np.linalg.eigh(0.5 * (small + small.T))
        value = values[0]
        weights = np.ascontiguousarray(vectors[:, 0])
        _combine(basis, weights, 1, count, moved)
        basis[2] = moved
        basis[0] *= weights[0]
        basis[0] += moved
        _combine(images, weights, 1, count, moved)
        images[2] = moved
        images[0] *= weights[0]
        images[0] += moved
        scale = 1.0 / np.sqrt(inner(basis[2], basis[2]))
        basis[2] *= scale
        images[2] *= scale
        count = 3
    vector[:] = basis[0]
    if vector.sum() < 0.0:
        vector *= -1.0
    return value, taken
