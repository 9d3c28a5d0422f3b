"""Rigorous bounds of the onset load of a plane, checked with one transform each.

For A = K - W, strength less initial stress s and load profile p, the onset is

    max {tau_0 : d >= 0, A d + s - tau_0 p >= 0} = min {<s, y>/<p, y> : y >= 0, A y <= 0}.

Any d >= 0 bounds it from below and any y from above, whatever they were computed with, and for
either choice of wavenumbers: A need not be a Z-matrix.
"""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.elasticity.transform_operator import Operator, filtered, product
from stiction.jit import jit


@jit
def lower_bound(
    operator: Operator, excess: Array, profile: Array, slip: Array, work: Array
) -> float:
    """Largest load at which the slip d, cut at zero, overloads no node, Pa.

    Parameters
    ----------
    operator : Operator
    excess, profile : (nx, ny) arrays
        s (Pa) and p > 0.
    slip : (nx, ny) array, changed
        d, m; negative values become zero.
    work : (nx, ny) array
        Overwritten.
    """
    d, s, p = slip.reshape(-1), excess.reshape(-1), profile.reshape(-1)
    for i in range(d.size):
        d[i] = max(d[i], 0.0)
    product(operator, slip, work)
    stress = work.reshape(-1)
    load = np.inf
    for i in range(d.size):
        load = min(load, (stress[i] + s[i]) / p[i])
    return load


def lifting_field(operator: Operator) -> tuple[Array, Array]:
    """A field z > 0 with A z < 0 at every node, and -A z (Pa/m), to make multipliers feasible.

    Where W > 0 everywhere it is uniform: K 1 = 0, so -A 1 = W. Otherwise z = 1 - 0.4 g with
    (K + w) g = w where W = 0 and zero elsewhere, w the smallest positive W: for a Z-matrix
    0 <= g < 1, and -A z is 0.4 w (1 - g) where W = 0 and at least W - 0.4 (w + W) g > 0 elsewhere.
    """
    field = np.ones(operator.rate.shape)
    free = operator.rate <= 0.0
    if free.any() and not free.all():
        least = float(operator.rate[~free].min())
        pushed = np.empty_like(field)
        filtered(operator, least / (operator.symbol + least), free.astype(np.float64), pushed)
        field -= 0.4 * pushed
    image = np.empty_like(field)
    product(operator, field, image)
    return field, -image


@jit
def upper_bound(
    operator: Operator,
    excess: Array,
    profile: Array,
    y: Array,
    lifting: Array,
    lifted: Array,
    work: Array,
) -> float:
    """Bound by a multiplier, which is first made feasible and normalised to <p, y> = 1; Pa.

    The least multiple of z is added that makes A y <= 0 everywhere; infinite where there is none.

    Parameters
    ----------
    operator, excess, profile, work
        As for `lower_bound`.
    y : (nx, ny) array, changed
    lifting, lifted : (nx, ny) arrays
        z and -A z of `lifting_field`.
    """
    v, s, p = y.reshape(-1), excess.reshape(-1), profile.reshape(-1)
    z, relief = lifting.reshape(-1), lifted.reshape(-1)
    for i in range(v.size):
        v[i] = max(v[i], 0.0)
    product(operator, y, work)
    image = work.reshape(-1)
    lift = 0.0
    for i in range(v.size):
        if relief[i] <= 0.0 and image[i] > 0.0:
            return np.inf
        if image[i] > lift * relief[i]:
            lift = image[i] / relief[i]
    load, weight = 0.0, 0.0
    for i in range(v.size):
        v[i] += lift * z[i]
        load += s[i] * v[i]
        weight += p[i] * v[i]
    if not weight > 0.0:
        return np.inf
    y *= 1.0 / weight
    return load / weight
