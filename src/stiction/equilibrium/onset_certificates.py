"""Rigorous bounds of the onset load of a plane, checked with one transform each.

For A = K - W, strength less initial stress s and load profile p, the onset is

    max {tau_0 : d >= 0, A d + s - tau_0 p >= 0} = min {<s, y>/<p, y> : y >= 0, A y <= 0}.

Any d >= 0 bounds it from below and any y from above, whatever they were computed with, and for
either choice of wavenumbers: A need not be a Z-matrix.
"""

from __future__ import annotations

import numpy as np

from stiction._jit import jit
from stiction._typing import Array
from stiction.equilibrium.transform_operator import Operator, product


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


@jit
def upper_bound(
    operator: Operator, excess: Array, profile: Array, y: Array, work: Array
) -> float:
    """Bound by a multiplier, which is first made feasible and normalised to <p, y> = 1; Pa.

    Since a uniform field has K 1 = 0, adding epsilon to y lowers A y by epsilon W: the smallest
    epsilon is added that makes A y <= 0 everywhere. Infinite where there is none, because W = 0.

    Parameters
    ----------
    operator, excess, profile, work
        As for `lower_bound`.
    y : (nx, ny) array, changed
    """
    v, s, p = y.reshape(-1), excess.reshape(-1), profile.reshape(-1)
    rate = operator.rate.reshape(-1)
    for i in range(v.size):
        v[i] = max(v[i], 0.0)
    product(operator, y, work)
    image = work.reshape(-1)
    lift = 0.0
    for i in range(v.size):
        if image[i] > 0.0:
            if rate[i] <= 0.0:
                return np.inf
            lift = max(lift, image[i] / rate[i])
    load, weight = 0.0, 0.0
    for i in range(v.size):
        v[i] += lift
        load += s[i] * v[i]
        weight += p[i] * v[i]
    if not weight > 0.0:
        return np.inf
    y *= 1.0 / weight
    return load / weight
